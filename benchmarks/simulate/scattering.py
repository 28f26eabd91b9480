"""Does diffuse reflection converge with the number of patches, or of Sionna's rays, and what does it cost?

python -m benchmarks.simulate.scattering --json

The walls of the closet are rough (scattering coefficient 0.3), and diffuse reflection is followed once and nothing
else. The figures are the mean channel gain (dB) of one element over the positions, for several numbers of patches or
rays, and milliseconds per spectrum of 16 elements. For patches, the gain has a mean and a standard deviation over
several seeds.
"""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Annotated, Any

import numpy as np
import tyro

from benchmarks.ledger.printing import print_figures
from scenes.places.built_in import closet
from scenes.scene.description import Scene
from simulate.positions.placement import free_positions
from simulate.rays.core.propagation import Propagation
from simulate.rays.tracer import Tracer

ROUGHNESS = 0.3
DIFFUSE = Propagation(
    max_depth=1, los=False, specular=False, refraction=False, diffuse=True, diffraction=False, rays=10_000
)


def rough_closet() -> Scene:
    """The closet, of rough materials."""
    scene = closet()
    rough = {name: replace(each, scattering_coefficient=ROUGHNESS) for name, each in scene.materials.items()}
    return replace(scene, materials=rough)


def gain(scene: Scene, propagation: Propagation, positions: np.ndarray, seed: int) -> tuple[float, float]:
    """Mean channel gain of an element over the positions, dB, and milliseconds per position."""
    tracer = Tracer(scene, propagation, seed=seed)
    tracer.responses(positions[:1])  # compiles the kernels
    began = time.perf_counter()
    responses = tracer.responses(positions)
    milliseconds = 1e3 * (time.perf_counter() - began) / len(positions)
    return float(10 * np.log10((np.abs(responses) ** 2).mean())), milliseconds


def main(
    patches: tuple[int, ...] = (125, 500, 2000, 8000),
    rays: tuple[int, ...] = (2000, 20_000, 200_000),
    positions: int = 200,
    seeds: int = 4,
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Trace diffuse reflection in the closet."""
    scene = rough_closet()
    if smallest:
        patches, rays, positions, seeds = patches[:1], rays[:1], 3, 2
    where = free_positions(scene, scene.transmitter.region, positions, np.random.default_rng(0))
    result: dict[str, Any] = {}
    for count in patches:
        gains, milliseconds = np.transpose(
            [gain(scene, replace(DIFFUSE, patches=count), where, seed) for seed in range(seeds)]
        )
        result[f"{count} patches"] = {
            "gain_db": round(float(gains.mean()), 2),
            "deviation_db": round(float(gains.std(ddof=1)), 2),
            "ms_per_spectrum": round(float(np.median(milliseconds)), 1),
        }
    for count in rays:
        found, milliseconds = gain(scene, replace(DIFFUSE, sionna=True, rays=count), where, 0)
        result[f"Sionna, {count} rays"] = {
            "gain_db": round(found, 2),
            "deviation_db": None,
            "ms_per_spectrum": round(milliseconds, 1),
        }
    print_figures(result, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
