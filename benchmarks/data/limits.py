"""How well can a measured sample be predicted at all?

python -m benchmarks.data.limits data/rfid-s23-160 runs/lab-6000 --json

Three things are measured on a measured and on a simulated dataset.

oracle: the median SSIM of the best weighted sums of the mean picture and the k nearest known pictures. The weights are
fitted to the test picture itself, so this is not a method. It bounds methods that predict weighted sums of known
pictures, such as nearest and kriging.

ssim_at: the median SSIM of pairs of measured spectra, by the distance of their positions in metres. Pairs recorded
within ten spectra of each other (soon) are separate from all others (later).

law: the likeliest parameters of helmholtz. These are the length of its covariance in metres, the number of spectra
within which the place changes (drift), and the share of noise in the variance (nugget).
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro
from tyro.conf import Positional

from benchmarks.ledger.printing import print_figures
from learn.data.metrics import ssim
from learn.data.splits import SplitKind, split
from learn.models.kriging.kriged_field import KrigedField
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import read_dataset
from simulate.spectra.spectrum import evenly, spectrum_of

NEAREST = 1, 2, 3, 4, 8, 16, 32
"""Numbers of nearest pictures that are weighted."""

BINS = 0, 0.01, 0.02, 0.03, 0.04, 0.06, 0.08, 0.12
"""Edges of the bins of the distance, metres."""

SOON = 10
"""Spectra; pairs recorded no further apart are compared with those recorded later."""

SMALLEST = 8
"""Spectra of each part of the split where the benchmark is at its smallest."""


def oracle(dataset: Dataset, kind: SplitKind, count: int, most: int | None) -> float:
    """Median SSIM of weighted sums of the mean and the ``count`` nearest known pictures, weights by least squares."""
    parts = split(dataset, kind, 0)
    pictures = spectrum_of(dataset.pictures)
    mean = pictures[parts.known].mean(axis=0).ravel()
    best = []
    test = parts.test if most is None else evenly(parts.test, most)
    for index in test:
        distance = np.linalg.norm(dataset.positions[parts.known] - dataset.positions[index], axis=1)
        near = np.vstack([mean, pictures[parts.known[distance.argsort()[:count]]].reshape(count, -1)])
        weights = np.linalg.lstsq(near.T, pictures[index].ravel(), rcond=None)[0]
        best.append((weights @ near).clip(0, 1).reshape(pictures.shape[1:]))
    return float(np.median(ssim(np.array(best), pictures[test])))


def changes(dataset: Dataset, most: int | None) -> dict[str, str]:
    """Median SSIM of pairs of spectra by distance, of those recorded soon after one another and of the others."""
    first, second = np.triu_indices(len(dataset.names), 1)
    distance = np.linalg.norm(dataset.positions[first] - dataset.positions[second], axis=1)
    soon = second - first <= SOON
    near = distance < BINS[-1]
    first, second, distance, soon = first[near][:most], second[near][:most], distance[near][:most], soon[near][:most]
    pictures = spectrum_of(dataset.pictures)
    alike = ssim(pictures[first], pictures[second])
    found = {}
    for low, high in pairwise(BINS):
        said = []
        for name, when in (("soon", soon), ("later", ~soon)):
            pairs = alike[(distance >= low) & (distance < high) & when]
            said.append(f"{name} {np.median(pairs):.3f} of {len(pairs)}" if len(pairs) else f"{name} none")
        found[f"ssim_at_{low}-{high} m"] = ", ".join(said)
    return found


def law(dataset: Dataset, kind: SplitKind, most: int | None) -> str:
    """The likeliest parameters of ``helmholtz``, given the known spectra, at most ``most`` of them."""
    of = "spectra" if "response" not in dataset.values else "responses"
    field = KrigedField(np.zeros((2, 3)), dataset.beamformer, dataset.wavelength, of)
    known = split(dataset, kind, 0).known
    field.fit(dataset, known if most is None else evenly(known, most))
    drift = "no drift" if field.drift > 10 * len(dataset.names) else f"drift within {float(field.drift):.0f} spectra"
    return f"length {float(field.length):.2f} m, {drift}, nugget {float(field.nugget):.1e}"


def main(
    measured: Positional[Path],
    simulated: Positional[Path],
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Measure the oracle, the change with distance and time, and the likeliest law."""
    dataset = read_dataset(measured)
    kinds: tuple[SplitKind, ...] = ("files", "blocked")
    most = SMALLEST if smallest else None
    figures: dict[str, float | str] = {
        f"oracle_{kind}_{count}_nearest": round(oracle(dataset, kind, count, most), 3)
        for kind in kinds
        for count in NEAREST
    }
    figures |= changes(dataset, most)
    figures |= {f"law_measured_{kind}": law(dataset, kind, most) for kind in kinds}
    figures["law_simulated_blocked"] = law(read_dataset(simulated), "blocked", most)
    print_figures(figures, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
