"""How far are the test positions from the known ones in the splits of the tables on simulated data?

python -m benchmarks.data.split_distances data/rfid-s23-160 --json > runs/split-distances.json

The positions are those that ``bisplat simulate`` draws for these tables; distances need no spectra. A row is a dataset,
its split, and the number of training spectra where a table states it. The measured sample is beside them.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro
from tyro.conf import Positional

from benchmarks.ledger.printing import print_figures
from learn.data.split_distances import SplitDistances
from learn.data.splits import SplitKind, split
from scenes.storage.scene_yaml import load_scene
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import read_dataset
from simulate.dataset.dataset_frequency import Frequency
from simulate.dataset.receivers import ArrayReceiver
from simulate.positions.placement import place
from simulate.spectra.spectrum import evenly

COUNT = 6000
SIZES = (25, 50, 100, 200, 400, 1000, 4000)
GUARD = 0.5
KINDS: tuple[SplitKind, ...] = ("random", "blocked", "area")


def of_positions(name: str, placement: str, count: int) -> Dataset:
    """The dataset that ``bisplat simulate NAME`` makes, with black pictures."""
    scene = load_scene(name)
    positions = place(scene, placement, count, seed=0)
    return Dataset(
        folder=Path(name),
        names=[f"{number:05d}" for number in range(1, len(positions) + 1)],
        values={"spectrum": np.broadcast_to(np.uint8(0), (len(positions), 90, 360))},
        receiver=ArrayReceiver(np.asarray(scene.gateway.position), np.asarray(scene.gateway.orientation)),
        places=positions,
        train=np.arange(0),
        test=np.arange(0),
        frequency=Frequency(scene.frequency, "metadata"),
    )


def row(
    dataset: Dataset, kind: SplitKind, tested: int | None = None, size: int | None = None, guard: float = 0.0
) -> dict[str, Any]:
    """Sizes and distances of a split, with at most ``tested`` test positions, as ``bisplat compare`` has them."""
    parts = split(dataset, kind, 0, size, guard)
    test = parts.test if tested is None else evenly(parts.test, tested)
    positions = dataset.positions
    found = SplitDistances.between(positions[parts.known], positions[test], dataset.wavelength)
    facts = found.facts()
    return {
        "known": found.known,
        "test": len(test),
        "least, λ": facts["test_to_known_least_wavelengths"],
        "median, λ": facts["test_to_known_median_wavelengths"],
        "nearer than λ/2": f"{found.near / len(test):.0%}",
    }


def main(
    measured: Positional[Path],
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Measure the distances of the splits."""
    count, sizes = (200, SIZES[:2]) if smallest else (COUNT, SIZES)
    result: dict[str, Any] = {}
    for name in ("closet", "lab"):
        uniform = of_positions(name, "uniform", count)
        for size in sizes:
            result[f"{name}, random, {size}"] = row(uniform, "random", 300, size)
    result["lab, blocked"] = row(uniform, "blocked", 500)
    path = of_positions("lab", "path", count)
    for kind in KINDS:
        result[f"path through the lab, {kind}"] = row(path, kind)
    result[f"path through the lab, area, guard {GUARD:g}"] = row(path, "area", guard=GUARD)
    sample = read_dataset(measured)
    for kind in ("files", "blocked", "area"):
        result[f"measured, {kind}"] = row(sample, kind)
    print_figures(result, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
