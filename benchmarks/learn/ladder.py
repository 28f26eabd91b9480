"""How much does each part of the covariance of helmholtz add to its accuracy?

python -m benchmarks.learn.ladder data/rfid-s23-160 runs/lab-6000 --json

The figures are median SSIMs of test spectra of a measured and of a simulated dataset. The methods are the baselines
nearest and inverse-distance, and kriging with several covariances, of which the last is that of helmholtz. Kriging
interpolates the spectra ("pictures") and, if the dataset has them, the responses.

Nothing is random. The parameters of each covariance have the highest likelihood given the known part. For spectra, the
first three covariances are used unchanged and the others squared, since a spectrum is a magnitude and has no phase.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import numpy as np
import torch
import tyro
from rich.progress import track
from tyro.conf import Positional

from benchmarks.ledger.printing import print_figures
from learn.data.metrics import ssim
from learn.data.neighbours import inverse_distance, nearest
from learn.data.splits import BLOCK, EVERY, split
from learn.models.kriging.kriged_field import KrigedField
from learn.training.prediction import predict
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import read_dataset
from simulate.spectra.spectrum import evenly, spectrum_of

MOST_TESTED = 300
"""Largest number of test spectra of the simulated dataset, evenly spread over its test part."""

FEWER = 1000, 200, 50
"""Numbers of known spectra of the simulated dataset in further tables."""

SMALLEST = 6
"""Number of known spectra, and of test spectra, with ``smallest``."""


class SquaredExponential(KrigedField):
    """exp(−d²/2l²) of the distance d; also the base class of the other covariances that only depend on the distance."""

    def kappa(self, separations, fading, shares, length):
        law = self._law(separations.distances, fading, length)
        return law, torch.zeros_like(law) if self.of_responses else None

    def _law(self, distance, faded, length):
        return torch.exp(-((distance / length) ** 2) / 2)


class Exponential(SquaredExponential):
    """exp(−d/l): a field with edges and without waves."""

    def _law(self, distance, faded, length):
        return torch.exp(-distance / length)


class Waves(SquaredExponential):
    """sinc(2d/l): waves of equal power from all directions, of a fitted wavelength, and no edges."""

    def _law(self, distance, faded, length):
        return torch.sinc(2 * distance / length)


class WavesAndEdges(SquaredExponential):
    """sinc(2d/λ) · exp(−d/l): waves of equal power from all directions, and edges."""

    def _law(self, distance, faded, length):
        waves = torch.sinc(2 * distance / self.wavelength)
        return (waves if self.of_responses else waves**2) * self.fading(distance, length)


class WavesEdgesAndDrift(WavesAndEdges):
    """The same in a scene that changes while spectra are recorded."""

    def _law(self, distance, faded, length):
        return super()._law(distance, faded, length) * faded


class Sides(KrigedField):
    """``helmholtz`` in a scene that does not change."""

    def kappa(self, separations, fading, shares, length):
        return super().kappa(separations, torch.ones_like(fading), shares, length)


LADDER: dict[str, type[KrigedField]] = {
    "squared exponential": SquaredExponential,
    "waves alone": Waves,
    "edges alone": Exponential,
    "waves and edges": WavesAndEdges,
    "waves, edges, drift": WavesEdgesAndDrift,
    "waves from their sides, edges": Sides,
    "waves from their sides, edges, drift": KrigedField,
}


def rungs(dataset: Dataset, known: np.ndarray, test: np.ndarray) -> dict[str, float]:
    """Median SSIM of every method over the test part; ``known`` and ``test`` are indices into the dataset."""
    truth = spectrum_of(dataset.pictures[test])
    positions = dataset.positions[test]
    spectra, known_positions = spectrum_of(dataset.pictures[known]), dataset.positions[known]

    def median(prediction: np.ndarray) -> float:
        return float(np.median(ssim(prediction.astype(np.float32), truth)))

    found = {
        "nearest": median(nearest(known_positions, spectra, positions)),
        "inverse-distance": median(inverse_distance(known_positions, spectra, positions)),
    }
    of: dict[str, Dataset] = {"pictures": dataset.with_values(response=None)}
    if "response" in dataset.values:
        of["responses"] = dataset
    for kind, data in of.items():
        for name, law in LADDER.items():
            found[f"{kind}, {name}"] = median(predicted(law, data, known, positions))
    return found


def predicted(
    law: Callable[..., KrigedField], dataset: Dataset, known: np.ndarray, positions: np.ndarray
) -> np.ndarray:
    """Spectra [K, 90, 360] at positions [K, 3]."""
    of = "spectra" if "response" not in dataset.values else "responses"
    field = law(np.zeros((2, 3)), dataset.beamformer, dataset.wavelength, of)
    field.fit(dataset, known)
    return predict(field, positions).spectra


def main(
    measured: Positional[Path],
    simulated: Positional[Path],
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Score every method on every table of known and test spectra."""
    recorded, traced = read_dataset(measured), read_dataset(simulated)
    files, blocked = split(recorded, "files", 0), split(traced, "blocked", 0)
    block = np.arange(len(recorded.names)) // BLOCK % EVERY
    some = evenly(blocked.test, MOST_TESTED)
    tables = {"measured, files": (recorded, files.known, files.test)}
    for offset in range(EVERY):  # 1 is the split `blocked`
        known, test = np.flatnonzero(block != offset), np.flatnonzero(block == offset)
        tables[f"measured, blocked from {offset}"] = (recorded, known, test)
    tables["simulated, blocked"] = (traced, blocked.known, some)
    for count in FEWER:
        tables[f"simulated, blocked, {count}"] = (traced, evenly(blocked.known, count), some)
    if smallest:
        tables = {
            name: (dataset, evenly(known, SMALLEST), evenly(test, SMALLEST))
            for name, (dataset, known, test) in tables.items()
            if name in ("measured, files", "simulated, blocked")
        }
    figures = {
        name: rungs(*table)
        for name, table in track(tables.items(), disable=not sys.stderr.isatty(), description="ladder")
    }
    print_figures(figures, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
