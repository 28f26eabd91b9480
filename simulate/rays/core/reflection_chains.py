"""Chains of reflections: found once by shooting rays, then solved exactly for every element and transmitter.

A chain is the sequence of planes that reflect a wave. The gateway never moves, and only some hundreds of chains in a
room carry power. Rays that are shot anew for every transmitter find the same chains again and again, and miss some each
time. Here rays are shot once, from the elements and from positions in the region, and the chains that they find are
collected. Then the image method solves each chain for every element and transmitter.

Every path counts once, since two triangles of one wall lie in the same plane. Objects that a path passes through are
not part of its chain. They are found when the path is solved.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from jaxtyping import Float, Int

from simulate.rays.core.electric_field import Ways
from simulate.rays.core.image_method import Combination, Mirrors, mirrored, on_device
from simulate.rays.core.propagation import Propagation
from simulate.rays.core.ray_scene import RayScene
from simulate.rays.core.ray_tracer import dr, mi
from simulate.rays.core.shooting import reversed_sequences
from simulate.rays.core.sionna_scene import Antennas
from simulate.rays.core.solution import Solution, Tried, largest_shares, solutions
from simulate.rays.core.surfaces import Surfaces

Chains = Int[np.ndarray, "chains depth"]
"""Planes that reflect the wave, from source to target; −1 after the last one."""

NEGLIGIBLE = 1e-6
"""A chain is dropped if its share of the power is smaller than this at every trial and every element."""


class Images:
    """The images of sources by chains with equal numbers of reflections."""

    def __init__(
        self, mirrors: Mirrors, chains: Int[np.ndarray, "chains reflections"], sources: Float[np.ndarray, "sources 3"]
    ):
        self._mirrors, self._chains = mirrors, len(chains)
        self._planes = [mi.UInt(plane) for plane in chains.T]
        self._images = [on_device(each) for each in mirrored(mirrors.planes, chains, sources)]

    def ends_of(self, targets: Float[np.ndarray, "targets 3"]) -> mi.Point3d:
        """The targets."""
        return on_device(targets)

    def possible(self, ends: mi.Point3d, combination: Combination) -> mi.Bool:
        """Whether the reflections of each target, chain and source all lie on a surface."""
        return self._follow(ends, combination)[0]

    def ways(self, ends: mi.Point3d, combination: Combination) -> Ways:
        """The ways of possible combinations."""
        return self._follow(ends, combination)[1]

    def _follow(self, ends: mi.Point3d, combination: Combination) -> tuple[mi.Bool, Ways]:
        """The ways, and whether they are possible."""
        target, chain, source = combination
        image = source * dr.opaque(mi.UInt, self._chains) + chain
        point = dr.gather(mi.Point3d, ends, target)
        length = dr.norm(point - dr.gather(mi.Point3d, self._images[-1], image))
        found, places, faces = mi.Bool(True), [], []
        for k in range(len(self._planes) - 1, -1, -1):
            plane = dr.gather(mi.UInt, self._planes[k], chain)
            found, face, point = self._mirrors.reflection(
                plane, dr.gather(mi.Point3d, self._images[k + 1], image), point, 0.0, found
            )
            places.insert(0, mi.Point3f(point))
            faces.insert(0, face)
        return found & (length > 0), Ways(source, target, places, faces, length, 1 / length, {})


def line_of_sight(propagation: Propagation) -> Chains:
    """The chain without reflections if the line of sight is followed, otherwise no chain."""
    return np.full((int(propagation.los), propagation.max_depth), -1)


def find_chains(
    ray_scene: RayScene,
    elements: Antennas,
    trials: Antennas,
    forth: Chains,
    back: Chains,
    surfaces: Surfaces,
    report: Callable[[str], None],
) -> Chains:
    """The chains that carry power from the gateway to some position, of those that rays from both ends found."""
    propagation = ray_scene.propagation
    if not propagation.specular or not propagation.max_depth:
        return line_of_sight(propagation)
    chains = np.unique(np.concatenate([forth, reversed_sequences(back)]), axis=0)
    chains = chains if propagation.los else chains[1:]
    solved = reflected(ray_scene, chains, elements, trials, [surfaces])
    kept = largest_shares(solved, len(chains), np.zeros((len(trials), len(elements)))) >= NEGLIGIBLE
    kept[: int(propagation.los)] = True
    report(f"{kept.sum()} chains of reflections, of {len(chains):,} tried")
    return chains[kept]


def reflected(
    ray_scene: RayScene,
    chains: Chains,
    sources: Antennas,
    targets: Antennas,
    surfaces: Sequence[Surfaces],
    tried: Tried | None = None,
) -> Iterator[Solution]:
    """Solve every chain exactly between every source and target.

    The paths are ordered by the number of reflections, then by target, chain and source.
    """
    counts, object_of_face = (chains >= 0).sum(axis=1), ray_scene.object_of_face
    for count in np.unique(counts):
        number = np.flatnonzero(counts == count)
        images = Images(ray_scene.mirrors, chains[number, :count], sources.positions)
        yield from solutions(images, number, sources, targets, surfaces, object_of_face, tried)
