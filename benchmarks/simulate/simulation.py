"""How much faster is ``bisplat simulate`` than one solver call per transmitter, and do the spectra agree?

python -m benchmarks.simulate.simulation --figure docs/generated/simulation.png --json

The place is the lab, with up to five reflections and refractions as Sionna RT has them: without diffraction, and with
slabs counted twice. ``bisplat simulate`` is timed for datasets of three sizes (seconds, peak memory in GB). The other
way is the loop of published scripts: for each transmitter one ``PathSolver`` call with a million rays, between the real
element positions.

The spectra of both are compared by SSIM, with each other and with a third tracing of ten million rays per transmitter.
Sionna RT counts a passage through an object towards the depth, as it counts a reflection, and ``bisplat simulate``
does not. So the spectra are also compared without the paths that have more than five of both (``limited``).

Finally ``bisplat simulate`` is timed with its defaults, which include diffraction. All this takes about twenty minutes
on two cores, most of it for the third tracing and the largest dataset. No other program should run meanwhile.
"""

from __future__ import annotations

import os
import tempfile
import time
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from benchmarks.ledger.commands import Measured, measured
from benchmarks.ledger.printing import print_figures
from learn.data.metrics import ssim
from scenes.places.built_in import lab
from simulate.positions.placement import place
from simulate.rays.core.multipath import Interaction, Paths
from simulate.rays.core.propagation import Propagation
from simulate.rays.core.ray_scene import with_transmissions
from simulate.rays.tracer import Tracer
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import picture, spectrum_of

BEAMFORMER = Beamformer()
LOOP_RAYS, DENSE_RAYS = 1_000_000, 10_000_000
GEOMETRIC = Propagation(max_depth=5, diffraction=False, slab_phase=False)
SMALLEST = Propagation(max_depth=1, rays=10_000, diffraction=False)


def pictures(responses: np.ndarray) -> np.ndarray:
    """Pictures [K, 90, 360], 0…1, that a dataset of these responses [K, elements] would hold."""
    return spectrum_of(picture(BEAMFORMER.spectrum(responses)))


class Loop:
    """The loop of published scripts: a solver call per transmitter, which is the source; the elements are receivers."""

    def __init__(self, max_depth: int) -> None:
        from simulate.rays.core.ray_tracer import mi, rt
        from simulate.rays.core.sionna_scene import build_scene, gateway_antennas, transmitter_antennas

        self.scene, self.max_depth = lab(), max_depth
        self.sionna = build_scene(self.scene)
        gateway = gateway_antennas(self.scene)
        self.angles = mi.Point3f(*map(float, transmitter_antennas(self.scene, np.zeros((1, 3))).angles))
        self.sionna.tx_array, self.sionna.rx_array = (
            rt.PlanarArray(num_rows=1, num_cols=1, pattern=pattern, polarization="V")
            for pattern in (self.scene.transmitter.pattern, self.scene.gateway.pattern)
        )
        for index, position in enumerate(gateway.positions):
            place = mi.Point3f(*map(float, position)), mi.Point3f(*map(float, gateway.angles))
            self.sionna.add(rt.Receiver(f"element-{index}", *place))
        self.solver = rt.PathSolver()

    def responses(self, positions: np.ndarray, rays: int) -> tuple[np.ndarray, float]:
        """Responses [K, elements], and seconds per transmitter. The first does not count, since it compiles kernels."""
        from simulate.rays.core.ray_tracer import mi, rt

        responses, began = [], time.perf_counter()
        for number, position in enumerate(positions):
            if number == 1:
                began = time.perf_counter()
            self.sionna.add(rt.Transmitter("tx", mi.Point3f(*map(float, position)), self.angles))
            paths = self.solver(
                self.sionna,
                max_depth=self.max_depth,
                samples_per_src=rays,
                max_num_paths_per_src=rays,
                synthetic_array=False,
            )
            real, imaginary = (part.numpy().astype(np.float64) for part in paths.a)
            delay = paths.tau.numpy().astype(np.float64)
            turned = (real + 1j * imaginary) * np.exp(-2j * np.pi * self.scene.frequency * np.maximum(delay, 0))
            responses.append(turned.sum(axis=-1).reshape(BEAMFORMER.array.elements))
            self.sionna.remove("tx")
        return np.array(responses), (time.perf_counter() - began) / max(1, len(positions) - 1)


def limited_responses(tracer: Tracer, positions: np.ndarray, most: int) -> np.ndarray:
    """Responses [K, elements] of the paths with at most this many reflections and passages through objects."""
    result = np.zeros((len(positions), len(tracer.elements)), np.complex128)
    for terms in tracer.multipath(positions):
        counted = with_transmissions(
            tracer.ray_scene, terms._replace(vertices=terms.vertices - tracer.ray_scene.origin)
        )
        few = (counted.kinds != Interaction.NONE).sum(axis=1) <= most
        Paths(terms.targets[few], terms.sources[few], terms.responses[few]).add_to(result)
    return result


def dataset(spectra: int, propagation: Propagation) -> Measured:
    """Time and memory of ``bisplat simulate``, from its start to the last file on disk."""
    with tempfile.TemporaryDirectory() as folder:
        traced = ["--max-depth", str(propagation.max_depth), "--rays", str(propagation.rays)]
        traced += [] if propagation.diffraction else ["--no-diffraction", "--no-slab-phase"]
        return measured("simulate", "lab", "-o", f"{folder}/lab", "-n", str(spectra), *traced)


def draw(sizes: list[int], ours: list[float], loop: float, path: Path) -> None:
    """Draw the seconds of both against the number of transmitter positions."""
    import matplotlib.pyplot as plt

    from learn.reports.plots import label_log_axis

    figure, axes = plt.subplots(figsize=(5.5, 4), layout="constrained")
    axes.loglog(sizes, [loop * n for n in sizes], "s--", label="one PathSolver call each, 10⁶ rays (extrapolated)")
    axes.loglog(sizes, ours, "o-", label="bisplat simulate, written to disk")
    axes.set(xlabel="transmitter positions", ylabel="seconds", title="lab, depth 5 without diffraction, 4 × 4 elements")
    for axis in (axes.xaxis, axes.yaxis):
        label_log_axis(axis)
    axes.grid(which="both", alpha=0.3)
    axes.legend()
    figure.savefig(path, dpi=120)


def main(
    positions: int = 50,
    dense: int = 5,
    sizes: tuple[int, ...] = (1000, 6000, 20000),
    figure: Path | None = None,
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Compare both ways to trace the lab."""
    propagation, default, loop_rays, dense_rays = GEOMETRIC, Propagation(), LOOP_RAYS, DENSE_RAYS
    if smallest:
        propagation, loop_rays, dense_rays = SMALLEST, SMALLEST.rays, SMALLEST.rays
        default, positions, dense, sizes = Propagation(max_depth=1, rays=10_000), 2, 1, (2, 3)
    for each in (default, propagation):
        dataset(2, each)  # compiles what later commands take from a cache
    with_diffraction = [dataset(size, default) for size in sizes[:2]]
    timed = [dataset(size, propagation) for size in sizes]
    seconds = [each["seconds"] for each in timed]
    diffracted = [each["seconds"] for each in with_diffraction]
    marginal = np.diff(seconds) / np.diff(sizes)  # the search for chains cancels

    places = place(lab(), "uniform", positions, 7)
    began = time.perf_counter()
    tracer = Tracer(lab(), propagation)
    finding = time.perf_counter() - began
    ours = tracer.responses(places)
    limited = limited_responses(tracer, places, propagation.max_depth)
    other = Tracer(lab(), propagation, seed=1000).responses(places)
    loop = Loop(propagation.max_depth)
    theirs, looping = loop.responses(places, loop_rays)
    densest, _ = loop.responses(places[:dense], dense_rays)
    if figure is not None:
        draw(list(sizes), seconds, looping, figure)

    def agreement(name: str, first: np.ndarray, second: np.ndarray) -> dict[str, float]:
        values = ssim(pictures(first), pictures(second))
        return {
            f"ssim_median{name}": round(float(np.median(values)), 4),
            f"ssim_p05{name}": round(float(np.percentile(values, 5)), 4),
        }

    result: dict[str, Any] = {
        "ratio": round(looping / (seconds[1] / sizes[1]), 1),
        **agreement("", ours, theirs),
        **agreement("_between_our_seeds", ours, other),
        **agreement("_ours_with_dense", ours[:dense], densest),
        **agreement("_limited", limited, theirs),
        **agreement("_limited_with_dense", limited[:dense], densest),
        **agreement("_loop_with_dense", theirs[:dense], densest),
        "positions": positions,
        "dense_positions": dense,
        "loop_seconds_per_spectrum": round(looping, 3),
        "finding_chains_seconds": round(finding, 1),
        "chains": len([] if tracer.found.reflected is None else tracer.found.reflected),
        **{f"seconds_{size}": round(each, 1) for size, each in zip(sizes, seconds, strict=True)},
        **{
            f"milliseconds_per_further_spectrum_to_{n}": round(1e3 * float(m), 2)
            for n, m in zip(sizes[1:], marginal, strict=True)
        },
        **{f"seconds_{n}_with_diffraction": round(each, 1) for n, each in zip(sizes, diffracted, strict=False)},
        "milliseconds_per_further_spectrum_with_diffraction": round(
            1e3 * (diffracted[1] - diffracted[0]) / (sizes[1] - sizes[0]), 2
        ),
        "peak_memory_gb": round(max(each["peak_gb"] for each in (*timed, *with_diffraction)), 2),
        "cores": os.cpu_count(),
    }
    print_figures(result, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
