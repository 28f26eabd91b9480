"""The points where a chain with one or two diffractions touches its surfaces and its edges.

The antenna at the end of an arm, mirrored at the arm's planes in turn, has the image I. Seen from the edge, the wave
comes straight from I. Take the edge as the axis of cylindrical coordinates, with the source image at (z₁, ρ₁) and the
target image at (z₂, ρ₂). Then the angles to the edge are equal (Keller's cone) at

    z = z₁ + (z₂ − z₁) ρ₁ / (ρ₁ + ρ₂).

With two diffractions, Newton's method finds the two points for which the whole way is shortest.

A chain is a path if the waves of both antennas are in the open space around their edges, and every reflection is on a
surface. Whether something blocks the path is tested later. A point of diffraction may lie beyond an end of the edge if
the way through the end is not much longer (``end_weight``). The path then passes through the
end.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from simulate.rays.core.electric_field import Ways
from simulate.rays.core.image_method import Combination, Mirrors, on_device
from simulate.rays.core.ray_tracer import dr, mi
from simulate.rays.diffraction.arms import Ends
from simulate.rays.diffraction.diffraction_chains import NO_LINK, THROUGH_SPACE, DiffractedChains, lift_of
from simulate.rays.diffraction.diffraction_points import (
    CORNER,
    REACH,
    TOO_NEAR,
    Pair,
    Wedge,
    detours,
    point_of_diffraction,
    two_points,
)
from simulate.rays.diffraction.distance_parameters import Around, around_one, around_two
from simulate.rays.diffraction.edge_fields import Diffraction
from simulate.rays.diffraction.edges import Edges


class _Lanes(NamedTuple):
    """What is gathered for each combination."""

    near: mi.UInt  # numbers of the arms
    far: mi.UInt
    begin: mi.UInt  # numbers of the images
    end: mi.UInt
    first: Wedge
    second: Wedge


class Combinations:
    """Every combination of a target, a chain and a source, for chains of one shape."""

    def __init__(
        self,
        mirrors: Mirrors,
        edges: Edges,
        wedges: Wedge,
        chains: DiffractedChains,
        sources: Float[np.ndarray, "sources 3"],
        wavelength: float,
    ):
        self._mirrors, self._wedges, self._chains = mirrors, wedges, chains
        self._twice = bool(chains.link[0] != NO_LINK)
        self._near = Ends(mirrors, wedges, chains.near, sources)
        self._wavelength = dr.opaque(mi.Float64, wavelength)
        of = chains.edges
        self._sheets = bool(edges.sheets[of].any())
        self._pairs, self._of = [mi.UInt(each) for each in chains.pairs.T], [mi.UInt(each) for each in of.T]
        faces = chains.links.faces[chains.link] if self._twice else np.full((len(chains), 2), THROUGH_SPACE)
        self._along_face = mi.Bool(faces[:, 0] != THROUGH_SPACE)
        self._faces = [mi.Float64(each.astype(float)) for each in faces.T]
        self._lifts = [on_device(lift_of(edges.subset(of[:, end]), faces[:, end])) for end in (0, 1)]

    def ends_of(self, targets: Float[np.ndarray, "targets 3"]) -> Ends:
        """The images of targets by the far arms."""
        return Ends(self._mirrors, self._wedges, self._chains.far, targets)

    def possible(self, far: Ends, combination: Combination) -> mi.Bool:
        """Whether the vertices of each target, chain and source are all in valid places."""
        own = self._lanes(far, combination)
        found = self._near.open(own.begin) & far.open(own.end)
        s, t, found = self._points(far, combination, own, found)
        found, _, _ = far.follow(own.end, own.far, own.second.nearest(t), found)
        found, _, _ = self._near.follow(own.begin, own.near, own.first.nearest(s), found)
        return found

    def ways(self, far: Ends, combination: Combination) -> Ways:
        """The ways of some of the possible combinations."""
        own, yes = self._lanes(far, combination), mi.Bool(True)
        s, t, _ = self._points(far, combination, own, yes)
        p, q = own.first.nearest(s), own.second.nearest(t)
        _, before, faces_before = self._near.follow(own.begin, own.near, p, yes)
        _, after, faces_after = far.follow(own.end, own.far, q, yes)
        around = self._around(far, combination, own, (s, t))
        at = [p, q] if self._twice else [p]
        at = [each + dr.gather(mi.Point3d, lift, combination.chain) for each, lift in zip(at, self._lifts)]  # noqa: B905
        edges = [dr.gather(mi.UInt, each, combination.chain) for each in self._of[: len(at)]]
        at_edges = [Diffraction(self._wedges, *each, self._sheets) for each in zip(edges, around.edges, strict=True)]
        faces = [dr.gather(mi.UInt, self._wedges.face, edge) for edge in edges]
        return Ways(
            combination.source,
            combination.target,
            [mi.Point3f(each) for each in (*before, *at, *after[::-1])],
            [*faces_before, *faces, *faces_after[::-1]],
            around.travelled,
            around.spreading,
            dict(enumerate(at_edges, start=len(before))),
        )

    def _lanes(self, far: Ends, combination: Combination) -> _Lanes:
        near_arm, far_arm = (dr.gather(mi.UInt, each, combination.chain) for each in self._pairs)
        first, second = (self._wedges.gathered(dr.gather(mi.UInt, each, combination.chain)) for each in self._of)
        begin, end = self._near.number(combination.source, near_arm), far.number(combination.target, far_arm)
        return _Lanes(near_arm, far_arm, begin, end, first, second if self._twice else first)

    def _points(
        self, far: Ends, combination: Combination, own: _Lanes, active: mi.Bool
    ) -> tuple[mi.Float64, mi.Float64, mi.Bool]:
        """The points along the edges, and whether there are any that are not too far beyond the ends of the edges."""
        begin, end = self._near.about(own.begin), far.about(own.end)
        reach = REACH * self._wavelength
        if not self._twice:
            s = point_of_diffraction(*begin, *end)
            return s, s, active & (_beyond(begin, end, s, own.first.length) <= reach)
        first, second = own.first, own.second
        pair = Pair.of(first, second)
        s, t, found = two_points(pair, second.length, *begin, *end, active)
        found &= _beyond(begin, pair.of_second(t), s, first.length) <= reach
        found &= _beyond(pair.of_first(s), end, t, second.length) <= reach
        _, away = pair.of_first(dr.clip(s, 0, first.length))
        _, other_away = pair.of_second(dr.clip(t, 0, second.length))
        found &= dr.minimum(away, other_away) >= CORNER * self._wavelength
        behind, before = first.angle_about(second.at(t)), second.angle_about(first.at(s))
        in_space = (behind > TOO_NEAR) & (behind < first.exterior - TOO_NEAR)
        in_space &= (before > TOO_NEAR) & (before < second.exterior - TOO_NEAR)
        return s, t, found & (in_space | dr.gather(mi.Bool, self._along_face, combination.chain))

    def _around(
        self, far: Ends, combination: Combination, own: _Lanes, points: tuple[mi.Float64, mi.Float64]
    ) -> Around:
        angles = self._near.angle(own.begin), far.angle(own.end)
        if not self._twice:
            return around_one(own.first, self._near.about(own.begin), far.about(own.end), *angles)
        images = self._near.place(own.begin), far.place(own.end)
        face, other = (dr.gather(mi.Float64, each, combination.chain) for each in self._faces)
        along = dr.gather(mi.Bool, self._along_face, combination.chain)
        return around_two(own.first, own.second, points, images, (face, other), along, *angles, self._wavelength)


def _beyond(
    begin: tuple[mi.Float64, mi.Float64], end: tuple[mi.Float64, mi.Float64], z: mi.Float64, length: mi.Float64
) -> mi.Float64:
    """How much longer the way through the nearer end of an edge is than that by a point beyond it; negative on it."""
    by_start, by_end = detours(*begin, *end, z, length)
    return -dr.minimum(by_start, by_end)
