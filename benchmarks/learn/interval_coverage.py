"""How often do the stated 90 % intervals hold, near the known positions and far from them?

python -m benchmarks.learn.interval_coverage data/rfid-s23-160 --json > runs/interval_coverage.json

Each method learns from known spectra in a part of a region, and is tested everywhere: in an L-shaped room with one wing
unknown, and in the lab and the closet with 60 % of their length known, all by rays; and on the measured sample with the
split ``blocked``. A row is a band of the distance from a test position to the nearest known one, in wavelengths: how
many test spectra it has, the share of their values within the stated 90 % interval, and its mean width. Spectra for
which no deviation is stated are left out. The datasets and the runs are kept in a folder for the next call.
"""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro
from jaxtyping import Bool, Float
from tyro.conf import Positional

from benchmarks.ledger.printing import print_figures
from learn.evaluation.prediction_intervals import intervals_by_distance
from learn.training.config import Config
from learn.training.conformal_deviation import nearest_known, pixel_errors
from learn.training.registry import MODELS
from learn.training.run_folder import SpectrumRun, load_spectra
from scenes.places.built_in import closet, lab
from scenes.places.room import build_place, table
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.orientation import facing
from scenes.scene.shapes import box, sheet
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import read_dataset
from simulate.dataset.index_files import write_index
from simulate.engines.rays_engine import Rays
from simulate.generation.generate import generate
from simulate.generation.request import Request
from simulate.rays.core.propagation import Propagation
from simulate.spectra.spectrum import evenly, spectrum_of

CORNERS = ((0.0, 0.0), (5.0, 0.0), (5.0, 2.4), (2.4, 2.4), (2.4, 5.0), (0.0, 5.0))
"""Corners of the L-shaped room, metres."""

HEIGHT, KNOWN, TESTED = 2.6, 200, 300

FEW = 10
"""Bands with fewer test spectra are marked: their shares are uncertain by a tenth and more."""

METHODS: dict[str, dict[str, Any]] = {
    "helmholtz": {"model": "helmholtz"},
    "twin": {"model": "twin"},
    "bisplat-aperture": {"model": "bisplat-aperture", "options": {"primitives": 100}, "steps": 600},
}


def l_shaped_room() -> Scene:
    """An office of 18 m² with a gateway at the end of one wing, desks and a metal cabinet."""
    floor = [((0, 0), (5, 0), (0, 2.4)), ((0, 2.4), (2.4, 0), (0, 2.6))]
    objects = []
    for number, ((x, y), along, across) in enumerate(floor):
        objects.append(SceneObject(f"floor {number}", sheet((x, y, 0), (*along, 0), (*across, 0)), "concrete"))
        objects.append(SceneObject(f"ceiling {number}", sheet((x, y, HEIGHT), (*across, 0), (*along, 0)), "concrete"))
    for number, (a, b) in enumerate(zip(CORNERS, (*CORNERS[1:], CORNERS[0]), strict=True)):
        wall = sheet((*a, 0), (b[0] - a[0], b[1] - a[1], 0), (0, 0, HEIGHT))
        objects.append(SceneObject(f"wall {number}", wall, "brick"))
    objects.append(SceneObject("desk", table(3.2, 0.2, 1.4, 0.7), "wood"))
    objects.append(SceneObject("second desk", table(1.3, 3.8, 0.8, 0.8), "wood"))
    objects.append(SceneObject("cabinet", box((0.05, 3.2, 0.01), (0.5, 4.2, 1.6)), "metal"))
    gateway = Gateway((4.9, 1.2, 1.8), facing((-1, 0, -0.1)), pattern="dipole")
    return build_place("L-shaped office", objects, gateway, Transmitter((0.3, 0.3, 0.8), (4.5, 4.7, 1.6), "dipole"))


def in_l_shape(positions: Float[np.ndarray, "n 3"]) -> Bool[np.ndarray, " n"]:
    """Whether positions are in one of the wings, and not in the cabinet."""
    x, y = positions[:, 0], positions[:, 1]
    return ((y < 2.1) | (x < 2.1)) & ~((x < 0.8) & (y > 3.0) & (y < 4.4))


def dataset_of(scene: Scene, folder: Path, known_count: int, test_count: int, depth: int | None) -> Dataset:
    """Spectra of a scene, whose index files name the known ones (in a part of the region) and the test ones."""
    generator = np.random.default_rng(0)
    low, high = scene.transmitter.region
    positions = generator.uniform(low, high, (20 * (known_count + test_count), 3))
    if scene.name.startswith("L"):
        positions = positions[in_l_shape(positions)]
        part = positions[:, 1] < 2.1
    else:
        part = positions[:, 0] < low[0] + 0.6 * (high[0] - low[0])
    known = np.flatnonzero(part)[:known_count]
    test = np.setdiff1d(np.arange(len(positions)), known)[:test_count]
    chosen = np.sort(np.concatenate([known, test]))
    propagation = Propagation() if depth is None else Propagation(max_depth=depth, diffraction=False, rays=20_000)
    generate(Request(scene, positions[chosen], "uniform", Rays(propagation), 0), folder)
    names = read_dataset(folder).names
    for part_name, members in (("train", known), ("test", test)):
        numbers = np.searchsorted(chosen, members)
        write_index(folder / f"{part_name}_index.txt", [names[number] for number in numbers])
    return read_dataset(folder)


def rows(name: str, method: str, run: SpectrumRun) -> dict[str, Any]:
    """Coverage of a run's intervals for each band."""
    data = run.dataset()
    parts = run.split(data)
    test = evenly(parts.test, TESTED)
    positions, truth = data.positions[test], spectrum_of(data.pictures[test])
    deviation, prediction = run.deviation(positions), run.predict(positions).spectra
    if deviation is None:
        return {f"{name}, {method}": {"spectra": len(test), "share": None, "width": None}}
    errors = np.abs(pixel_errors(prediction, truth)) / deviation[:, None]
    wavelengths = nearest_known(data.positions[parts.known], positions, data.wavelength)
    found = {}
    for band, each in intervals_by_distance(errors, deviation, wavelengths):
        mark = " (few)" if each.spectra < FEW else ""
        figures = {"spectra": each.spectra, "share": round(each.share, 3), "width": round(each.width, 3)}
        found[f"{name}, {method}, {band}{mark}"] = figures
    return found


def main(
    measured: Positional[Path],
    folder: Path = Path("runs/interval_coverage"),
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Measure how often the stated intervals hold."""
    figures: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) if smallest else folder
        scenes = {"L-shaped": l_shaped_room(), "lab": lab(), "closet": closet()}
        places: list[tuple[str, Dataset, str]] = []
        for name, scene in scenes.items():
            if smallest and name != "closet":
                continue
            counts = (14, 4, 0) if smallest else (KNOWN if name != "closet" else KNOWN // 2, 2 * TESTED, None)
            places.append((name, dataset_of(scene, folder / name, *counts), "files"))
        places.append(("measured", read_dataset(measured), "blocked"))
        for name, data, split in places:
            for method, settings in METHODS.items():
                if smallest and method != "helmholtz":
                    continue
                given: Any = {"split": split, **settings, **({"steps": 1} if smallest else {})}
                if method == "twin":
                    if name == "measured":
                        continue
                    given["options"] = {"scene": str(data.folder / data.metadata["scene_file"])}
                place = folder / "runs" / f"{name}-{method.replace(' ', '-')}"
                figures |= rows(name, method, trained(data, place, given))
    print_figures(figures, json_output, smallest)


def trained(data: Dataset, folder: Path, given: dict[str, Any]) -> SpectrumRun:
    """A run with these settings."""
    from learn.training.train import train_run

    by_steps = MODELS[given["model"]].by_steps
    config = Config(
        dataset=str(data.folder.resolve()),
        model=given["model"],
        split=given["split"],
        options=given.get("options", {}),
        by_steps=by_steps and replace(by_steps, steps=given["steps"]),
    )
    train_run(config, folder, dataset=data)
    return load_spectra(folder)


if __name__ == "__main__":
    tyro.cli(main)
