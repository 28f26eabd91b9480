"""Our chains against themselves (two seeds) and against the loop that every published script uses, in one run.

python benchmarks/trace.py --json
"""

from __future__ import annotations

import json
import time
from typing import Any

import numpy as np
import tyro

from learn.metrics import ssim
from scenes.lab import lab
from simulate.placement import place
from simulate.propagation import Propagation
from simulate.spectrum import PlanarArray, picture
from simulate.trace import Tracer

ELEMENTS = PlanarArray()


def pictures(channels: np.ndarray) -> np.ndarray:
    """Pictures 0…1 as a dataset would hold them."""
    return picture(ELEMENTS.spectrum(channels)) / 255.0


def loop(positions: np.ndarray, rays: int) -> tuple[np.ndarray, float]:
    """The published way: the transmitter as source, one call each; responses and seconds per transmitter."""
    from simulate.ray_tracer import mi, rt
    from simulate.sionna_scene import build_scene, gateway_antennas, transmitter_antennas

    scene = lab()
    sionna = build_scene(scene)
    gateway, transmitters = gateway_antennas(scene), transmitter_antennas(scene, positions)
    one = rt.PlanarArray(num_rows=1, num_cols=1, pattern=scene.transmitter.pattern, polarization="V")
    element = rt.PlanarArray(num_rows=1, num_cols=1, pattern=scene.gateway.pattern, polarization="V")
    sionna.tx_array, sionna.rx_array = one, element
    for index, position in enumerate(gateway.positions):
        sionna.add(
            rt.Receiver(f"element-{index}", mi.Point3f(*map(float, position)), mi.Point3f(*map(float, gateway.angles)))
        )
    solver, responses = rt.PathSolver(), []
    began = time.perf_counter()
    for number, position in enumerate(positions):
        if number == 1:
            began = time.perf_counter()  # the first call compiles
        sionna.add(
            rt.Transmitter("tx", mi.Point3f(*map(float, position)), mi.Point3f(*map(float, transmitters.angles)))
        )
        paths = solver(sionna, max_depth=5, samples_per_src=rays, synthetic_array=False)
        real, imaginary = (part.numpy().astype(np.float64) for part in paths.a)
        delay = paths.tau.numpy().astype(np.float64)
        turned = (real + 1j * imaginary) * np.exp(-2j * np.pi * scene.frequency * np.maximum(delay, 0))
        responses.append(turned.sum(axis=-1).reshape(len(gateway.positions)))
        sionna.remove("tx")
    return np.array(responses), (time.perf_counter() - began) / (len(positions) - 1)


def main(positions: int = 20, rays: int = 1_000_000, json_output: tyro.conf.arg(name="json") = False) -> None:  # type: ignore
    """Compare.

    Args:
        positions: transmitters of the comparison with the loop.
        rays: the loop's rays per transmitter.
        json_output: print one JSON object.
    """
    places = place(lab(), "uniform", 400, 7)
    began = time.perf_counter()
    first = Tracer(lab(), Propagation(seed=1))
    finding = time.perf_counter() - began
    first.responses(places[:50])
    began = time.perf_counter()
    ours = first.responses(places)
    solving = (time.perf_counter() - began) / len(places)
    other = Tracer(lab(), Propagation(seed=1000)).responses(places[:100])
    theirs, looping = loop(places[:positions], rays)
    between_seeds = ssim(pictures(ours[:100]), pictures(other))
    with_loop = ssim(pictures(ours[:positions]), pictures(theirs))
    result: dict[str, Any] = {
        "finding_chains_seconds": round(finding, 1),
        "seconds_per_spectrum": round(solving, 4),
        "loop_seconds_per_spectrum": round(looping, 3),
        "ratio_at_6000": round(looping / (solving + finding / 6000), 1),
        "ssim_median_between_seeds": round(float(np.median(between_seeds)), 4),
        "ssim_p05_between_seeds": round(float(np.percentile(between_seeds, 5)), 4),
        "ssim_median_with_loop": round(float(np.median(with_loop)), 4),
        "ssim_p05_with_loop": round(float(np.percentile(with_loop, 5)), 4),
        "power_over_loop": round(float((np.abs(ours[:positions]) ** 2).sum() / (np.abs(theirs) ** 2).sum()), 4),
        "loop_positions": positions,
        "loop_rays": rays,
    }
    print(json.dumps(result) if json_output else result)


if __name__ == "__main__":
    tyro.cli(main)
