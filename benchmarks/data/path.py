"""Do spectra along a simulated path change with distance as measured ones do?

python -m benchmarks.data.path data/rfid-s23-160 --json

The figures are median SSIMs (1: the same) of all pairs of spectra less than 32 cm apart, in bins of the distance in
metres. A path simulated in the lab is compared with a measured dataset. A bin of fewer than five pairs has no figure
(nan).
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro
from scipy.spatial import cKDTree

from benchmarks.ledger.printing import print_figures
from learn.data.metrics import ssim
from scenes.places.built_in import lab
from simulate.dataset.dataset_folder import read_dataset
from simulate.positions.placement import place
from simulate.rays.core.propagation import Propagation
from simulate.rays.tracer import Tracer
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import picture, spectrum_of

EDGES = (0.0, 0.01, 0.02, 0.04, 0.08, 0.16, 0.32)
"""Edges of the bins of the distance, metres."""


def neighbours(positions: np.ndarray, pictures: np.ndarray) -> dict[str, float]:
    """Median SSIM of the pairs of pictures [K, 90, 360] (0…1) in each bin of the distance of positions [K, 3]."""
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
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Compare a simulated path with a measured one."""
    dataset = read_dataset(measured)
    positions = place(lab(), "path", spectra, 0)
    propagation = Propagation()
    if smallest:
        positions, propagation = positions[:20], Propagation(max_depth=1, rays=10_000)
    responses = Tracer(lab(), propagation).responses(positions)
    simulated = spectrum_of(picture(Beamformer().spectrum(responses)))
    found, expected = neighbours(positions, simulated), neighbours(dataset.positions, dataset.spectra.astype(float))
    result = {f"ssim_at_{name}": f"measured {expected[name]}, simulated {found[name]}" for name in found}
    print_figures(result, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
