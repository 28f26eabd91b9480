"""What a measured sample allows: how far weighting known pictures could go, and how the place changes meanwhile.

python benchmarks/limits.py MEASURED SIMULATED --json

The weights of the oracle are those of least squared error given the test picture itself, so it is no method: it shows
what to expect at best of weighting the mean and the k nearest known pictures, as copying and kriging do.
"""

from __future__ import annotations

import argparse
import json
from itertools import pairwise
from pathlib import Path

import numpy as np

from learn.metrics import ssim
from learn.models.helmholtz import HelmholtzField
from learn.splits import SplitKind, split
from simulate.dataset import Dataset, read_dataset

NEAREST = 1, 2, 3, 4, 8, 16, 32
BINS = 0, 0.01, 0.02, 0.03, 0.04, 0.06, 0.08, 0.12
SOON = 10
"""Spectra; pairs recorded no further apart are compared with those recorded later."""


def oracle(dataset: Dataset, kind: SplitKind, count: int) -> float:
    """Median SSIM of the weighted sum of the mean and the so many nearest known pictures, weights by least squares."""
    parts = split(dataset, kind, 0)
    pictures = dataset.pictures / np.float32(255)
    mean = pictures[parts.known].mean(axis=0).ravel()
    best = []
    for index in parts.test:
        distance = np.linalg.norm(dataset.positions[parts.known] - dataset.positions[index], axis=1)
        near = np.vstack([mean, pictures[parts.known[distance.argsort()[:count]]].reshape(count, -1)])
        weights = np.linalg.lstsq(near.T, pictures[index].ravel(), rcond=None)[0]
        best.append((weights @ near).clip(0, 1).reshape(pictures.shape[1:]))
    return float(np.median(ssim(np.array(best), pictures[parts.test])))


def changes(dataset: Dataset) -> dict[str, str]:
    """Median SSIM of pairs of spectra by distance, of those recorded soon after one another and of the others."""
    first, second = np.triu_indices(len(dataset.names), 1)
    distance = np.linalg.norm(dataset.positions[first] - dataset.positions[second], axis=1)
    soon = second - first <= SOON
    near = distance < BINS[-1]
    first, second, distance, soon = first[near], second[near], distance[near], soon[near]
    pictures = dataset.pictures / np.float32(255)
    alike = ssim(pictures[first], pictures[second])
    found = {}
    for low, high in pairwise(BINS):
        said = []
        for name, when in (("soon", soon), ("later", ~soon)):
            pairs = alike[(distance >= low) & (distance < high) & when]
            said.append(f"{name} {np.median(pairs):.3f} of {len(pairs)}" if len(pairs) else f"{name} none")
        found[f"ssim_at_{low}-{high} m"] = ", ".join(said)
    return found


def law(dataset: Dataset, kind: SplitKind) -> str:
    """What ``helmholtz`` finds most likely of the known spectra."""
    field = HelmholtzField(np.zeros((2, 3)), dataset.array)
    field.fit(dataset, split(dataset, kind, 0).known)
    drift = "no drift" if field.drift > 10 * len(dataset.names) else f"drift within {float(field.drift):.0f} spectra"
    return f"length {float(field.length):.2f} m, {drift}, nugget {float(field.nugget):.1e}"


def main() -> None:
    """Print all three."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("measured", type=Path)
    parser.add_argument("simulated", type=Path)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    dataset = read_dataset(arguments.measured)
    kinds: tuple[SplitKind, ...] = ("files", "blocked")
    figures: dict[str, float | str] = {
        f"oracle_{kind}_{count}_nearest": round(oracle(dataset, kind, count), 3) for kind in kinds for count in NEAREST
    }
    figures |= changes(dataset)
    figures |= {f"law_measured_{kind}": law(dataset, kind) for kind in kinds}
    figures["law_simulated_blocked"] = law(read_dataset(arguments.simulated), "blocked")
    print(json.dumps(figures, indent=2) if arguments.json else "\n".join(f"{k:32} {v}" for k, v in figures.items()))


if __name__ == "__main__":
    main()
