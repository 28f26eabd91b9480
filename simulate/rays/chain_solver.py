"""The paths of chains that were found once, between all elements and transmitters, and their sum over a band."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numba
import numpy as np
from jaxtyping import Complex, Float, Int

from scenes.scene.description import SPEED_OF_LIGHT
from scenes.scene.shapes import bounding_box
from scenes.storage.scene_digest import scene_digest
from simulate.parallel.compiled import ONE_KERNEL, compiled
from simulate.positions.placement import free_positions
from simulate.rays.core.multipath import Multipath, Paths
from simulate.rays.core.ray_scene import RayScene
from simulate.rays.core.reflection_chains import Chains, find_chains, reflected
from simulate.rays.core.shooting import explore
from simulate.rays.core.sionna_scene import Antennas, gateway_antennas, transmitter_antennas
from simulate.rays.core.solution import Solution
from simulate.rays.core.surfaces import Surfaces
from simulate.rays.diffraction.diffracted_paths import EdgeScene, diffracted
from simulate.rays.diffraction.diffraction_chains import DiffractedChains
from simulate.rays.diffraction.edges import Edges
from simulate.rays.diffraction.passing_rays import PassingRays
from simulate.rays.diffraction.search import find_diffracted_chains, most_reflections
from simulate.spectra.band import chebyshev_points


class Found(NamedTuple):
    """The chains that a tracer found, for another tracer of the same scene and propagation."""

    # chains of reflections, which name the scene's planes; None if rays are shot for every batch instead
    reflected: Chains | None
    diffracted: DiffractedChains | None  # chains with diffractions; None if diffraction is not followed
    # the edges that the chains with diffractions name, for a scene whose objects have not moved. None: they are found
    # again.
    edges: Edges | None = None


TRIALS = 200
"""Number of positions at which a chain is tried, from every element. The number is large, since some chains carry power
only within centimetres of one place in the region, or only to one column of the array."""


LATEST = 8  # Number of searches whose chains this process keeps; those of a city take a few megabytes

_latest: dict[tuple, Found] = {}
"""What the latest searches found, by all that a search depends on, so that nothing is searched twice."""


class ChainSolver:
    """The chains in a scene, of reflections first and then with diffractions, and the paths that they give."""

    def __init__(
        self,
        ray_scene: RayScene,
        region: Float[np.ndarray, "2 3"],
        seed: int,
        report: Callable[[str], None],
        found: Found | None,
    ):
        self._ray_scene, self._surfaces = ray_scene, Surfaces(ray_scene)
        propagation = ray_scene.propagation
        diffracts = propagation.diffraction and propagation.max_depth > 0
        search = scene_digest(ray_scene.description), propagation, region.tobytes(), seed
        found = _latest.get(search) if found is None else found
        self._edge_scene = (
            EdgeScene(ray_scene, self._surfaces, None if found is None else found.edges) if diffracts else None
        )
        if found is not None and found.reflected is not None:
            self._reflected, self._diffracted = found.reflected, found.diffracted
        else:
            self._reflected, self._diffracted = self._search(region, seed, report)
        self.found = Found(self._reflected, self._diffracted, self._edge_scene.edges if self._edge_scene else None)
        if found is None:
            _latest[search] = self.found
            for older in list(reversed(_latest))[LATEST:]:
                _latest.pop(older, None)
        self.chains = len(self._reflected) + (len(self._diffracted) if self._diffracted is not None else 0)

    def _search(
        self, region: Float[np.ndarray, "2 3"], seed: int, report: Callable[[str], None]
    ) -> tuple[Chains, DiffractedChains | None]:
        """The chains that carry power from the gateway to anywhere in a region."""
        ray_scene = self._ray_scene
        scene, generator = ray_scene.description, np.random.default_rng(seed)
        elements = gateway_antennas(scene)
        trials = transmitter_antennas(scene, free_positions(scene, region, TRIALS, generator))
        ends = (elements, region), (trials, bounding_box(elements.positions))
        short, rays = most_reflections(ray_scene.propagation), []
        if self._edge_scene is not None:
            rays = [PassingRays(ray_scene.planes, self._edge_scene.edges, short) for _ in ends]
        watching = [each.see for each in rays] or [lambda flights: None] * 2
        forth, back = (
            explore(ray_scene, self._surfaces, antennas.positions, box, short, generator, watch)
            for (antennas, box), watch in zip(ends, watching, strict=True)
        )
        chains = find_chains(ray_scene, elements, trials, forth.arriving, back.arriving, self._surfaces, report)
        if self._edge_scene is None:
            return chains, None
        return chains, find_diffracted_chains(
            self._edge_scene, elements, trials, (forth, back), (rays[0], rays[1]), chains, report
        )

    def paths(self, sources: Antennas, targets: Antennas) -> Iterator[tuple[Int[np.ndarray, " paths"], Paths]]:
        """The paths between all sources and targets, in batches: the chain of each path, and the paths."""
        for solution in self._solved(sources, targets, [self._surfaces]):
            yield solution.arriving()

    def multipath(self, sources: Antennas, targets: Antennas) -> Iterator[Multipath]:
        """The paths of ``paths``, with their vertices but without those of transmissions."""
        for solution in self._solved(sources, targets, [self._surfaces]):
            yield solution.multipath()

    def paths_in(self, others: Sequence[RayScene], sources: Antennas, targets: Antennas) -> Iterator[tuple[int, Paths]]:
        """The same paths in scenes of other materials, in batches: index of the scene, and the paths in it."""
        for solution in self._solved(sources, targets, [Surfaces(each) for each in others]):
            yield from enumerate(solution.paths)

    def band_responses(
        self, sources: Antennas, targets: Antennas, frequencies: Float[np.ndarray, " subcarriers"]
    ) -> Complex[np.ndarray, "targets sources subcarriers"]:
        """The sum of all paths from each source to each target, at each subcarrier."""
        # No leg of a path is longer than the scene, and a path has one leg more than interactions.
        antennas = np.vstack([sources.positions, targets.positions, self._ray_scene.description.bounds])
        diagonal = float(np.linalg.norm(np.ptp(antennas, axis=0)))
        longest = diagonal * (self._ray_scene.propagation.max_depth + 1)
        sum_over_paths = BandSum(frequencies, len(targets), len(sources), longest)
        surfaces = [Surfaces(self._ray_scene, frequency) for frequency in sum_over_paths.solved]
        for solution in self._solved(sources, targets, surfaces):
            sum_over_paths.add(solution)
        return sum_over_paths.total

    def _solved(self, sources: Antennas, targets: Antennas, surfaces: Sequence[Surfaces]) -> Iterator[Solution]:
        """The paths of all chains, of reflections first, with each of some sets of materials."""
        yield from reflected(self._ray_scene, self._reflected, sources, targets, surfaces)
        if self._edge_scene is not None and self._diffracted is not None:
            for solution in diffracted(self._edge_scene, self._diffracted, sources, targets, surfaces):
                yield solution._replace(chain=len(self._reflected) + solution.chain)


SHARES = 0.03, 0.08
"""Bandwidths, as shares of the carrier, up to which amplitudes are interpolated between two and between three
frequencies. In wider bands there are five."""


MORE, BEYOND = 14, 0.15
"""Number of frequencies of the sums beyond one for each turn of the longest path, and how far they lie beyond the band,
as a share of it. Both make the error of the interpolation negligible."""


def solved_frequencies(frequencies: Float[np.ndarray, " subcarriers"]) -> Float[np.ndarray, " n"]:
    """The frequencies at which paths are solved for a band: Chebyshev's points, Hz."""
    first, last = frequencies[0], frequencies[-1]
    share = (last - first) / ((first + last) / 2)
    return chebyshev_points(first, last, (2, 3, 5)[int(np.searchsorted(SHARES, share))])


def _between(
    few: Float[np.ndarray, " m"], frequencies: Float[np.ndarray, " subcarriers"], longest: float
) -> Complex[np.ndarray, "m subcarriers"]:
    """The factors by which sums of paths at few frequencies best give those at the subcarriers, at all delays."""
    delays = np.linspace(0, longest, 8 * len(few))[:, None]
    known, wanted = (np.exp(-2j * np.pi * (each - few[0]) * delays) for each in (few, frequencies))
    return np.linalg.lstsq(known, wanted, rcond=1e-10)[0]


class BandSum:
    """Adds up paths to responses at all subcarriers, from a few frequencies of the band.

    A path of length L contributes a(f) e^{−j2πfL/c}. The exponential turns many times over a band, whereas the
    amplitude a with its reflections and diffractions hardly changes. So each path is solved at a few frequencies f_n,
    and between them f a is interpolated by polynomials (Lagrange), f a(f) = Σ_n ℓ_n(f) f_n a(f_n).

    The sums are made at fewer frequencies if these tell those of all subcarriers, which depends on the longest path.
    """

    def __init__(self, frequencies: Float[np.ndarray, " subcarriers"], targets: int, sources: int, longest: float):
        self.solved = solved_frequencies(frequencies)
        delay, width = longest / SPEED_OF_LIGHT, float(frequencies[-1] - frequencies[0])
        count = math.ceil(width * delay) + MORE
        self._spread: Complex[np.ndarray, "m subcarriers"] | None = None
        if count < len(frequencies):
            few = np.linspace(frequencies[0] - BEYOND * width, frequencies[-1] + BEYOND * width, count)
            self._spread, frequencies = _between(few, frequencies, delay), few
        self._sums = np.zeros((targets, sources, len(frequencies)), np.complex128)
        self._first, self._step = float(frequencies[0]), float(frequencies[1] - frequencies[0])
        # The factor λ/4π of the amplitudes needs no interpolation.
        self._weights = np.stack(
            [_lagrange(self.solved, n, frequencies) * each / frequencies for n, each in enumerate(self.solved)], axis=1
        )

    @property
    def total(self) -> Complex[np.ndarray, "targets sources subcarriers"]:
        """The sum of the paths so far."""
        return self._sums if self._spread is None else self._sums @ self._spread

    def add(self, solution: Solution) -> None:
        """Add paths that have been solved at the frequencies ``solved``."""
        targets = solution.targets
        if not len(targets):
            return
        amplitudes = tuple(solution.amplitudes)
        delays = solution.travelled.numpy() / SPEED_OF_LIGHT
        begins = np.flatnonzero(np.diff(targets, prepend=-1))  # the paths are ordered by target
        bounds = np.append(begins, len(targets))
        with ONE_KERNEL:
            _add(  # type: ignore[call-arg]
                *(bounds, targets, solution.sources, delays, amplitudes, self._weights),
                *(self._first, self._step, self._sums),
            )


def _lagrange(points: Float[np.ndarray, " n"], which: int, at: Float[np.ndarray, " m"]) -> Float[np.ndarray, " m"]:
    """The polynomial that is 1 at one of the points and 0 at the others."""
    others = np.delete(points, which)
    return np.prod((at[:, None] - others) / (points[which] - others), axis=1)


@compiled(inline="always")
def _phasor(turns):
    """e^{−j2πt}; whole turns are taken out, or the phase would lose digits."""
    angle = -2 * np.pi * (turns % 1)
    return complex(np.cos(angle), np.sin(angle))


@compiled(parallel=True)
def _add(bounds, targets, sources, delays, solved, weights, first, step, total):
    """Add paths to ``total`` [targets, sources, subcarriers]; ``bounds`` separate the paths of different targets."""
    for block in numba.prange(len(bounds) - 1):
        for path in range(bounds[block], bounds[block + 1]):
            if solved[0][path] == 0:  # something blocks it
                continue
            row = total[targets[path], sources[path]]
            phase, turned = _phasor(first * delays[path]), _phasor(step * delays[path])
            for subcarrier in range(len(row)):
                amplitude = 0j
                for n in range(len(solved)):
                    amplitude += weights[subcarrier, n] * solved[n][path]
                row[subcarrier] += amplitude * phase
                phase *= turned
