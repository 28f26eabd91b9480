"""For every option of every command: a call without it, the option with a value, and where the difference shows."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

FIELD = Path(__file__).parents[1] / "data" / "closet"
"""A stored field, from which a dataset in full wave is made at once."""


class Trial(NamedTuple):
    """Two calls of a command that differ in one option."""

    call: str  # arguments of ``bisplat`` without the option, or with another value of it
    words: str  # the option with its value
    instead_of: str = ""  # the words of the call that ``words`` replace; empty: they are added
    # function, as "module:name", that does the work of the command, which tests of its own cover. The calls stop
    # there, and its arguments are compared. Empty: what the command writes and prints is compared.
    stops_at: str = ""
    there: str = ""  # name of a file that exists before both calls

    @property
    def calls(self) -> tuple[list[str], list[str]]:
        """The arguments of both calls."""
        replaced = self.call.replace(self.instead_of, self.words) if self.instead_of else f"{self.call} {self.words}"
        return self.call.split(), replaced.split()

    @property
    def option(self) -> str:
        """The first of ``words``."""
        return self.words.split()[0]


def _trials(call: str, options: Iterable[str | tuple[str, str]], stops_at: str = "", there: str = "") -> list[Trial]:
    """Trials of one call: of options that are added, and of pairs of words and those that they replace."""
    pairs = ((each, "") if isinstance(each, str) else each for each in options)
    return [Trial(call, words, instead_of, stops_at, there) for words, instead_of in pairs]


MECHANISMS = (
    *("--max-depth 2", "--no-los", "--no-specular", "--no-refraction", "--no-diffraction"),
    *("--no-slab-phase", "--sionna", "--rays 50"),
)
"""Options of the ray tracer, for commands that hand them on."""

IMPORT = (
    "scene wall.obj -o out --gateway 0.5 0.5 1 --boresight 1 0 0 --region-min 1 0.2 0.5 --region-max 2 0.8 0.9 "
    "--default-material wood"
)
RAYS = "simulate rough/scene.yaml -n 3 -o out --max-depth 1 --no-diffraction --rays 500"
IN_A_ROOM = "simulate closet -n 3 -o out --max-depth 1 --no-diffraction --rays 500"
POWERS = "rssi rough/scene.yaml -n 3 -o out --gateways gateways.yml --max-depth 1 --no-diffraction --rays 500"
MADE_POWERS = "simulate.rssi.rssi_simulation:make_rssi"
TRACED = ("--no-refraction", "--no-diffraction", "--no-slab-phase", "--rays 50")
REQUEST = "simulate.generation.generate:generate"
MLP = "train data -o out --model mlp-responses --steps 2 --batch-size 2"
TRAIN = "learn.training.train:train_run"
LOCATED_POWERS = "learn.localisation.locate_powers:locate_powers"
LOCATED = "learn.evaluation.locations:heard_by"
CROSSVALIDATED = "learn.evaluation.crossvalidate:crossvalidate"
COMPARED_POWERS = "learn.powers.compare_powers:compare_powers"
COMPARED_SPECTRA = "learn.comparison.compare:compare"
COMPARED_ROOMS = "learn.rooms.compare_rooms:compare_rooms"
SIMULATED_ROOMS = "simulate.generation.simulated_rooms:simulate_rooms"
COMPARED_CHANNELS = "learn.channels.compare_channels:compare_channels"
NEAREST = "compare others -o out --models nearest"
ABLATE = "ablate data -o out --models bisplat-aperture --steps 1 --seeds 1"
RECORDED = "dataset recording.npz --frequency 2.4GHz --array 4x4@0.5 -o out"
CONVERTED = "simulate.exchange.convert:convert"
ABLATED = "learn.comparison.ablate:ablate"
SWEEP = "sweep others -o out --models nearest --sizes 3"
SWEEP_POWERS = "sweep heard -o out --models mean --sizes 3"
EVALUATE = "evaluate heard -o out --model mri"
SWEPT = "learn.comparison.compare:sweep"
CALIBRATED = "learn.twin.calibrate:calibrate"
CALIBRATED_BY_POWERS = "learn.twin.calibrate_powers:calibrate_powers"
PLANNED = "learn.planning.next_positions:plan"
NEW_FOLDER = "bisplat.commands.uses_commands:new_folder"
NEW_IN_USES = "bisplat.commands.uses_commands:require_new"
SERVED = "scenes.browser.served_page:serve"

TRIALS: dict[str, list[Trial]] = {
    "scene": [
        *_trials("scene closet", ["-o out.png", "--json"]),
        *_trials("scene closet -o out.png", ["--force"], there="out.png"),
        *_trials(
            IMPORT,
            [
                *("--material wall=concrete", "--unit ft", "--up y", "--frequency 2.4e9", "--array 2x2"),
                "--pattern dipole",
                ("--default-material brick", "--default-material wood"),
                ("--gateway 0.6 0.5 1", "--gateway 0.5 0.5 1"),
                ("--boresight 1 1 0", "--boresight 1 0 0"),
                ("--region-min 1 0.3 0.5", "--region-min 1 0.2 0.5"),
                ("--region-max 2 0.7 0.9", "--region-max 2 0.8 0.9"),
            ],
        ),
        *_trials(IMPORT, ["--shift 1 2 3", "--walls as-drawn"]),
        *_trials(f"{IMPORT} --material wall=wet", ["--own-material wet=15,2,0.1"]),
        *_trials("scene wall.obj", ["--list"]),
        *_trials("scene closet --view", ["--port 8081"], SERVED),
        *_trials("scene closet", ["--view"], SERVED),
        *_trials("scene closet", ["--accuracy"], "simulate.rays.expected_correlation:expectation"),
        *_trials("scene closet --json", ["--frequency 2.4GHz", "--array 8x8", "--array elements.csv"]),
    ],
    "simulate": [
        *_trials(RAYS, ["--frequency 2.4GHz", "--array 2x3@0.4", "--array elements.csv"]),
        *_trials(RAYS, ["--placement path", "--seed 1", "--power-db", "--snr-db 10", "--gain-error-db 1"]),
        *_trials(RAYS, ["--phase-error-deg 5", "--phase-noise-deg 5", "--no-los", "--no-specular", "--no-refraction"]),
        *_trials(RAYS, ["--no-slab-phase", "--sionna", "--diffuse"]),
        *_trials(RAYS, [("-o out2", "-o out"), ("-n 4", "-n 3"), ("--positions places.csv", "-n 3")]),
        *_trials(IN_A_ROOM, [("--max-depth 2", "--max-depth 1"), ("--rays 1", "--rays 500")]),
        *_trials(IN_A_ROOM, ["--frequencies 915MHz 2.4GHz", "--moving receiver"]),
        Trial(f"{IN_A_ROOM} --moving both --transmitters 2", "--transmitters 3", "--transmitters 2"),
        Trial(
            "simulate rough/scene.yaml -o out --max-depth 0 --moving both --positions places.csv --receivers near.csv",
            "--receivers far.csv",
            "--receivers near.csv",
        ),
        Trial(f"{IN_A_ROOM} --bandwidth 10MHz --subcarriers 4", "--bandwidth 20MHz", "--bandwidth 10MHz"),
        Trial(f"{IN_A_ROOM} --bandwidth 10MHz --subcarriers 4", "--subcarriers 5", "--subcarriers 4"),
        Trial(f"{RAYS} --diffuse --patches 20", "--patches 50", "--patches 20"),
        *_trials(
            "simulate rough/scene.yaml -o out", ["--no-diffraction", "--workers 2", "--ray localhost:6379"], REQUEST
        ),
        *_trials("simulate closet -o out", ["--engine fullwave"], REQUEST),
        *_trials("simulate closet -o out --engine fullwave", ["--frequencies 915MHz 925MHz"], REQUEST),
        *_trials("simulate closet -o out --engine fullwave", [f"--field {FIELD}", "--cell 0.05", "--gpu"], REQUEST),
    ],
    "train": [
        *_trials(MLP, ["--seed 1", "--encoding octaves", "--learning-rate 0.1", "--weight-decay 0.5"]),
        *_trials(f"{MLP} --seed 1", ["--split random"]),
        *_trials(MLP, ["--init mlp", ("-o out2", "-o out"), ("--model mlp", "--model mlp-responses")]),
        *_trials(MLP, [("--steps 3", "--steps 2"), ("--batch-size 3", "--batch-size 2")]),
        Trial("train data -o out --model mlp --steps 1", "--full-resolution 1"),
        *_trials("train data -o out --model bisplat", ["--bypass bst", "--option primitives=9"], TRAIN),
        *_trials("train data -o out", ["--preset paper"], TRAIN),
        *_trials("train data -o out --model mlp", ["--budget 0.01", "--matmul-precision medium"], TRAIN),
        *_trials("train data -o out --model twin --scene closet", [("--scene lab", "--scene closet")], TRAIN),
        *_trials("train measured -o out --model mlp-responses", ["--no-find-phases"], TRAIN),
        *_trials(f"{MLP}", ["--trainer devices=2", "--guard 0.1"], TRAIN),
    ],
    "evaluate": [
        *_trials("evaluate mlp", ["--dataset others", "--index one.txt", "--no-ceiling", "--json"]),
        *_trials("evaluate mlp", ["--locate"], LOCATED),
        *_trials("evaluate mlp --locate", ["--further-gateways mlp"], LOCATED),
        *_trials(EVALUATE, [("--model nearest", "--model mri"), "--split random", "--guard 0.1"], COMPARED_POWERS),
        *_trials(EVALUATE, [("-o out2", "-o out"), "--force"], "bisplat.commands.compared_quantities:new_folder"),
        *_trials("evaluate heard -o out --model log:Own", ["--budget 1"], COMPARED_POWERS),
        *_trials("evaluate heard -o out --model twin", ["--scene closet"], COMPARED_POWERS),
        *_trials("evaluate links -o out --model delays", [("--model helmholtz", "--model delays")], COMPARED_CHANNELS),
        *_trials("evaluate links -o out --model ramp", ["--json"]),
    ],
    "view": [
        *_trials("view closet", ["--port 8081"], SERVED),
        *_trials("view closet", ["--positions places.csv"], "learn.view.session:Session"),
    ],
    "demo": _trials("demo", ["-o out", "-n 20", "--steps 2"], "bisplat.commands.demo_run:demo"),
    "check": [
        *_trials("check data", ["--json", "--split random"]),
        *_trials("check powers", ["--json"]),
        *_trials("check data --split random", ["--guard 1", "--seed 1"]),
    ],
    "dataset": [
        *_trials(
            RECORDED, [("--frequency 915e6", "--frequency 2.4GHz")], "simulate.exchange.recorded_responses:record"
        ),
        *_trials(
            RECORDED,
            [
                ("--array 4x4@0.4", "--array 4x4@0.5"),
                ("--array elements.csv", "--array 4x4@0.5"),
                ("-o out2", "-o out"),
                *("--gateway 1 0 1", "--boresight 0 1 0", "--positions elsewhere", "--responses other", "--unit ft"),
                *("--columns-first True", "--conjugate True", "--phases per-position"),
                "--round-trip",
                "--moving receiver",
            ],
        ),
        Trial(f"{RECORDED} --moving both --receivers elsewhere", "--receivers moved", "--receivers elsewhere"),
        Trial(f"{RECORDED} --responses wide --bandwidth 10MHz", "--bandwidth 20MHz", "--bandwidth 10MHz"),
    ],
    "convert": [
        *_trials("convert measured -o out", [("-o out2", "-o out")]),
        Trial("convert turned -o out --flip-elevation False", "--flip-elevation True", "--flip-elevation False"),
        *_trials("convert twice -o out", ["--one-per-position 1"]),
        *_trials(
            "convert measured -o out", ["--frequency 2.4e9", "--quantity power", "--quantity decibels"], CONVERTED
        ),
        *_trials("convert measured -o out", ["--moving receiver"]),
        *_trials("convert measured -o out --quantity decibels", ["--decibels 30"], CONVERTED),
        *_trials("convert small -o out --azimuths 0 358", ["--elevations 0 88"], CONVERTED),
        *_trials("convert small -o out --elevations 0 88", ["--azimuths 0 358"], CONVERTED),
    ],
    "responses": [
        *_trials("responses measured", ["--json"]),
        *_trials("responses measured", ["--force"], "bisplat.commands.dataset_commands:require_new"),
    ],
    "rssi": [
        *_trials(
            POWERS, ["--frequency 2.4GHz", "--placement path", "--seed 1", "--tx-power-dbm 10", "--floor-dbm -40"]
        ),
        *_trials(POWERS, ["--shadowing-db 3", "--quantisation-db 0", "--no-los", "--no-specular"]),
        *_trials(POWERS, [("-o out2", "-o out"), ("-n 4", "-n 3"), ("--positions places.csv", "-n 3")]),
        Trial(POWERS, "--gateways far.yml", "--gateways gateways.yml"),
        *_trials(f"{POWERS} --quantisation-db 0", ["--diffuse", "--sionna"]),
        Trial(f"{POWERS} --quantisation-db 0 --diffuse --patches 20", "--patches 50", "--patches 20"),
        *_trials(POWERS, [("--max-depth 0", "--max-depth 1 --no-diffraction --rays 500")]),
        *_trials("rssi rough/scene.yaml -o out --gateways gateways.yml", TRACED, MADE_POWERS),
    ],
    "rooms": [
        *_trials("rooms -o out", [("-o out2", "-o out"), "-n 3", "--setting same", "--seed 1"], SIMULATED_ROOMS),
        *_trials("rooms -o out -n 2", ["--spectra 3", "--pieces 1 3", "--shape l", "--large"], SIMULATED_ROOMS),
    ],
    "predict": [
        *_trials(
            "predict mlp --positions places.csv -o out.npz", [("--positions others.csv", "--positions places.csv")]
        ),
        *_trials("predict mlp --positions places.csv -o out.npz", [("-o out2.npz", "-o out.npz")]),
        *_trials("predict mlp --positions places.csv -o out.npz", ["--dtype uint8"]),
        *_trials("predict mlp --positions places.csv -o out.npz", ["--force"], there="out.npz"),
    ],
    "locate": [
        *_trials(
            "locate mlp --pictures data -o out.csv",
            [("--pictures others", "--pictures data")],
            "learn.localisation.locate:locate",
        ),
        *_trials(
            "locate data -o out.csv",
            ["--region 0 0 0 1 1 1", "--boresight 1 0 0"],
            "learn.localisation.locate_tags:locate_tags",
        ),
        *_trials(
            "locate mlp --pictures data -o out.csv",
            [("-o out2.csv", "-o out.csv"), "--force"],
            NEW_IN_USES,
        ),
        *_trials("locate heard -o out.csv", ["--heard two.csv"], LOCATED_POWERS),
        *_trials("locate heard -o out.csv", ["--split random"], "learn.data.splits:split"),
        *_trials("locate heard --heard two.csv -o out.csv", ["--level 3"], LOCATED_POWERS),
    ],
    "plan": [
        *_trials("plan rough/scene.yaml -o out.csv", ["-n 3", "--tour", "--seed 1", *MECHANISMS, "--diffuse"], PLANNED),
        *_trials("plan rough/scene.yaml -o out.csv --diffuse", ["--patches 50"], PLANNED),
        *_trials("plan closet -o out.csv", ["--target 0.85"], PLANNED),
        *_trials("plan closet -o out.csv", [("-o out2.csv", "-o out.csv"), "--force"], NEW_IN_USES),
    ],
    "coverage": [
        *_trials("coverage heard -o out --method mean --step 1", ["--height 0.5", "--region 0 0 2 2"]),
        *_trials(
            "coverage heard -o out --method mean --step 1",
            [("-o out2", "-o out"), ("--method nearest", "--method mean"), ("--step 0.5", "--step 1")],
        ),
        *_trials(
            "coverage heard -o out --method mean --step 1",
            ["--scene closet"],
            "learn.reports.coverage_report:write_coverage_files",
        ),
        *_trials("coverage heard -o out --method mean --step 1", ["--force"], there="out/coverage.npz"),
    ],
    "export": [
        *_trials("export mlp", ["-o out.pt2"]),
        *_trials("export data", ["--hdf5 out.h5"]),
        *_trials("export data", ["--deepmimo out"], "simulate.exchange.deepmimo_export:export_deepmimo"),
        *_trials("export powers", ["--hdf5 out.h5"]),
        *_trials("export data", ["--csi out"], "simulate.exchange.csi_export:export_csi"),
        *_trials("export data --hdf5 out.h5", ["--force"], there="out.h5"),
    ],
    "crossvalidate": [
        *_trials("crossvalidate mlp --scene closet -n 3 --field data", [("-n 4", "-n 3"), "--seed 2", "--json"]),
        *_trials("crossvalidate mlp --scene closet", [("--scene lab", "--scene closet")], CROSSVALIDATED),
        *_trials("crossvalidate mlp --scene closet", ["--engine rays", "--field data"], CROSSVALIDATED),
    ],
    "compare": [
        *_trials(NEAREST, [("--models mean-picture", "--models nearest"), "--split random", "--seeds 2", "--json"]),
        *_trials(NEAREST, ["--test-spectra 1", ("-o out2", "-o out")]),
        *_trials("compare data -o out --models mlp", ["--budget 1", "--steps 2", "--guard 0.1"], COMPARED_SPECTRA),
        *_trials("compare heard", ["--models mean", "--split random", "--guard 0.1", "--seeds 2"], COMPARED_POWERS),
        *_trials("compare heard --models log:Own", ["--budget 1"], COMPARED_POWERS),
        *_trials("compare heard --models twin", ["--scene closet"], COMPARED_POWERS),
        *_trials("compare heard --models mean", ["--json", "-o out"]),
        *_trials("compare places", ["--given 3", "--test-rooms 1", "--models mean", "--seeds 2"], COMPARED_ROOMS),
        *_trials("compare places", ["--test-spectra 1", "--budget 1"], COMPARED_ROOMS),
        *_trials("compare places --models mean --given 3", ["--json", "-o out"]),
        *_trials("compare links", ["--models copy", "--split random", "--seeds 2"], COMPARED_CHANNELS),
        *_trials("compare links --models copy", ["--json", "-o out"]),
        *_trials("compare banded -o out --models nearest", ["--over-band"]),
    ],
    "ablate": [
        Trial(ABLATE, "--json", stops_at="bisplat.commands.comparison_commands:print_averages"),
        *_trials(ABLATE, ["--split random", "--guard 0.1", "--test-spectra 1", "--primitives 9"], ABLATED),
        *_trials(ABLATE, [("--steps 2", "--steps 1"), ("--seeds 2", "--seeds 1"), ("-o out2", "-o out")], ABLATED),
        *_trials(ABLATE, [("--models bisplat", "--models bisplat-aperture")], ABLATED),
    ],
    "sweep": [
        *_trials(SWEEP, [("--models mean-picture", "--models nearest"), ("--sizes 4", "--sizes 3")]),
        *_trials(SWEEP, ["--split random", "--seeds 2", "--test-spectra 1", "--json", ("-o out2", "-o out")]),
        *_trials(SWEEP, ["--init mlp", "--guard 0.1"], SWEPT),
        *_trials("sweep data -o out --models mlp --sizes 3", ["--budget 1", "--steps 2"], SWEPT),
        *_trials(SWEEP_POWERS, ["--split random", "--guard 0.1", "--seeds 2"], COMPARED_POWERS),
        *_trials(SWEEP_POWERS, [("--sizes 4", "--sizes 3"), ("--models mri", "--models mean")], COMPARED_POWERS),
        *_trials("sweep heard -o out --models twin --sizes 3", ["--scene closet"], COMPARED_POWERS),
        *_trials("sweep links -o out --models copy --sizes 3", ["--split random", "--json"]),
    ],
    "calibrate": [
        *_trials("calibrate closet data -o out", ["-n 5", "--split random", *MECHANISMS], CALIBRATED),
        *_trials("calibrate closet data -o out --split random", ["--seed 1"], CALIBRATED),
        *_trials("calibrate closet data -o out", ["--position 0.1", "--rotation 1", "--objects 0.1"], CALIBRATED),
        *_trials(
            "calibrate closet data -o out",
            ["--materials 0.1", "--carrier 0.1", "--frequency 920MHz", "--array 2x2"],
            CALIBRATED,
        ),
        *_trials("calibrate closet data -o out", [("-o out2", "-o out"), "--force"], NEW_FOLDER),
        *_trials("calibrate closet heard -o out", ["-n 5", "--position 0.1", "--split random"], CALIBRATED_BY_POWERS),
    ],
}
"""Of each command, trials of its options."""

NEVER = {("calibrate", "--diffuse"), ("calibrate", "--patches")}
"""Options that a command refuses for every input: the ray tracer's options come together."""
