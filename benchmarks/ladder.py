"""What each idea of Helmholtz kriging is worth, from copying the nearest spectrum upwards; median SSIM.

python benchmarks/ladder.py MEASURED SIMULATED --json

Nothing is drawn at random and nothing is chosen by looking at the test part: the parameters of a law are the likeliest
ones given the known part. Of pictures the first three laws are taken as they are, the others squared, as of a power.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
from rich.progress import track

from learn.baselines.neighbours import inverse_distance, nearest
from learn.metrics import ssim
from learn.models.helmholtz import HelmholtzField
from learn.splits import BLOCK, EVERY, evenly, split
from learn.training.run_folder import predict
from simulate.dataset import Dataset, read_dataset

MOST_TESTED = 300
"""Test spectra of a simulated dataset that are looked at, evenly spread."""

FEWER = 1000, 200, 50
"""Known spectra of the simulated dataset in further tables."""


class SquaredExponential(HelmholtzField):
    """The covariance everyone begins with; the base of laws that know only the distance."""

    def _covariance(self, a, b, faded, shares, length):
        distance = torch.linalg.vector_norm(a[..., :, None, :] - b[..., None, :, :], dim=-1)
        law = self._law(distance, faded, length)
        if not self.has_responses:
            return law
        zero = torch.zeros_like(law)
        return torch.cat([torch.cat([law, zero], dim=-1), torch.cat([zero, law], dim=-1)], dim=-2)

    def _law(self, distance, faded, length):
        return torch.exp(-((distance / length) ** 2) / 2)


class Exponential(SquaredExponential):
    """Edges alone: no wave."""

    def _law(self, distance, faded, length):
        return torch.exp(-distance / length)


class Waves(SquaredExponential):
    """Waves alone, of a learned bandwidth: no edges."""

    def _law(self, distance, faded, length):
        return torch.sinc(2 * distance / length)


class WavesAndEdges(SquaredExponential):
    """Waves from all sides alike, and edges."""

    def _law(self, distance, faded, length):
        waves = torch.sinc(2 * distance / self.wavelength)
        return (waves if self.has_responses else waves**2) * self._faded(distance, length)


class WavesEdgesAndDrift(WavesAndEdges):
    """The same in a place that changes."""

    def _law(self, distance, faded, length):
        return super()._law(distance, faded, length) * faded


class Sides(HelmholtzField):
    """``helmholtz`` in a place that does not change."""

    def _covariance(self, a, b, faded, shares, length):
        return super()._covariance(a, b, torch.ones_like(faded), shares, length)


LADDER: dict[str, type[HelmholtzField]] = {
    "squared exponential": SquaredExponential,
    "waves alone": Waves,
    "edges alone": Exponential,
    "waves and edges": WavesAndEdges,
    "waves, edges, drift": WavesEdgesAndDrift,
    "waves from their sides, edges": Sides,
    "waves from their sides, edges, drift": HelmholtzField,
}


def rungs(dataset: Dataset, known: np.ndarray, test: np.ndarray) -> dict[str, float]:
    """Median SSIM of every method."""
    truth = dataset.pictures[test] / np.float32(255)
    positions = dataset.positions[test]
    pictures, places = dataset.pictures[known] / np.float32(255), dataset.positions[known]

    def median(prediction: np.ndarray) -> float:
        return float(np.median(ssim(prediction.astype(np.float32), truth)))

    found = {
        "nearest": median(nearest(places, pictures, positions)),
        "inverse distance": median(inverse_distance(places, pictures, positions)),
    }
    of: dict[str, Dataset] = {"pictures": replace(dataset, responses=None)}
    if dataset.responses is not None:
        of["responses"] = dataset
    for kind, data in of.items():
        for name, law in LADDER.items():
            found[f"{kind}, {name}"] = median(predicted(law, data, known, positions))
    return found


def predicted(
    law: Callable[..., HelmholtzField], dataset: Dataset, known: np.ndarray, positions: np.ndarray
) -> np.ndarray:
    """Pictures [K, 90, 360] at positions [K, 3]."""
    field = law(np.zeros((2, 3)), dataset.array)
    field.fit(dataset, known)
    return predict(field, positions).spectra


def main() -> None:
    """Print the ladder of every table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("measured", type=Path)
    parser.add_argument("simulated", type=Path)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()

    measured, simulated = read_dataset(arguments.measured), read_dataset(arguments.simulated)
    files, blocked = split(measured, "files", 0), split(simulated, "blocked", 0)
    block = np.arange(len(measured.names)) // BLOCK % EVERY
    some = evenly(blocked.test, MOST_TESTED)
    tables = {"measured, files": (measured, files.known, files.test)}
    for offset in range(EVERY):  # 1 is the split `blocked`
        tables[f"measured, blocked from {offset}"] = (
            measured,
            np.flatnonzero(block != offset),
            np.flatnonzero(block == offset),
        )
    tables["simulated, blocked"] = (simulated, blocked.known, some)
    for count in FEWER:
        tables[f"simulated, blocked, {count}"] = (simulated, evenly(blocked.known, count), some)
    figures = {
        name: rungs(*table)
        for name, table in track(tables.items(), disable=not sys.stderr.isatty(), description="ladder")
    }
    if arguments.json:
        print(json.dumps(figures, indent=2))
        return
    for name, row in figures.items():
        print(name)
        for rung, value in row.items():
            print(f"  {rung:34} {value:.4f}")


if __name__ == "__main__":
    main()
