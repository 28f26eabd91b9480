"""``bisplat simulate``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import OmitArgPrefixes, Positional, arg

from scenes.files.errors import printable
from scenes.files.plain_text import say
from simulate.positions.placement_kind import Placement
from simulate.rays.core.propagation import Propagation
from simulate.spectra.measurement import Measurement

if TYPE_CHECKING:  # its import takes long, and the help does not need it
    from scenes.scene.description import Scene

Output = Annotated[Path, arg(aliases=["-o"])]


# The two classes have no docstring, so that the help shows that of their parents. They check nothing, since tyro would
# turn an error at this point into a message without its sentence; the command makes the checked parents of them.


@dataclass(frozen=True)
class PropagationOptions(Propagation):
    def __post_init__(self) -> None:
        pass


@dataclass(frozen=True)
class MeasurementOptions(Measurement):
    snr_db: Annotated[float | None, arg(aliases=["--snr"])] = None
    gain_error_db: Annotated[float, arg(aliases=["--gain-error"])] = 0.0
    phase_error_deg: Annotated[float, arg(aliases=["--phase-error"])] = 0.0
    phase_noise_deg: Annotated[float, arg(aliases=["--phase-noise"])] = 0.0

    def __post_init__(self) -> None:
        pass


def simulate(
    scene: Positional[str],
    output: Output,
    spectra: Annotated[int, arg(aliases=["-n"])] = 6000,
    placement: Placement = "uniform",
    positions: Path | None = None,
    seed: int = 0,
    propagation: OmitArgPrefixes[PropagationOptions] = PropagationOptions(),
    measurement: OmitArgPrefixes[MeasurementOptions] = MeasurementOptions(),
    power_db: bool = False,
    engine: Literal["rays", "fullwave"] = "rays",
    cell: float | None = None,
    field: Path | None = None,
    workers: int | None = None,
    ray: str | None = None,
    gpu: bool = False,
) -> None:
    """Simulate a scene into a NeRF² dataset folder. The same command again finishes an interrupted one.

    Args:
        scene: built-in name (lab, conference, bedroom, office, closet, workshop), scene YAML, or a simulated dataset
            folder, which is then made once more, by its own settings and not by those given here.
        output: the dataset folder; for a scene of several gateways a folder of one dataset each.
        spectra: transmitter positions to draw.
        placement: how they are drawn in the scene's region; path walks a smooth curve, as measurements do.
        positions: CSV of positions (header x,y,z; metres) to use instead.
        seed: of positions, train/test split, rays and the receiver's errors.
        propagation: mechanisms that the ray tracer follows.
        measurement: errors that the receiver adds.
        power_db: also write each spectrum's absolute power in dB, as power_db/NNNNN.tif.
        engine: rays traces rays, in milliseconds a spectrum; fullwave solves Maxwell's equations by finite differences,
            in minutes to hours a place, whatever the number of spectra.
        cell: side of the cells in full wave, metres; by default a seventh of the shortest wavelength in a material.
        field: folder of a full-wave dataset of the same scene; its stored field is used instead of a new run.
        workers: trace with so many Ray workers at a time (needs bisplat-wrf[ray]); in full wave, the number of the
            solver's runs at a time, by default one per core.
        ray: address of a running Ray cluster to trace on, or in full wave to run the solver on.
        gpu: in full wave, run gprMax on an NVIDIA GPU (needs bisplat-wrf[fullwave] and pycuda).
    """
    import numpy as np

    from scenes.scene.shapes import bounding_box
    from scenes.storage.scene_yaml import load_scene
    from simulate.generation.generate import generate
    from simulate.generation.simulation import check_numbers, request_for, with_engine
    from simulate.positions.reach import reach_warning

    check_numbers(spectra, seed, cell, workers)
    followed, errors = Propagation(**vars(propagation)), Measurement(**vars(measurement))
    if Path(scene).is_dir():
        folders: dict[Path, str | Scene] = {output: scene}
    else:
        place = load_scene(scene)
        folders = {output / name: seen for name, seen in place.by_gateway().items()}
        if not place.further_gateways:
            folders = {output: place}
    for number, (folder, seen) in enumerate(folders.items()):
        # Each array has errors of its own.
        request = request_for(seen, spectra, placement, positions, seed, followed, errors, seed + number, power_db)
        request = with_engine(request, engine, cell, field, gpu)
        if positions is not None and number == 0:
            box = bounding_box(np.vstack([request.scene.bounds, request.scene.transmitter.region]))
            warning = reach_warning(request.positions, box, "the scene", "are they in metres, in the scene's frame?")
            if warning is not None:
                say(f"warning: {positions}: {warning}")
        generate(request, folder, workers, ray, gpu)
        print(printable(f"{len(request.positions)} spectra: {folder}"))
