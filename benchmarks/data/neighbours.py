"""How similar are the spectra of transmitters 3 cm apart, in full wave and by rays?

python -m benchmarks.data.neighbours --json

In each room, random positions are paired with another one 3 cm away in a random direction. The figures are quantiles of
the SSIM of the two spectra. Full wave is interpolated from the stored fields of benchmarks/simulate/mechanisms.py,
which has to run before.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from benchmarks.ledger.printing import print_figures
from benchmarks.ledger.rays_against_full_wave import scene_for_rays
from benchmarks.ledger.smallest_room import smallest_room
from learn.data.metrics import ssim
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import read_dataset
from simulate.engines.field_folder import FIELD
from simulate.fullwave.stored_field import read_stored_field
from simulate.generation.simulation import simulate
from simulate.rays.core.propagation import Propagation
from simulate.rays.tracer import Tracer
from simulate.spectra.spectrum import picture, spectrum_of

APART = 0.03
"""Metres."""

RAYS = {
    "geometric optics": Propagation(max_depth=5, diffraction=False),
    "diffraction": Propagation(),
}
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)


def neighbours(region: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Positions [count, 3] in a box, and for each another one ``APART`` from it in the same box."""
    generator = np.random.default_rng(0)
    low, high = region[0] + APART, region[1] - APART
    step = generator.standard_normal((count, 3))
    here = generator.uniform(low, high, (count, 3))
    return here, here + APART * step / np.linalg.norm(step, axis=1, keepdims=True)


def alike(truth: Dataset, responses: tuple[np.ndarray, np.ndarray]) -> dict[str, float]:
    """Quantiles of the SSIM of the spectra of two sets of responses [K, elements]."""
    first, second = (spectrum_of(picture(truth.beamformer.spectrum(each))) for each in responses)
    values = np.quantile(ssim(first, second), QUANTILES)
    return {f"{100 * share:g} %": round(float(value), 3) for share, value in zip(QUANTILES, values, strict=True)}


def main(
    folder: Path = Path("runs/mechanisms"),
    rooms: tuple[str, ...] = ("closet", "workshop", "bedroom"),
    count: int = 300,
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Compare spectra of neighbours."""
    followed = RAYS
    if smallest:
        folder, rooms, count = Path(tempfile.mkdtemp()), ("smallest",), 3
        simulate(smallest_room(), folder / "smallest", 3, engine="fullwave", cell=0.024)
        followed = {"geometric optics": Propagation(max_depth=1, rays=1000, diffraction=False)}
    result: dict[str, Any] = {}
    for room in rooms:
        truth = read_dataset(folder / room)
        scene = scene_for_rays(truth)
        pairs = neighbours(scene.transmitter.region, count)
        field = read_stored_field(folder / room / FIELD)
        result[f"{room}, full wave"] = alike(truth, (field.responses(pairs[0]), field.responses(pairs[1])))
        for name, propagation in followed.items():
            tracer = Tracer(scene, propagation)
            result[f"{room}, {name}"] = alike(truth, (tracer.responses(pairs[0]), tracer.responses(pairs[1])))
    print_figures(result, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
