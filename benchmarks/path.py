"""Do spectra along a simulated path change as measured ones do? SSIM between neighbours, against their distance.

python benchmarks/path.py ../shared/data/rfid-s23-160 --json

The measured folder holds a sample of a long recording, so its neighbours are further apart than the recording's. The
simulated path is sampled at steps of the same median length, and both are binned by distance.
"""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro
from scipy.spatial import cKDTree

from learn.metrics import ssim
from scenes.lab import lab
from simulate.array import PlanarArray
from simulate.dataset import read_dataset
from simulate.placement import place
from simulate.propagation import Propagation
from simulate.spectrum import picture
from simulate.trace import Tracer

EDGES = (0.0, 0.01, 0.02, 0.04, 0.08, 0.16, 0.32)
"""Metres."""


def neighbours(positions: np.ndarray, pictures: np.ndarray) -> dict[str, float]:
    """Median SSIM of pairs, by their distance."""
    pairs = cKDTree(positions).query_pairs(EDGES[-1], output_type="ndarray")
    distance = np.linalg.norm(positions[pairs[:, 0]] - positions[pairs[:, 1]], axis=1)
    values = ssim(pictures[pairs[:, 0]], pictures[pairs[:, 1]])
    inside = [(distance >= low) & (distance < high) for low, high in pairwise(EDGES)]
    return {
        f"{low:g}-{high:g} m": round(float(np.median(values[chosen])), 3) if chosen.sum() >= 5 else float("nan")
        for (low, high), chosen in zip(pairwise(EDGES), inside, strict=True)
    }


def main(
    measured: tyro.conf.Positional[Path],
    spectra: int = 400,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Compare.

    Args:
        measured: a measured dataset folder.
        spectra: simulated positions.
        json_output: print one JSON object.
    """
    dataset = read_dataset(measured)
    positions = place(lab(), "path", spectra, 0)
    responses = Tracer(lab(), Propagation()).responses(positions)
    simulated = picture(PlanarArray().spectrum(responses)) / 255.0
    found, expected = neighbours(positions, simulated), neighbours(dataset.positions, dataset.spectra.astype(float))
    result = {f"ssim_at_{name}": f"measured {expected[name]}, simulated {found[name]}" for name in found}
    print(json.dumps(result) if json_output else json.dumps(result, indent=2))


if __name__ == "__main__":
    tyro.cli(main)
