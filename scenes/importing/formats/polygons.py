"""Cut polygons into triangles that cover the same area: windows and doorways in the outline of a wall stay open.

A polygon becomes a fan of triangles at its first corner if all of them turn the same way. Any other is projected along
its normal and cut by ear clipping (mapbox_earcut). The area of the triangles is then compared with that of the polygon,
so that a polygon whose edges cross is noticed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import hypot
from pathlib import Path

import mapbox_earcut
import numpy as np
from jaxtyping import Float, Integer
from trimesh import Trimesh

from scenes.files.errors import InputError
from scenes.importing.formats.mesh_part import (
    ImportedFile,
    ImportedPart,
    require_corners,
    require_few,
    require_ordinary,
)

MOST_CORNERS = 10_000
"""Most corners of one polygon. The time of ear clipping may grow with the square of their number."""

FLAT = 1e-12  # Largest area, relative to the square of a polygon's size, that is taken for zero

SAME_AREA = 1e-4
"""Largest relative difference between the area of a polygon and that of its triangles; crossing edges exceed it."""

STRAIGHT = 1e-10  # Height of a corner above the line of its neighbours, relative to their distance, that is rounding

BENT = 0.1
"""A polygon counts as bent if its corners are farther from a plane than this times the root of its area.

Two triangles with a common edge that are folded by 30° are about so far from a plane.
"""


@dataclass(frozen=True)
class Cut:
    triangles: Integer[np.ndarray, "T 3"]  # vertex numbers, turning the same way as their polygons, [T, 3]
    polygons: Integer[np.ndarray, " T"]  # number of each triangle's polygon, [T]
    crossing: list[int]  # numbers of the polygons that cross themselves. They have no triangles.
    bent: list[int]  # numbers of the polygons whose corners are far from a plane
    short: list[int]  # numbers of those with fewer than three corners, which are no polygons

    def remarks(self) -> list[str]:
        """Return a sentence for each kind of polygon that could not be cut, or not in only one way."""
        faults = {
            "with fewer than three corners were left out": self.short,
            "were left out because their edges cross each other": self.crossing,
            "were cut as if flat, although their corners are far from a plane": self.bent,
        }
        return [
            f"faces {fault}: {len(numbers)} (the first is face {min(numbers) + 1} of the file)"
            for fault, numbers in faults.items()
            if numbers
        ]


def cut_polygons(
    vertices: Float[np.ndarray, "V 3"],
    corners: Integer[np.ndarray, " C"],
    sizes: Integer[np.ndarray, " P"],
    label: str,
) -> Cut:
    require_few(int(np.sum(sizes.clip(2) - 2)), label)
    if len(sizes) and sizes.max() > MOST_CORNERS:
        raise InputError(f"{label}: expected polygons of at most {MOST_CORNERS} corners, found one of {sizes.max()}")
    require_ordinary(vertices, label)
    starts = np.cumsum(sizes) - sizes
    triangles, owners = [np.zeros((0, 3), int)], [np.zeros(0, int)]
    crossing: list[int] = []
    bent: list[int] = []
    for size in np.unique(sizes[sizes > 2]):
        these = np.flatnonzero(sizes == size)
        faces = corners[starts[these, None] + np.arange(size)]
        require_corners(faces, len(vertices), label)
        if size == 3:
            triangles.append(faces)
            owners.append(these)
            continue
        if size == 4:
            faces = _from_lowest_corner(faces, vertices)
        shape = _Shape.of(vertices[faces])
        bent += these[shape.bent].tolist()
        fan = np.stack([np.zeros(size - 2, int), np.arange(1, size - 1), np.arange(2, size)], axis=1)
        triangles.append(faces[shape.fan][:, fan].reshape(-1, 3))
        owners.append(np.repeat(these[shape.fan], size - 2))
        for index in np.flatnonzero(~shape.fan):
            ears = _ears(shape.points[index], shape.normals[index])
            if ears is None:
                crossing.append(int(these[index]))
            else:
                triangles.append(faces[index][ears])
                owners.append(np.full(len(ears), these[index]))
    polygons = np.concatenate(owners)
    order = np.argsort(polygons, kind="stable")
    bent = sorted(set(bent) - set(crossing))
    return Cut(np.concatenate(triangles)[order], polygons[order], crossing, bent, np.flatnonzero(sizes < 3).tolist())


def one_part(
    path: Path,
    vertices: Float[np.ndarray, "V 3"],
    corners: Integer[np.ndarray, " C"],
    sizes: Integer[np.ndarray, " P"],
    left_out: Sequence[str] = (),
) -> ImportedFile:
    """The content of a file whose polygons are one part, which is named after the file."""
    cut = cut_polygons(vertices, corners, sizes, str(path))
    part = ImportedPart(path.stem, Trimesh(vertices, cut.triangles, process=False))
    return ImportedFile(path, [part], "z", (*left_out, *cut.remarks()))


def _from_lowest_corner(faces: Integer[np.ndarray, "P 4"], vertices: Float[np.ndarray, "V 3"]) -> np.ndarray:
    """Quadrilaterals from their lowest corner on, so that one drawn from both sides gets the same triangles twice."""
    places, rows, lowest = vertices[faces], np.arange(len(faces)), np.zeros(len(faces), int)
    for corner in range(1, 4):
        one, other = places[rows, corner], places[rows, lowest]
        differ = one != other
        first = differ.argmax(axis=1)
        lowest = np.where(differ.any(axis=1) & (one[rows, first] < other[rows, first]), corner, lowest)
    return np.take_along_axis(faces, (lowest[:, None] + np.arange(4)) % 4, axis=1)


@dataclass(frozen=True)
class _Shape:
    """Polygons of n corners each: corners relative to the first one, normals times area, and how they may be cut."""

    points: Float[np.ndarray, "P n 3"]
    normals: Float[np.ndarray, "P 3"]
    fan: np.ndarray
    bent: np.ndarray

    @staticmethod
    def of(corners: Float[np.ndarray, "P n 3"]) -> _Shape:
        points = corners - corners[:, :1]
        fans = np.cross(points[:, 1:-1], points[:, 2:]) / 2
        normals = fans.sum(axis=1)  # Newell's normal; its length is the area of the projection along it
        area = np.linalg.norm(normals, axis=1)
        size = np.abs(points).max(axis=(1, 2))
        flat = area <= FLAT * size**2
        along = normals / np.where(flat, 1, area)[:, None]
        turning = np.einsum("pti,pi->pt", fans, along)
        covered = np.linalg.norm(fans, axis=2).sum(axis=1)
        # All corners on one line: the fan has no area, and the import says so. Not a butterfly, whose halves cancel.
        nothing = flat & (covered <= SAME_AREA * size**2)
        fan = np.where(flat, nothing, (turning > FLAT * area[:, None]).all(axis=1))
        heights = np.einsum("pni,pi->pn", points, along)
        bent = ~flat & (np.ptp(heights, axis=1) / 2 > BENT * np.sqrt(area))
        return _Shape(points, normals, fan, bent)


def _ears(points: Float[np.ndarray, "n 3"], normal: Float[np.ndarray, " 3"]) -> Integer[np.ndarray, "t 3"] | None:
    """Cut one polygon by ear clipping. Return corner numbers, or None if the triangles overlap or leave gaps."""
    area = float(np.linalg.norm(normal))
    if area == 0:
        return None
    first = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    first /= np.linalg.norm(first)
    plane = points @ np.stack([first, np.cross(normal / area, first)], axis=1)
    ears = cut_rings(plane, [len(points)], SAME_AREA * area)
    if ears is None:
        return None
    one, two = plane[ears[:, 1]] - plane[ears[:, 0]], plane[ears[:, 2]] - plane[ears[:, 0]]
    largest = plane[ears[np.argmax(np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]))]]
    return ears if _turns(plane, largest.mean(axis=0)) == 1 else None


def cut_rings(
    plane: Float[np.ndarray, "n 2"], ends: Sequence[int], missing: float
) -> Integer[np.ndarray, "t 3"] | None:
    """Cut a polygon with holes, rings that end at these numbers of corners, into triangles that turn to the left.

    Return corner numbers, or None if the area of the triangles differs by more from that of the polygon.
    """
    rings = np.split(np.arange(len(plane)), ends[:-1])
    area = sum(turned_area(plane[ring]) for ring in rings)
    bent = [_bent(plane, ring) for ring in rings]
    used = np.concatenate(bent)
    limits = np.cumsum([len(ring) for ring in bent if len(ring)]).astype(np.uint32)
    ears = mapbox_earcut.triangulate_float64(np.ascontiguousarray(plane[used]), limits)
    ears = used[ears.reshape(-1, 3).astype(int)]
    one, two = plane[ears[:, 1]] - plane[ears[:, 0]], plane[ears[:, 2]] - plane[ears[:, 0]]
    turning = (one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]) / 2
    if abs(np.abs(turning).sum() - area) > missing:
        return None
    ears[turning < 0] = ears[turning < 0][:, ::-1]
    return _with_all_corners(ears, rings)


def _bent(plane: Float[np.ndarray, "n 2"], ring: Integer[np.ndarray, " n"]) -> Integer[np.ndarray, " m"]:
    """Leave out the corners on straight edges, which would have triangles without area, and repeated ones but the last.

    One after another, since two corners at one place are each on a straight edge while the other is there.
    """
    places = plane[ring]
    tip = int(((places - places.mean(axis=0)) ** 2).sum(axis=1).argmax())
    corners = np.roll(places, -tip, axis=0).tolist()
    kept, (x, y) = [0], corners[0]
    for number, ((here_x, here_y), (next_x, next_y)) in enumerate(pairwise([*corners[1:], corners[0]]), 1):
        before, after = (here_x - x, here_y - y), (next_x - here_x, next_y - here_y)
        turning = abs(before[0] * after[1] - before[1] * after[0])
        if turning > STRAIGHT * (hypot(*before) + hypot(*after)) ** 2:
            kept.append(number)
            x, y = here_x, here_y
    return ring[np.sort((np.array(kept) + tip) % len(ring))] if len(kept) > 2 else ring[:0]


def turned_area(ring: Float[np.ndarray, "n 2"]) -> float:
    """The area of a polygon, positive if it turns to the left."""
    x, y = (ring - ring[0]).T
    return float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum() / 2)


def _turns(polygon: Float[np.ndarray, "n 2"], point: Float[np.ndarray, " 2"]) -> int:
    """Return how often a polygon winds around a point, either way. More than once if it covers itself."""
    x, y = (polygon - point).T
    next_x, next_y = np.roll(x, -1), np.roll(y, -1)
    right = x * next_y - y * next_x > 0
    return abs(int(np.sum((y <= 0) & (next_y > 0) & right)) - int(np.sum((y > 0) & (next_y <= 0) & ~right)))


def _with_all_corners(ears: Integer[np.ndarray, "t 3"], rings: list[np.ndarray]) -> Integer[np.ndarray, "t 3"]:
    """Split triangles at the corners on straight edges, which ear clipping skips: a neighbour may end there."""
    used = set(ears.ravel().tolist())
    if len(used) == sum(map(len, rings)):
        return ears
    triangles = ears.tolist()
    at = {edge: k for k, (a, b, c) in enumerate(triangles) for edge in ((a, b), (b, c), (c, a))}
    for ring in rings:
        kept = [place for place, corner in enumerate(ring) if corner in used]
        for before, after in zip(kept, kept[1:] + kept[:1], strict=True):
            last, until = int(ring[before]), int(ring[after])
            for step in range(1, (after - before) % len(ring)):
                corner = int(ring[(before + step) % len(ring)])
                k = at.pop((last, until), None)
                if k is None:  # the tip of a spike without area
                    continue
                (apex,) = set(triangles[k]) - {last, until}
                triangles[k] = [last, corner, apex]
                triangles.append([corner, until, apex])
                at[corner, until] = at[until, apex] = len(triangles) - 1
                at[last, corner] = k
                last = corner
    return np.array(triangles, int).reshape(-1, 3)
