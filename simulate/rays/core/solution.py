"""Batches of paths that the ray tracer has solved, in its own arrays."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple, Protocol

import numpy as np
from jaxtyping import Complex, Float, Int

from simulate.rays.core.electric_field import Amplitude, Ways, in_empty_space, solved
from simulate.rays.core.image_method import Combination, batches, pieces
from simulate.rays.core.multipath import Interaction, Multipath, Paths
from simulate.rays.core.ray_tracer import dr, mi
from simulate.rays.core.sionna_scene import Antennas
from simulate.rays.core.surfaces import Surfaces

Course = tuple[Float[np.ndarray, "paths n+2 3"], Int[np.ndarray, "paths n"], Int[np.ndarray, "paths n"]]
"""Where paths run: ``vertices``, ``objects`` and ``kinds`` of ``Multipath``."""


class Solution(NamedTuple):
    """A batch of paths. The paths of one target do not depend on the other targets."""

    chain: Int[np.ndarray, " paths"]  # index of each path's chain
    targets: Int[np.ndarray, " paths"]  # index of each path's target
    sources: Int[np.ndarray, " paths"]  # index of each path's source
    travelled: mi.Float64  # length of each path, metres
    # amplitude a of each path with each of several sets of materials, or at several frequencies, 0 if the path is
    # blocked. Its contribution to the response is a e^{−j2πfτ}.
    parts: Sequence[Amplitude]
    wavelengths: Sequence[float]  # that of each of these sets, metres
    course: Callable[[], Course]  # computes where the paths run

    @property
    def amplitudes(self) -> list[Complex[np.ndarray, " paths"]]:
        """The amplitudes, with each set of materials."""
        dr.eval(self.parts, self.travelled)
        return [_complex(*each) for each in self.parts]

    @property
    def paths(self) -> list[Paths]:
        """The contributions of the paths, with each set of materials."""
        responses = []
        for (real, imaginary), wavelength in zip(self.parts, self.wavelengths, strict=True):
            turns = self.travelled / dr.opaque(mi.Float64, wavelength)
            # Whole turns are taken out, or the phase would lose digits.
            sine, cosine = dr.sincos(-2 * dr.pi * (turns - dr.floor(turns)))
            responses.append((real * cosine - imaginary * sine, real * sine + imaginary * cosine))
        dr.eval(responses)
        return [Paths(self.targets, self.sources, _complex(*each)) for each in responses]

    def arriving(self) -> tuple[Int[np.ndarray, " arriving"], Paths]:
        """The chains and the paths, with the first set of materials, without blocked ones."""
        paths = self.paths[0]
        kept = np.flatnonzero(paths.responses)
        return self.chain[kept], Paths(*(each[kept] for each in paths))

    def multipath(self) -> Multipath:
        """The paths of ``arriving`` with their vertices."""
        paths = self.paths[0]
        kept = np.flatnonzero(paths.responses)
        return Multipath(*(each[kept] for each in (*paths, *self.course())))


def _complex(real: mi.Float64, imaginary: mi.Float64) -> Complex[np.ndarray, " paths"]:
    found = np.empty(dr.width(real), np.complex128)
    found.real, found.imag = real.numpy(), imaginary.numpy()
    return found


class Geometry(Protocol):
    """Where the paths of some chains with equal interactions run."""

    def ends_of(self, targets: Float[np.ndarray, "targets 3"]) -> Any:
        """What is known of some targets."""

    def possible(self, ends: Any, combination: Combination) -> mi.Bool:
        """Whether the vertices of each target, chain and source are all in valid places."""

    def ways(self, ends: Any, combination: Combination) -> Ways:
        """The ways of possible combinations."""


class Tried(NamedTuple):
    """How chains are tried: each target with one source, and only paths that may matter there."""

    sources: Int[np.ndarray, " targets"]  # index of each target's source
    # No ray is traced for a path whose amplitude in empty space is less than this.
    least: Float[np.ndarray, " targets"]


def solutions(
    geometry: Geometry,
    chains: Int[np.ndarray, " chains"],
    sources: Antennas,
    targets: Antennas,
    surfaces: Sequence[Surfaces],
    object_of_face: Int[np.ndarray, " faces"],
    tried: Tried | None = None,
) -> Iterator[Solution]:
    """Solve numbered chains exactly between every source and target, in the order of target, chain and source."""
    wavelengths = [each.wavelength for each in surfaces]
    size = len(chains), len(sources) if tried is None else 1
    for start, stop in batches(len(targets), *size):
        some = targets.subset(slice(start, stop))
        ends = geometry.ends_of(some.positions)
        every = dr.arange(mi.UInt, len(some) * size[0] * size[1])
        own = None if tried is None else mi.UInt(tried.sources[start:stop])
        lanes = mi.UInt(dr.compress(geometry.possible(ends, Combination.of(every, *size, own))))
        if tried is not None and dr.width(lanes):
            combination = Combination.of(lanes, *size, own)
            strength = in_empty_space(surfaces[0], sources, some, geometry.ways(ends, combination))
            least = dr.gather(mi.Float, mi.Float(tried.least[start:stop]), combination.target)
            lanes = dr.gather(mi.UInt, lanes, mi.UInt(dr.compress(strength >= least)))
        for lane in pieces(lanes):
            combination = Combination.of(lane, *size, own)
            ways = geometry.ways(ends, combination)
            amplitudes = solved(surfaces, sources, some, ways)
            target, chain, source = (each.numpy().astype(np.int64) for each in combination)
            course = partial(_course, ways, sources.positions[source], some.positions[target], object_of_face)
            yield Solution(chains[chain], start + target, source, ways.travelled, amplitudes, wavelengths, course)


def _course(
    ways: Ways,
    starts: Float[np.ndarray, "paths 3"],
    ends: Float[np.ndarray, "paths 3"],
    object_of_face: Int[np.ndarray, " faces"],
) -> Course:
    """Where paths run."""
    objects = np.zeros((len(starts), len(ways.faces)), np.int64)
    for number, face in enumerate(ways.faces):
        objects[:, number] = object_of_face[face.numpy()]
    kinds = np.full(objects.shape, int(Interaction.REFLECTION))
    kinds[:, list(ways.at_edges)] = Interaction.DIFFRACTION
    return np.stack([starts, *[vertex.numpy().T for vertex in ways.vertices], ends], axis=1), objects, kinds


def largest_shares(
    solutions: Iterable[Solution], chains: int, others: Float[np.ndarray, "targets sources"]
) -> Float[np.ndarray, " chains"]:
    """The largest share of the power between two antennas that each chain carries, beside the power of others."""
    whole, found = others.copy(), []
    for solution in solutions:
        chain, paths = solution.arriving()
        power = np.abs(paths.responses) ** 2
        np.add.at(whole, (paths.targets, paths.sources), power)
        found.append((chain, paths, power))
    result = np.zeros(chains)
    for chain, paths, power in found:
        np.maximum.at(result, chain, power / np.maximum(whole[paths.targets, paths.sources], 1e-30))
    return result
