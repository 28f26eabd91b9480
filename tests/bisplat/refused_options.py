"""Options that can do nothing beside the rest of their call, and are refused."""

from tests.bisplat.option_trials import FIELD

AN_IMPORT = "expected a file to import, found the scene closet"
AGAIN = "expected a scene, found the dataset data, which is made again with its own settings"
SOLVED = f"simulate closet -o out --engine fullwave --field {FIELD}"
NONE_SOLVED = f"expected none beside --field, found the solved field of {FIELD}"
POWERS = "rssi closet -o out --gateways gateways.yml"
OF_STEPS = "expected a model trained by steps, found"
OF_METHODS = "expected a method trained by steps, found"

REFUSED: dict[str, str] = {
    "scene closet --material wall=wood": f"--material: {AN_IMPORT}",
    "scene closet --default-material wood": f"--default-material: {AN_IMPORT}",
    "scene closet --unit m": f"--unit: {AN_IMPORT}",
    "scene closet --up z": f"--up: {AN_IMPORT}",
    "scene closet --frequency 2.4": (
        "--frequency: expected hertz, from 1e6 to 1e12, or a number with its unit such as \"915 MHz\", found '2.4'"
    ),
    "scene closet --array 4by4": "--array: expected ROWSxCOLUMNS or ROWSxCOLUMNS@SPACING in wavelengths, such as 8x8",
    "simulate closet -o out --array nowhere.csv": "nowhere.csv: expected a CSV of positions, found no such file",
    "scene closet --array same.csv": "same.csv: expected each element at a place of its own, found elements 0 and 1",
    "dataset recording.npz --frequency 2.4GHz --array elements.csv -o out --columns-first True": (
        "--columns-first: expected a planar array, found True for elements in the order of their positions"
    ),
    "simulate closet -o out --array 0x4": "closet: gateway.rows and columns must be at least 1",
    "scene wall.obj --list --array 4x4": "--array: expected none beside --list",
    "simulate data -o out --frequency 2.4GHz": f"--frequency: {AGAIN}",
    "simulate data -o out --array 2x2": f"--array: {AGAIN}",
    "scene closet --gateway 1 1 1": f"--gateway: {AN_IMPORT}",
    "scene closet --boresight=1 0 0": f"--boresight: {AN_IMPORT}",
    "scene closet --pattern iso": f"--pattern: {AN_IMPORT}",
    "scene closet --region_min 1 1 1": f"--region-min: {AN_IMPORT}",
    "scene closet --region-max 1 1 1": f"--region-max: {AN_IMPORT}",
    "scene closet --list": f"--list: {AN_IMPORT}",
    "scene closet --shift 0 0 0": f"--shift: {AN_IMPORT}",
    "scene closet --walls as-drawn": f"--walls: {AN_IMPORT}",
    "scene closet --own-material wet=15,2,0.1": f"--own-material: {AN_IMPORT}",
    "scene wall.obj --list -o out": "-o: expected none beside --list",
    "scene wall.obj --list --walls as-drawn": "--walls: expected none beside --list",
    "scene closet --port 8080": "--port: expected --view beside it, found none",
    "scene closet --view --json": "--json: expected none beside --view, which prints no description",
    "scene closet --view --force": "--force: expected none beside --view, which asks before it replaces a scene",
    "scene wall.obj --material a=wood --material b=wood": "--material: expected once, with all its values",
    "simulate data -o out -n5": f"-n: {AGAIN}",
    "simulate data -o out --seed 0": f"--seed: {AGAIN}",
    "simulate data -o out --engine fullwave": f"--engine: {AGAIN}",
    "simulate data -o out --snr 10": f"--snr: {AGAIN}",
    "simulate data -o out --no-los": f"--no-los: {AGAIN}",
    "simulate data -o out --cell 0.05": f"--cell: {AGAIN}",
    "simulate closet -o out --positions places.csv -n 2": "--positions and -n: expected one of them, found both",
    "simulate closet -o out --positions places.csv --placement uniform": (
        "--placement: expected none beside --positions, found the positions of places.csv"
    ),
    "simulate closet -o out --los --no-los": "--los and --no-los: expected one of them, found both",
    "simulate closet -o out --snr 3 --snr-db 3": "--snr and --snr-db: expected one of them, found both",
    "simulate closet -o out --bandwidth 20MHz": "--subcarriers: expected their number beside the bandwidth, found none",
    "simulate closet -o out --subcarriers 64": "--subcarriers: expected a bandwidth beside it, found 64",
    "simulate closet -o out --bandwidth 400MHz --subcarriers 64": "--bandwidth: expected at most 20% of the carrier",
    "simulate closet -o out --bandwidth 20MHz --subcarriers 64 --sionna": "--bandwidth: expected none with Sionna's",
    "simulate closet -o out --bandwidth 20MHz --subcarriers 64 --frequencies 1GHz": "--bandwidth: expected no band",
    "simulate closet -o out --frequencies 1GHz 1GHz": "--frequencies: expected different frequencies, found",
    f"{SOLVED} --frequencies 2.4GHz": f"{FIELD}: expected a field at 2400 MHz, found one at 915 MHz",
    "simulate data -o out --moving receiver": f"--moving: {AGAIN}",
    "simulate data -o out --transmitters 2 --moving both": f"--transmitters: {AGAIN}",
    "simulate data -o out --receivers places.csv --positions places.csv --moving both": f"--receivers: {AGAIN}",
    "simulate closet -o out --moving both": "--transmitters: expected how many places the transmitter has, since both",
    "simulate closet -o out --transmitters 2": "--transmitters: expected none unless both ends move, found some beside",
    "simulate closet -o out --receivers places.csv": "--receivers: expected none unless both ends move, found some",
    "simulate closet -o out --moving both --positions places.csv": "--receivers: expected the array's places beside",
    "simulate closet -o out --moving both --transmitters 2 --engine fullwave": (
        "--moving: expected transmitter or receiver in full wave, found both; --moving receiver solves one transmitter"
    ),
    "simulate closet -o out --moving both --positions places.csv --receivers others.csv": (
        "others.csv: expected a row for each of the 2 positions, found 1"
    ),
    "dataset recording.npz --frequency 2.4GHz --array 4x4@0.5 -o out --receivers elsewhere": (
        "--receivers: expected none unless both ends move, found some beside moving transmitter"
    ),
    "dataset recording.npz --frequency 2.4GHz --array 4x4@0.5 -o out --moving both --gateway 1 1 1": (
        "--gateway: expected none beside --moving both, where the receivers' positions are those of the array"
    ),
    "convert measured -o out --moving both": "measured/rx_pos.csv: expected a CSV of positions, found no such file",
    "simulate closet -o out --field data": "--field: expected the engine fullwave, found rays",
    "simulate closet -o out --no-gpu": "--no-gpu: expected the engine fullwave, found rays",
    "simulate closet -o out --engine fullwave --max-depth 3": "--max-depth: expected the engine rays, found fullwave",
    "simulate closet -o out --engine fullwave --no-los": "--no-los: expected the engine rays, found fullwave",
    f"{SOLVED} --cell 0.05": f"--cell: {NONE_SOLVED}",
    f"{SOLVED} --gpu": f"--gpu: {NONE_SOLVED}",
    f"{SOLVED} --workers 2": f"--workers: {NONE_SOLVED}",
    f"{SOLVED} --ray localhost:6379": f"--ray: {NONE_SOLVED}",
    "simulate closet -o out --max-depth 0 --diffraction": "--diffraction: expected a --max-depth above 0",
    "simulate closet -o out --max-depth 0 --rays 9": "--rays: expected a --max-depth above 0",
    "simulate closet -o out --patches 9": "--patches: expected --diffuse with it, found no diffuse reflection",
    "simulate closet -o out --sionna --diffuse --patches 9": "--patches: expected none with --sionna",
    "simulate closet -o out --sionna --slab-phase": "--slab-phase: expected none with --sionna",
    "simulate closet -o out --diffuse": "--diffuse: expected an object whose material has a scattering_coefficient",
    f"{POWERS} --positions places.csv --placement grid": (
        "--placement: expected none beside --positions, found the positions of places.csv"
    ),
    f"{POWERS} --positions places.csv -n 2": "--positions and -n: expected one of them, found both",
    f"{POWERS} --floor -90 --floor-dbm -90": "--floor and --floor-dbm: expected one of them, found both",
    f"{POWERS} --max-depth 0 --rays 9": "--rays: expected a --max-depth above 0",
    f"{POWERS} --diffuse": "--diffuse: expected an object whose material has a scattering_coefficient",
    f"{POWERS} --frequency 2.4": "--frequency: expected hertz",
    "train data -o out --preset paper --model mlp": "--model: expected none beside --preset, found paper, which is",
    "train data -o out --model mlp --budget 1 --steps 5": "--steps: expected none beside --budget, which is turned",
    "train data -o out --budget 1": f"--budget: {OF_STEPS} helmholtz",
    "train data -o out --model mlp --option pixel=9": "--option: pixel: expected an option of the model mlp, which has",
    "train data -o out --model mlp --option pixels": "--option: expected NAME=VALUE, such as primitives=250, found",
    "train data -o out --model mlp --encoding waves --option encoding=octaves": (
        "--option: expected each option once, found encoding twice"
    ),
    "train data -o out --devices 1": f"--devices: {OF_STEPS} helmholtz",
    "train data -o out --nodes 2": f"--nodes: {OF_STEPS} helmholtz",
    "train data -o out --find-phases": f"--find-phases: {OF_STEPS} helmholtz",
    "train data -o out --steps 9": f"--steps: {OF_STEPS} helmholtz",
    "train data -o out --scene lab": "--scene: expected an option of the model helmholtz",
    "train data -o out --scene=": "--scene: expected an option of the model helmholtz",
    "train data -o out --model mlp --bypass bst": "--bypass: expected an option of the model mlp",
    "train data -o out --model mlp --find-phases": "--find-phases: expected a model that predicts responses, found mlp",
    "train data -o out --model mlp-responses --no-find-phases": (
        "--no-find-phases: expected a dataset of pictures alone, found data, from whose responses mlp-responses learns"
    ),
    "train data -o out --model mlp-responses --full-resolution 1": (
        "--full-resolution: expected a dataset of pictures alone, found data, from whose responses mlp-responses learns"
    ),
    "train data -o out --model nerf2 --full-resolution 1": (
        "--full-resolution: expected a model that can train on a few pixels, found nerf2"
    ),
    "evaluate mlp --further-gateways mlp": "--further-gateways: expected --locate",
    "evaluate mlp --locate --dataset others": "--locate: expected the test part of the run's own split, found others",
    "evaluate mlp --locate --index one.txt": "--locate: expected the test part of the run's own split, found one.txt",
    "crossvalidate mlp --scene closet --field data --engine rays": "--engine: expected none beside --field",
    "compare data -o out --models nearest helmholtz --budget 5": f"--budget: {OF_STEPS} nearest, helmholtz",
    "compare data --models nearest": "-o: expected a folder for the results beside spectra, found none",
    "compare data -o out --models nearest --given 3": "--given: expected a folder of bisplat rooms, found data",
    "compare heard --models mean --test-rooms 1": "--test-rooms: expected a folder of bisplat rooms, found heard",
    "compare places --models mean --split random": "--split: expected a dataset, found rooms, in each of which",
    "compare places --models mean --guard 1": "--guard: expected a dataset, found rooms, in each of which",
    "compare places --models mean --budget 1": "--budget: expected a method that learns in other rooms, found mean",
    "compare places --models mean --force": "--force: expected --output beside it, found none",
    "compare data -o out --models nearest --force": "--force: expected received powers or channels, found spectra",
    "sweep data -o out --sizes 3 --models nearest --force": "--force: expected received powers or channels, found",
    "compare heard --budget 5": f"--budget: {OF_METHODS} none",
    "compare heard --models mean --budget 5": f"--budget: {OF_METHODS} mean",
    "compare heard --test-spectra 3": "--test-spectra: expected spectra, found received powers, all of",
    "compare links --test-spectra 3": "--test-spectra: expected spectra, found channels (CSI), all of",
    "compare links --budget 5": f"--budget: {OF_METHODS} none",
    "sweep heard -o out --sizes 3 3": "--sizes: expected different numbers of training samples, found [3, 3]",
    "sweep heard -o out --sizes 3 --init mlp": "--init: expected spectra, found received powers, of which there are no",
    "sweep links -o out --sizes 3 --test-spectra 3": "--test-spectra: expected spectra, found channels (CSI)",
    "evaluate heard": "heard: expected -o FOLDER for the report of received powers, found none",
    "evaluate heard -o out --dataset data": "--dataset: expected a run, found received powers without one",
    "evaluate links -o out --no-ceiling": "--no-ceiling: expected a run, found channels (CSI) without one",
    "evaluate links -o out --locate": "--locate: expected a run, found channels (CSI) without one",
    "evaluate heard -o out --model bisplat": "--model: expected mean, nearest, inverse-distance",
    "evaluate heard -o out --budget 5": f"--budget: {OF_METHODS} helmholtz",
    "evaluate mlp -o out": "-o: expected received powers or channels (CSI), found mlp",
    "evaluate mlp --model mlp": "--model: expected received powers or channels (CSI), found mlp",
    "compare links --force": "--force: expected --output beside it, found none",
    "compare links --models mlp": "--methods: expected copy, ramp, nearest, delays, helmholtz or module:Class, found",
    "compare heard --force": "--force: expected --output beside it, found none",
    "compare heard --models mean --methods mean": "--models and --methods: expected one of them, found both",
    "compare heard --models bisplat": "--methods: expected mean, nearest, inverse-distance, log-distance, mri, kriging",
    "sweep data -o out --sizes 3 --models kriging --budget 5": f"--budget: {OF_STEPS} kriging",
    "plan mlp -o out.csv --max-depth 2": "--max-depth: expected a scene to trace, found the run mlp",
    "plan closet -o out.csv --target 1.5": "--target: expected a median SSIM from 0 to 1, found 1.5",
    "plan closet -o out.csv --target 0.999": "--target: expected a median SSIM that the curve of measured rooms has,",
    "plan closet -o out.csv --diffuse": "--diffuse: expected an object whose material has a scattering_coefficient",
    "engines data -o out --diffuse": "--diffuse: expected an object whose material has a scattering_coefficient",
    "dataset --frequency 2.4GHz --array 4x4@0.5 -o out": "--files: expected at least one file, found none",
    "dataset recording.npz --frequency 2.4GHz --array 4x4 -o out": "--array: expected the spacing in wavelengths, too",
    "dataset recording.npz --frequency 2.4GHz --array 4x4@0.5 -o out --bandwidth 1MHz --round-trip": (
        "--round-trip: expected no band beside it, found one"
    ),
    "dataset recording.npz --frequency 2.4 --array 4x4@0.5 -o out": "--frequency: expected hertz",
    "engines closet -n 9": "-n: expected a full-wave dataset and -o, found the scene closet alone",
    "engines closet --max-depth 2": "--max-depth: expected a full-wave dataset and -o, found the scene closet alone",
    "engines data": "data: expected -o FOLDER with a dataset, found none",
    "engines data -o out --patches 9": "--patches: expected --diffuse with it",
    "calibrate closet data -o out --seed 1": "--seed: expected --split random or area beside it, found files",
    "calibrate bare/scene.yaml data -o out --objects 0.03": "--objects: expected an object inside the room",
    "calibrate bare/scene.yaml data -o out --materials 0.2": "--materials: expected a material that is no conductor",
    "calibrate rough/scene.yaml data -o out --diffuse": "--diffuse: expected no diffuse reflection",
    "calibrate closet data -o out --patches 9": "--patches: expected --diffuse with it",
    "export data": "expected one of --output, --hdf5, --deepmimo, --csi, found none",
    "export data --hdf5 out.h5 --deepmimo out": "expected one of --output, --hdf5, --deepmimo, --csi, found --hdf5 and",
    "check data --guard 0.5": "--guard: expected --split beside it, found none",
    "check data --seed 1": "--seed: expected --split beside it, found none",
    "check data --json --json": "--json: expected once, with all its values, found 2 times",
}
"""Calls with an option that can do nothing there, and the beginning of what they say."""
