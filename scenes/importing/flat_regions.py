"""Find the flat regions of a finely meshed and noisy surface, such as that of a scanned room.

Normals and places of the surface are averaged over so many neighbours that noise hardly bends them. A region grows from
the flattest triangle that is left, over triangles whose averaged normal and place fit its plane; the plane is then
fitted again. What lies between regions and is narrower than half a wavelength joins the nearest one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra
from trimesh.triangles import cross

from scenes.scene.connected_parts import half_edges

LEAST_TRIANGLES = 32  # Triangles of a region at least. Fewer are as drawn, or not worth a plane.

STEADY = float(np.radians(4.0))  # Standard deviation of averaged normals that is aimed at

LIKE = float(np.cos(np.radians(20.0)))  # Least cosine between a plane's normal and an averaged normal of its region

WORTH = 0.1  # Least share of an object's area in regions that are not exactly flat already

FINE = 0.05  # Largest mean area of the triangles of a scan, square metres. Terrain has larger ones.

FACING = 0.3  # Least such cosine of a triangle whose own corners fit the plane

CURVED = float(np.radians(5.0))  # Angle by which the normal of a plane's region may turn, apart from noise

NARROW = 8
"""Tolerances that are half a wavelength by default. Narrower parts join the regions beside them, since rays do not
describe them, and narrower regions are none."""

REST = 0.2  # Share of faces of a region that lie beside a curved surface from which it is a strip of that

SMOOTH = 15.0  # How many times more a region is bent than noisy if it is drawn as a curved surface

NOISY = 3.0  # Standard deviations within which single corners of a region are from its plane

GROWN = 1.02  # A region that grows by less when its plane is fitted again is complete


@dataclass(frozen=True)
class Surface:
    """Triangles with shared corners."""

    vertices: Float[np.ndarray, "V 3"]  # metres
    faces: Int[np.ndarray, "F 3"]
    owners: Int[np.ndarray, " F"]  # number of the object of each face
    opposite: Int[np.ndarray, " H"]  # of each half-edge 3 f + k, from corner k of face f: that of its neighbour, or -1

    @staticmethod
    def of(vertices: Float[np.ndarray, "V 3"], faces: Int[np.ndarray, "F 3"], owners: Int[np.ndarray, " F"]) -> Surface:
        """Pair the half-edges of consistently wound neighbours. Edges of one, or of three faces have no pair."""
        edges = half_edges(faces)
        one, other = edges.pairs
        matching = edges.starts[one] == edges.ends[other]
        opposite = np.full(faces.size, -1)
        opposite[one[matching]], opposite[other[matching]] = other[matching], one[matching]
        return Surface(vertices, faces, owners, opposite)

    @property
    def ends(self) -> tuple[Int[np.ndarray, " H"], Int[np.ndarray, " H"]]:
        """The corners at which each half-edge starts and ends."""
        return self.faces.ravel(), np.roll(self.faces, -1, axis=1).ravel()

    @property
    def neighbours(self) -> Int[np.ndarray, "F 3"]:
        """The face of the same object across each edge, -1 if there is none."""
        across = (self.opposite // 3).reshape(-1, 3)
        return np.where(self.owners[across] == self.owners[:, None], across, -1)

    def area_vectors(self) -> Float[np.ndarray, "F 3"]:
        """Normals of the faces, as long as the areas."""
        return cross(self.vertices[self.faces]) / 2


@dataclass(frozen=True)
class Regions:
    labels: Int[np.ndarray, " F"]  # number of each face's region, -1 if it belongs to none
    normals: Float[np.ndarray, "R 3"]
    offsets: Float[np.ndarray, " R"]  # a point x of the plane has normal · x = offset, metres


def flat_regions(surface: Surface, tolerance: float) -> Regions:
    """Find the flat regions of a surface, whose averaged places are within a tolerance in metres of their planes."""
    growth = _Growth(surface, tolerance)
    rounds = growth.rounds()
    for times in dict.fromkeys((rounds, rounds // 2)):  # less averaging finds what lies between sharp edges
        growth.average(times)
        growth.grow()
        growth.join_what_fits()
    growth.keep_planes()
    growth.join_what_fits()
    if (growth.labels >= 0).any():
        _join_what_is_narrow(surface, growth.labels, NARROW * tolerance / 2)
    normals, offsets = zip(*growth.planes, strict=True) if growth.planes else ((), ())
    return Regions(growth.labels, np.array(normals).reshape(-1, 3), np.array(offsets))


class _Growth:
    """Regions that grow over a surface whose normals and places are averaged."""

    def __init__(self, surface: Surface, tolerance: float) -> None:
        self.surface, self.tolerance = surface, tolerance
        self.areas = surface.area_vectors()
        self.size = np.linalg.norm(self.areas, axis=1)
        self.centres = surface.vertices[surface.faces].mean(axis=1)
        self.next = surface.neighbours
        self.labels = np.full(len(self.size), -1)
        self.planes: list[tuple[np.ndarray, float]] = []  # unit normal and offset of each region
        self._seen = np.full(len(self.size), -1)

    def rounds(self) -> int:
        """How often to average so that noise turns the normals by little."""
        face, edge = np.nonzero(self.next >= 0)
        unit = self.areas / self.size[:, None].clip(1e-300)
        between = np.clip((unit[face] * unit[self.next[face, edge]]).sum(axis=1), -1, 1)
        noise = float(np.arccos(np.median(between))) if len(between) else 0.0
        return int(np.ceil((noise / STEADY) ** (2 / 3)).clip(0, 8)) if noise > 1e-3 else 0

    def average(self, rounds: int) -> None:
        """Average normals and places over neighbours. ``flatness`` is 1 where all normals around are parallel."""
        faces, count = self.surface.faces, len(self.surface.vertices)
        moments = np.column_stack([self.areas, self.size, self.size[:, None] * self.centres])
        places = (np.ones(faces.size), (faces.ravel(), np.repeat(np.arange(len(faces)), 3)))
        corners = coo_array(places, shape=(count, len(faces))).tocsr()
        for _ in range(rounds):
            moments = corners.T @ (corners @ moments) / 12
        length = np.linalg.norm(moments[:, :3], axis=1).clip(1e-300)
        self.normals = moments[:, :3] / length[:, None]
        self.flatness = length / moments[:, 3].clip(1e-300)
        self.places = moments[:, 4:] / moments[:, 3:4].clip(1e-300)

    def grow(self) -> None:
        """Grow a region from each face that is in none, the flattest ones first."""
        self._taken = self.labels >= 0
        for seed in np.argsort(-self.flatness, kind="stable").tolist():
            if self._taken[seed]:
                continue
            found, normal, offset = self._grown(seed)
            if len(found) >= LEAST_TRIANGLES / 4:
                curved = self._is_curved(found, normal, offset) or self._is_rest(found, normal, offset)
                self._taken[found] = True  # also what is curved, which the next seed on it would find again
                if not curved:
                    self.labels[found] = len(self.planes)
                    self.planes.append((normal, offset))

    def _grown(self, seed: int) -> tuple[Int[np.ndarray, " k"], np.ndarray, float]:
        """Grow a region around a face, and fit its plane, until it no longer grows."""
        normal, offset = self.normals[seed], float(self.normals[seed] @ self.places[seed])
        found, before = np.array([seed]), 0
        while len(found) > GROWN * before:
            before = len(found)
            found = self._connected(seed, normal, offset)
            if len(found) < LEAST_TRIANGLES / 4:
                break
            normal, offset = self._fitted(found)
        return found, normal, offset

    def _connected(self, seed: int, normal: np.ndarray, offset: float) -> Int[np.ndarray, " k"]:
        """The faces around a seed that fit a plane and are in no region."""
        frontier = np.array([seed])
        found, looked = [frontier], [frontier]
        self._seen[seed] = 0
        while len(frontier):
            around = self.next[frontier].ravel()
            around = around[around >= 0]
            around = around[self._seen[around] < 0]
            self._seen[around] = np.arange(len(around))
            around = around[self._seen[around] == np.arange(len(around))]  # each once
            looked.append(around)
            frontier = around[~self._taken[around] & self._fits(around, normal, offset)]
            found.append(frontier)
        self._seen[np.concatenate(looked)] = -1
        return np.concatenate(found)

    def _fits(self, faces: Int[np.ndarray, " k"], normal: np.ndarray, offset: float) -> Bool[np.ndarray, " k"]:
        near = np.abs(self.places[faces] @ normal - offset) <= self.tolerance
        return near & (self.normals[faces] @ normal > LIKE)

    def _is_rest(self, found: Int[np.ndarray, " k"], normal: np.ndarray, offset: float) -> bool:
        """Whether a region is a strip that is left of a curved surface, whose faces beside it would fit, too."""
        around = self.next[found].ravel()
        around = around[(around >= 0) & self._taken[around] & (self.labels[around] < 0)]
        return int(self._fits(around, normal, offset).sum()) > REST * len(found)

    def _fitted(self, found: Int[np.ndarray, " k"]) -> tuple[Float[np.ndarray, " 3"], float]:
        """Fit a plane to the centres of faces, weighted by their areas."""
        weights, points = self.size[found], self.centres[found]
        middle = np.average(points, axis=0, weights=weights)
        scatter = (points - middle).T @ ((points - middle) * weights[:, None])
        normal = np.linalg.eigh(scatter)[1][:, 0]
        normal *= np.sign(normal @ self.areas[found].sum(axis=0)) or 1.0
        return normal, float(normal @ middle)

    def _heights(
        self, found: Int[np.ndarray, " k"], normal: np.ndarray, offset: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """The corners of faces, and their heights above a plane, metres."""
        corners = self.surface.vertices[np.unique(self.surface.faces[found])]
        return corners, corners @ normal - offset

    def _is_curved(self, found: Int[np.ndarray, " k"], normal: np.ndarray, offset: float) -> bool:
        """Whether a region is bent, rather than noisy: by the quadratic surface that fits it best."""
        corners, heights = self._heights(found, normal, offset)
        x, y = np.linalg.svd(normal[None])[2][1:] @ (corners - corners.mean(axis=0)).T
        terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
        bow = np.linalg.lstsq(terms, heights, rcond=None)[0]
        turned = np.hypot(2 * bow[3] * x + bow[4] * y, bow[4] * x + 2 * bow[5] * y)
        bowed = float(np.ptp(terms[:, 3:] @ bow[3:]))
        noise = float(np.std(heights - terms @ bow))
        return bool(np.quantile(turned, 0.9) > CURVED or bowed > max(self.tolerance, SMOOTH * noise))

    def keep_planes(self) -> None:
        """Fit the planes of the regions again, and leave small and curved ones, and objects that are flat as drawn."""
        rough = np.zeros(len(self.planes), bool)
        for number in range(len(self.planes)):
            found = np.flatnonzero(self.labels == number)
            enough = len(found) >= LEAST_TRIANGLES and self.size[found].sum() >= (NARROW * self.tolerance) ** 2
            if enough:
                self.planes[number] = normal, offset = self._fitted(found)
                corners, heights = self._heights(found, normal, offset)
                exact = max(1e-5, 4 * float(np.spacing(np.float32(np.abs(corners).max()))))
                fine = self.size[found].mean() < FINE
                rough[number] = fine and np.median(np.abs(heights)) > exact
                enough = not self._is_curved(found, normal, offset)
            if not enough:
                self.labels[found] = -1
        if len(rough):
            of_object = self.surface.owners
            uneven = np.bincount(of_object, np.where((self.labels >= 0) & rough[self.labels], self.size, 0))
            self.labels[(uneven < WORTH * np.bincount(of_object, self.size))[of_object]] = -1

    def join_what_fits(self) -> None:
        """Let regions grow over faces whose own corners fit their planes, as near the edges of rooms."""
        labels, surface = self.labels, self.surface
        normals, offsets = (np.array(each) for each in zip(*self.planes, strict=True)) if self.planes else ((), ())
        bands = np.full(len(self.planes), self.tolerance)
        for number in np.unique(labels[labels >= 0]).tolist():
            _, heights = self._heights(np.flatnonzero(labels == number), *self.planes[number])
            bands[number] = max(self.tolerance, NOISY * 1.48 * float(np.median(np.abs(heights))))
        while True:
            face, edge = np.nonzero((labels[:, None] < 0) & (self.next >= 0) & (labels[self.next] >= 0))
            if not len(face):
                return
            label = labels[self.next[face, edge]]
            normal = normals[label]
            heights = np.einsum("nki,ni->nk", surface.vertices[surface.faces[face]], normal)
            far = np.abs(heights - offsets[label][:, None]).max(axis=1)
            fits = np.flatnonzero((far <= bands[label]) & ((self.normals[face] * normal).sum(axis=1) > FACING))
            if not len(fits):
                return
            fits = fits[np.argsort(-far[fits], kind="stable")]  # of several, the nearest is written last
            labels[face[fits]] = label[fits]


def _join_what_is_narrow(surface: Surface, labels: Int[np.ndarray, " F"], reach: float) -> None:
    """Give faces to the nearest region if all around them, within a reach in metres, is near one."""
    next_to = surface.neighbours
    centres = surface.vertices[surface.faces].mean(axis=1)
    face, edge = np.nonzero((next_to >= 0) & (labels[:, None] < 0))
    other = next_to[face, edge]
    steps = np.linalg.norm(centres[face] - centres[other], axis=1).clip(1e-9)
    graph = coo_array((np.r_[steps, steps], (np.r_[face, other], np.r_[other, face])), shape=(len(labels),) * 2)
    graph = graph.tocsr()
    sources = np.unique(other[labels[other] >= 0])
    if not len(sources):
        return
    far, _, nearest = dijkstra(graph, indices=sources, min_only=True, limit=reach, return_predecessors=True)
    wide = np.flatnonzero((labels < 0) & ~np.isfinite(far))
    joins: Bool[np.ndarray, " F"] = (labels < 0) & np.isfinite(far)
    if len(wide):
        joins &= ~np.isfinite(dijkstra(graph, indices=wide, min_only=True, limit=reach))
    labels[joins] = labels[nearest[joins]]
