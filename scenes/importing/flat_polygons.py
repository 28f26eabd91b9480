"""Make planes of the flat regions of a surface: few triangles, exactly in one plane, that meet without a gap.

A corner between regions moves to where their planes intersect, so the border of two regions becomes a straight line
that both have. Corners that no such point fits, as between planes that are almost parallel, leave the region.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float, Int
from skimage.measure import approximate_polygon

from scenes.importing.flat_regions import Regions, Surface
from scenes.importing.formats.polygons import cut_rings, turned_area
from scenes.scene.connected_parts import half_edges

OPEN, KEPT = -2, -1  # What is beyond a border: nothing, or triangles that stay as they are

SAME_AREA = 1e-3  # Largest relative difference between the area of a polygon and that of its triangles

EXACT = 1e-9  # Metres by which a corner may miss its planes

WELL = 0.24  # Least singular value of the normals of planes that meet well: planes at 20°


def holes(surface: Surface, largest: float) -> list[Int[np.ndarray, " n"]]:
    """Return the half-edges around each hole of at most so many square metres. The rim of a flake is none."""
    edges, areas, found = half_edges(surface.faces), surface.area_vectors(), []
    alone = np.zeros(surface.faces.size, bool)
    alone[edges.order[edges.first[edges.faces == 1]]] = True
    for loop in _loops(surface, alone):
        rim = surface.vertices[edges.starts[loop]]
        turning = np.cross(rim - rim[0], np.roll(rim, -1, axis=0) - rim[0]).sum(axis=0) / 2
        if len(loop) > 2 and np.linalg.norm(turning) <= largest and turning @ areas[loop // 3].sum(axis=0) < 0:
            found.append(loop)
    return found


def _loops(surface: Surface, border: Bool[np.ndarray, " H"]) -> list[Int[np.ndarray, " n"]]:
    """Join half-edges at a border into closed loops that pass no corner twice. What does not close is left out."""

    def next_in_face(edges: Int[np.ndarray, " n"]) -> Int[np.ndarray, " n"]:
        return edges - edges % 3 + (edges + 1) % 3

    edges = np.flatnonzero(border)
    after = next_in_face(edges)
    while len(inner := np.flatnonzero(~border[after] & (surface.opposite[after] >= 0))):  # turn about the corner
        after[inner] = next_in_face(surface.opposite[after[inner]])
    following = {int(edge): int(then) for edge, then in zip(edges, after, strict=True) if border[then]}
    start, found = surface.faces.ravel(), []
    while following:
        step: int | None = next(iter(following))
        walk: list[int] = []
        place: dict[int, int] = {}
        while step is not None:
            corner = int(start[step])
            if corner in place:
                loop = walk[place[corner] :]
                found.append(np.array(loop))
                del walk[place[corner] :]
                for passed in loop:
                    del place[int(start[passed])]
            place[corner] = len(walk)
            walk.append(step)
            step = following.pop(step, None)
    return found


def as_planes(
    surface: Surface, regions: Regions, reach: float, tolerance: float, free: Int[np.ndarray, " n"]
) -> tuple[Float[np.ndarray, "V 3"], dict[int, Int[np.ndarray, "t 3"]]]:
    """Return the moved corners, and the triangles of each region that became a plane.

    A corner may move by ``reach``, a free one as far as it likes; a straightened open border is within ``tolerance`` of
    its corners, metres. Faces that cannot be in a plane leave their region: ``regions.labels`` is changed.
    """
    places = _meeting(surface, regions, reach, free)
    return places, _polygons(surface, regions, places, tolerance)


def _meeting(surface: Surface, regions: Regions, reach: float, free: Int[np.ndarray, " n"]) -> Float[np.ndarray, "V 3"]:
    """Move the corners of regions to where their planes meet. Faces at a corner without such a place leave."""
    labels, count = regions.labels, len(regions.normals)
    may_move = np.full(len(surface.vertices), reach)
    may_move[free] = np.inf
    while True:
        size = np.bincount(labels[labels >= 0], minlength=count)
        places = surface.vertices.copy()
        own = np.repeat(labels, 3)
        corner, label = np.divmod(np.unique((surface.faces.ravel() * count + own)[own >= 0]), count)
        several = np.bincount(corner, minlength=len(places)) > 1
        one = ~several[corner]
        normals = regions.normals[label[one]]
        heights = (places[corner[one]] * normals).sum(axis=1) - regions.offsets[label[one]]
        places[corner[one]] -= heights[:, None] * normals
        together: dict[int, tuple[int, ...]] = {}
        for at, number in zip(corner[~one].tolist(), label[~one].tolist(), strict=True):
            together[at] = (*together.get(at, ()), number)
        alike: dict[tuple[int, ...], list[int]] = {}
        for at, numbers in together.items():
            alike.setdefault(numbers, []).append(at)
        leaving = np.zeros(len(labels), bool)
        for numbers, corners in alike.items():
            normals, offsets = regions.normals[list(numbers)], regions.offsets[list(numbers)]
            back, values, across = np.linalg.svd(normals, full_matrices=False)
            inverse = np.where(values > WELL, 1 / values, 0)
            before = surface.vertices[corners]
            places[corners] -= (before @ normals.T - offsets) @ back * inverse @ across
            wrong = np.abs(places[corners] @ normals.T - offsets).max(axis=1) > EXACT
            wrong |= np.linalg.norm(places[corners] - before, axis=1) > may_move[corners]
            if wrong.any():
                smallest = min(numbers, key=lambda number: size[number])
                at = np.isin(surface.faces, np.array(corners)[wrong]).any(axis=1)
                leaving |= at & (labels == smallest)
        if not leaving.any():
            leaving = _folded(surface, regions, places)
        if not leaving.any():
            break
        labels[leaving] = KEPT
    around = np.where(surface.opposite < 0, OPEN, labels[surface.opposite // 3]).reshape(-1, 3)
    enclosed = (labels == KEPT) & (around[:, 0] >= 0) & (around == around[:, :1]).all(axis=1)
    labels[enclosed] = around[enclosed, 0]
    return places


def _folded(surface: Surface, regions: Regions, places: Float[np.ndarray, "V 3"]) -> Bool[np.ndarray, " F"]:
    """Whether a face at the end of a region is turned over in the plane, so that the outline would cross itself."""
    labels = regions.labels
    ends = np.zeros(len(places), bool)
    ends[surface.faces[labels == KEPT]] = True
    flat = np.flatnonzero((labels >= 0) & ends[surface.faces].any(axis=1))
    a, b, c = np.moveaxis(places[surface.faces[flat]], 1, 0)
    folded = np.zeros(len(labels), bool)
    folded[flat] = (np.cross(b - a, c - a) * regions.normals[labels[flat]]).sum(axis=1) <= 0
    return folded


def _polygons(
    surface: Surface, regions: Regions, places: Float[np.ndarray, "V 3"], tolerance: float
) -> dict[int, Int[np.ndarray, "t 3"]]:
    """Cut the outline of each region into triangles. If it crosses itself, the region keeps its own, in its plane."""
    labels = regions.labels
    start, end = surface.ends
    own = np.repeat(labels, 3)
    beyond = np.where(surface.opposite < 0, OPEN, labels[surface.opposite // 3])
    border = (own >= 0) & (own != beyond)
    # A corner is fixed where three things meet, or where triangles that stay have it.
    around = [
        (start, own),
        (start[beyond == OPEN], beyond[beyond == OPEN]),
        (end[beyond == OPEN], beyond[beyond == OPEN]),
    ]
    span = len(regions.normals) - OPEN
    keys = np.unique(np.concatenate([corner * span + (label - OPEN) for corner, label in around]))
    kinds = np.bincount(keys // span, minlength=len(places))
    kept = np.zeros(len(places), bool)
    kept[surface.faces[labels == KEPT]] = True
    opened = np.zeros(len(places), bool)
    opened[keys[keys % span == 0] // span] = True
    fixed = kept | (kinds > 2)
    found = {}
    rings: dict[int, list[np.ndarray]] = {}
    for loop in _loops(surface, border):
        rings.setdefault(int(own[loop[0]]), []).append(start[loop])
    for number in np.unique(own[border]).tolist():
        normal = regions.normals[number]
        first = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
        first /= np.linalg.norm(first)
        plane = places @ np.stack([first, np.cross(normal, first)], axis=1)
        found[number] = surface.faces[labels == number]
        for step in (tolerance, 0.0):
            cut = _cut([_straight(ring, plane, fixed, opened, step) for ring in rings.get(number, [])], plane)
            if cut is not None:
                found[number] = cut
                break
    return found


def _straight(
    ring: Int[np.ndarray, " n"],
    plane: Float[np.ndarray, "V 2"],
    fixed: Bool[np.ndarray, " V"],
    opened: Bool[np.ndarray, " V"],
    tolerance: float,
) -> Int[np.ndarray, " m"]:
    """Leave out corners between two planes, which are on a line, and those of open borders within a tolerance."""
    ring = ring[fixed[ring] | opened[ring]]
    if len(ring) < 3 or not tolerance:
        return ring
    ends = np.flatnonzero(fixed[ring])
    if not len(ends):
        ends = np.array([np.linalg.norm(plane[ring] - plane[ring].mean(axis=0), axis=1).argmax()])
    ring = np.roll(ring, -ends[0])
    ends = np.append(ends - ends[0], len(ring))
    closed = np.append(ring, ring[0])
    left = []
    for a, b in pairwise(ends):
        run = closed[a : b + 1]
        if len(run) > 2:
            run = run[np.isin(np.arange(len(run)), _simplified(plane[run], tolerance))]
        left.append(run[:-1])
    return np.concatenate(left)


def _simplified(line: Float[np.ndarray, "n 2"], tolerance: float) -> Int[np.ndarray, " m"]:
    """The numbers of the points that a line needs within a tolerance, by Douglas and Peucker."""
    kept = approximate_polygon(line, tolerance)
    numbers, at = [], 0
    for point in kept:
        at += int((line[at:] == point).all(axis=1).argmax())
        numbers.append(at)
    return np.array([*numbers[:-1], len(line) - 1])


def _cut(rings: list[Int[np.ndarray, " n"]], plane: Float[np.ndarray, "V 2"]) -> Int[np.ndarray, "t 3"] | None:
    """Cut the area between rings into triangles. None if they cross."""
    from matplotlib.path import Path  # its import takes long, and few scenes need it

    rings = [ring for ring in rings if len(ring) > 2]
    areas = [turned_area(plane[ring]) for ring in rings]
    outer = sorted((k for k, area in enumerate(areas) if area > 0), key=lambda k: areas[k])
    holes_of: dict[int, list[int]] = {k: [k] for k in outer}
    for k, area in enumerate(areas):
        if area < 0 and outer:
            inside = (j for j in outer if Path(plane[rings[j]]).contains_points(plane[rings[k]]).mean() > 0.5)
            holes_of[next(inside, outer[-1])].append(k)
    triangles, missing = [np.zeros((0, 3), int)], SAME_AREA * abs(sum(areas))
    for members in holes_of.values():
        apart = _apart([rings[k] for k in members])
        corners = np.concatenate(apart)
        cut = cut_rings(plane[corners], np.cumsum([len(ring) for ring in apart]).tolist(), missing)
        if cut is None:
            return None
        triangles.append(corners[cut])
    return np.concatenate(triangles)


def _apart(rings: list[Int[np.ndarray, " n"]]) -> list[Int[np.ndarray, " n"]]:
    """Make the holes that have a corner of the outline a part of it: ear clipping misses a hole that touches it."""
    outline, *inner = rings
    left = []
    for hole in inner:
        shared = np.flatnonzero(np.isin(outline, hole))
        if len(shared):
            at = shared[0]
            from_there = np.roll(hole, -int((hole == outline[at]).argmax()))
            outline = np.concatenate([outline[:at], from_there, outline[at:]])
        else:
            left.append(hole)
    return [outline, *left]
