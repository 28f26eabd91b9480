"""How much does a receiver that moves tell, since all elements of its array sample one field?

python -m benchmarks.learn.moving_receiver --json

In each room, rays simulate spectra of an array that moves and of one that stands still, at 500 positions each. The
figures are the median SSIM of 80 held-out spectra, predicted from some known ones. For the moving array, kriging
interpolates the one field that its elements sample, or each element's response by itself. For the fixed array, the
model is helmholtz.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import torch
import tyro
from jaxtyping import Int

from benchmarks.ledger.printing import print_figures
from learn.data.metrics import ssim
from learn.models.base import SpectrumModel
from learn.models.kriging.helmholtz import HelmholtzField
from learn.models.kriging.interpolators import MovingArrayField
from learn.models.kriging.kriged_field import KrigedField
from simulate.dataset.dataset import Dataset
from simulate.generation.simulation import simulate
from simulate.rays.core.propagation import Propagation
from simulate.spectra.spectrum import spectrum_of

ROOMS = "closet", "bedroom"
KNOWN = 25, 50, 100, 200
SPECTRA, TESTED = 500, 80


def median_ssim(
    model: SpectrumModel, dataset: Dataset, known: Int[np.ndarray, " n"], test: Int[np.ndarray, " t"]
) -> tuple[float, float]:
    """Median SSIM of held-out spectra, and the seconds of the fit."""
    began = time.perf_counter()
    model.fit(dataset, known)  # type: ignore[operator]
    seconds = time.perf_counter() - began
    places = torch.from_numpy(dataset.positions[test]).float()
    with torch.inference_mode():
        predicted = torch.cat([model(some) for some in places.split(16)]).numpy()
    return float(np.median(ssim(predicted, spectrum_of(dataset.pictures[test])))), seconds


def of_room(name: str, folder: Path, known: tuple[int, ...], smallest: bool) -> dict[str, Any]:
    """The scores in one room, by the number of known spectra."""
    propagation = Propagation(max_depth=1, diffraction=False) if smallest else Propagation()
    count, tested = (30, 5) if smallest else (SPECTRA, TESTED)
    moves, stands = (
        simulate(name, folder / f"{name}-{moving}", n=count, moving=moving, propagation=propagation)
        for moving in ("receiver", "transmitter")
    )
    order = np.random.default_rng(0).permutation(count)
    figures: dict[str, Any] = {}
    for number in known:
        parts = order[tested : tested + number], order[:tested]
        region, beamformer, wavelength = np.zeros((2, 3)), moves.beamformer, moves.wavelength
        field, seconds = median_ssim(MovingArrayField(region, beamformer, wavelength), moves, *parts)
        by_itself, _ = median_ssim(KrigedField(region, beamformer, wavelength, "responses"), moves, *parts)
        fixed, _ = median_ssim(HelmholtzField(region, beamformer, wavelength), stands, *parts)
        figures[f"{name}, {number} known"] = {
            "moving array, one field": round(field, 3),
            "moving array, each element by itself": round(by_itself, 3),
            "fixed array": round(fixed, 3),
            "seconds of the fit of one field": round(seconds, 1),
        }
    return figures


def main(
    folder: Path = Path("runs/moving_receiver"),
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Score predictions of moving and fixed arrays."""
    rooms, known = (ROOMS[:1], KNOWN[:1]) if smallest else (ROOMS, KNOWN)
    figures: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as temporary:
        for name in rooms:
            figures |= of_room(name, Path(temporary) if smallest else folder, known, smallest)
    print_figures(figures, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
