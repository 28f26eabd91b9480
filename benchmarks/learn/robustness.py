"""Is the default model ever worse than the best baseline?

python -m benchmarks.learn.robustness data/rfid-s23-160 runs/lab-6000 --json

The figures are median SSIMs of at most 100 test spectra, for several datasets and numbers of training spectra. The
measured folder is split by ``blocked`` and by its own files. The lab and other places are split by ``random``. This
program simulates the other places and keeps them in --output. ``behind`` is how far helmholtz is behind the best
baseline (0 if it is ahead). ``interpolates by`` is what helmholtz chose.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro
from rich.progress import track

from benchmarks.ledger.printing import print_figures
from learn.data.metrics import ssim
from learn.data.splits import SplitKind, split
from learn.methods.method_table import methods_of, named_for
from learn.models.kriging.helmholtz import HelmholtzField
from learn.quantities.known import Known
from learn.quantities.spectra import Spectra
from learn.training.prediction import predict
from scenes.importing.mesh_import import import_scene
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene
from scenes.scene.materials import p2040_materials
from scenes.scene.orientation import facing
from scenes.storage.scene_yaml import load_scene
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import read_dataset
from simulate.generation.simulation import simulate
from simulate.rays.core.propagation import Propagation
from simulate.spectra.spectrum import evenly, spectrum_of

MOST_TESTED = 100
SIZES = {"measured": (20, 40, None), "lab": (20, 50, 200, 1000, 4000), "place": (48, 100, 200)}
"""Numbers of training spectra; None: all."""

SIMULATED = 320
"""Number of spectra of a further place."""


def built_in_at(name: str, frequency: float) -> Scene:
    """A built-in place at another frequency, with the materials' values there."""
    scene = load_scene(name)
    return replace(scene, frequency=frequency, materials=p2040_materials(scene.materials, frequency))


def sionna_box(frequency: float) -> Scene:
    """Sionna RT's own scene box, a closed room, with a gateway at a wall."""
    gateway = Gateway((-4.5, 0.0, 3.0), facing((1, 0, 0)))
    return import_scene(
        "sionna:box", frequency=frequency, gateway=gateway, transmitter=Transmitter((-2, -3, 1), (3, 3, 4))
    )[0]


PLACES = {
    "conference at 2.4 GHz": lambda: built_in_at("conference", 2.4e9),
    "bedroom at 2.4 GHz": lambda: built_in_at("bedroom", 2.4e9),
    "office at 2.4 GHz": lambda: built_in_at("office", 2.4e9),
    "sionna:box at 2.4 GHz": lambda: sionna_box(2.4e9),
}


def scores(dataset: Dataset, kind: SplitKind, size: int | None) -> dict[str, float | str]:
    """Median SSIM by method."""
    task = Known(dataset, Spectra(), split(dataset, kind, 0, size))
    known, test = task.parts.known, evenly(task.parts.test, MOST_TESTED)
    positions, truth = dataset.positions[test], spectrum_of(dataset.pictures[test])

    def median(prediction: np.ndarray) -> float:
        return round(float(np.median(ssim(np.clip(prediction, 0, 1).astype(np.float32), truth))), 3)

    found: dict[str, float | str] = {}
    makes = methods_of("spectrum")
    for name in named_for("spectrum"):
        if name == "kriging-responses" and "response" not in dataset.values:
            continue  # which needs recorded responses
        method = makes[name]()
        method.fit(task)
        found[name] = median(method.predict(positions).value)
    best = max(float(value) for value in found.values())
    field = HelmholtzField(np.zeros((2, 3)), dataset.beamformer, dataset.wavelength)
    sentence = field.fit(dataset, known)
    found["helmholtz"] = median(predict(field, positions).spectra)
    found["behind"] = round(max(best - float(found["helmholtz"]), 0), 3)
    found["interpolates by"] = sentence.removeprefix("interpolates by ").split(" (")[0]
    return found


def main(
    measured: tyro.conf.Positional[Path],
    lab: tyro.conf.Positional[Path],
    output: Path = Path("runs/robustness"),
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Score every method on every dataset and size."""
    recorded, traced = read_dataset(measured), read_dataset(lab)
    tables: dict[str, tuple[Dataset, SplitKind, int | None]] = {}
    kinds: tuple[SplitKind, ...] = ("blocked", "files")
    for kind in kinds:
        for size in SIZES["measured"]:
            tables[f"measured, {kind}, {size or 'all'}"] = (recorded, kind, size)
    tables |= {f"lab, {size}": (traced, "random", size) for size in SIZES["lab"]}
    if smallest:
        tables = {name: (dataset, kind, 6) for name, (dataset, kind, _) in list(tables.items())[:1]}
    else:
        for name, make in PLACES.items():
            folder = output / name.replace(" ", "-").replace(":", "-")
            dataset = simulate(make(), folder, n=SIMULATED, propagation=Propagation())
            tables |= {f"{name}, {size}": (dataset, "random", size) for size in SIZES["place"]}
    figures = {
        name: scores(*table)
        for name, table in track(tables.items(), disable=not sys.stderr.isatty(), description="datasets")
    }
    print_figures(figures, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
