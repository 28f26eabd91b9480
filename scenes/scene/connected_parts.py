"""Which triangles of a mesh share edges, and its connected parts. Closed ones are bodies; all others are sheets."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

if TYPE_CHECKING:
    from trimesh import Trimesh

DECIMALS = 8  # Corners are one if their coordinates agree in so many, metres

FEWEST = 4  # No body has fewer triangles


def shared_corners(points: Float[np.ndarray, "n k"], decimals: int) -> Int[np.ndarray, " n"]:
    """Return the index of the first point that agrees with each point in some decimals."""
    rounded = np.round(points * 10**decimals).astype(np.int64)
    order = np.lexsort(rounded.T)  # which keeps the order of equal points
    first = np.diff(rounded[order], axis=0, prepend=np.iinfo(np.int64).min).any(axis=1)
    result = np.empty(len(points), np.int64)
    result[order] = order[first][np.cumsum(first) - 1]
    return result


class HalfEdges(NamedTuple):
    """The three edges of each triangle, sorted by their two vertices. Edge k of triangle f has the number 3f + k."""

    order: Int[np.ndarray, " n"]  # the numbers
    first: Int[np.ndarray, " edges"]  # where each different edge begins in this order
    faces: Int[np.ndarray, " edges"]  # how many triangles have it
    starts: Int[np.ndarray, " n"]  # the vertex where each begins, by its number
    ends: Int[np.ndarray, " n"]  # the vertex where it ends

    @property
    def pairs(self) -> tuple[Int[np.ndarray, " n"], Int[np.ndarray, " n"]]:
        """The numbers of both at each edge that exactly two triangles have."""
        first = self.first[self.faces == 2]
        return self.order[first], self.order[first + 1]


def half_edges(faces: Int[np.ndarray, "n 3"]) -> HalfEdges:
    """Sort the edges of triangles, which are given by their vertices."""
    starts, ends = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    key = np.minimum(starts, ends) * (faces.max(initial=0) + 1) + np.maximum(starts, ends)
    order = np.argsort(key, kind="stable")
    first = np.flatnonzero(np.diff(key[order], prepend=-1))
    return HalfEdges(order, first, np.diff(first, append=len(order)), starts, ends)


def connected(edges: HalfEdges) -> Int[np.ndarray, " faces"]:
    """Return the part that each triangle is of: two are connected if no others share an edge of theirs."""
    one, other = edges.pairs
    return _components(np.column_stack([one, other]) // 3, len(edges.order) // 3)


def turned(edges: HalfEdges, part: Int[np.ndarray, " faces"]) -> Bool[np.ndarray, " faces"]:
    """Return whether a triangle is wound otherwise than the first one of its part; false on a Möbius strip."""
    one, other = edges.pairs
    count = len(part)
    same = (edges.starts[one] < edges.ends[one]) == (edges.starts[other] < edges.ends[other])  # both run alike along it
    if not same.any():
        return np.zeros(count, bool)
    # The graph has each triangle in both windings. One of them is connected with the first triangle of the part.
    first = np.concatenate([one // 3, one // 3 + count])
    second = np.concatenate([other // 3 + count * same, other // 3 + count * ~same])
    way = _components(np.column_stack([first, second]), 2 * count)[:count]
    return way != way[np.unique(part, return_index=True)[1]][part]


def _components(pairs: Int[np.ndarray, "n 2"], count: int) -> Int[np.ndarray, " count"]:
    from trimesh.graph import connected_component_labels  # slow to import

    return connected_component_labels(pairs, node_count=count)


class Parts(NamedTuple):
    """The triangles of a mesh by connected parts."""

    of_face: Int[np.ndarray, " faces"]  # number of each triangle's part
    closed: Bool[np.ndarray, " parts"]  # whether each part is closed
    faces: Int[np.ndarray, "faces 3"]  # the vertices of all triangles: one for each place, each part wound consistently

    def members(self, closed: bool = True) -> list[Int[np.ndarray, " k"]]:
        """Return the indices of the triangles of each closed part, or of each other one, in rising order."""
        chosen = np.flatnonzero(self.closed[self.of_face] == closed)
        by_part = chosen[np.argsort(self.of_face[chosen], kind="stable")]
        sizes = np.bincount(self.of_face)[self.closed == closed]
        return np.split(by_part, np.cumsum(sizes)[:-1]) if len(chosen) else []


def parts_of(mesh: Trimesh) -> Parts:
    """Divide a mesh into its connected parts, also where the file repeats corners for each face or normal."""
    faces = shared_corners(np.asarray(mesh.vertices), DECIMALS)[np.asarray(mesh.faces)]
    edges = half_edges(faces)
    part = connected(edges)
    sizes = np.bincount(part)
    # At every edge of a closed part are two of its triangles. Further ones may be those of parts that touch it.
    edge = np.repeat(np.arange(len(edges.faces)), edges.faces)
    other = edges.faces[edge] != 2
    key, of_part = np.unique(edge[other] * len(sizes) + part[edges.order[other] // 3], return_counts=True)
    closed = sizes >= FEWEST
    closed[key[of_part != 2] % max(1, len(sizes))] = False
    reverse = turned(edges, part)
    faces[reverse] = faces[reverse, ::-1]
    return Parts(part, closed, faces)


def part_meshes(mesh: Trimesh, parts: Parts, closed: bool = True) -> list[Trimesh]:
    """Return the closed parts of a mesh, or the others, wound consistently."""
    from trimesh import Trimesh  # slow to import

    found = []
    for faces in parts.members(closed):
        used, index = np.unique(parts.faces[faces], return_inverse=True)
        found.append(Trimesh(np.asarray(mesh.vertices)[used], index.reshape(-1, 3), process=False))
    return found


def mesh_of(triangles: Float[np.ndarray, "n 3 3"]) -> Trimesh:
    """A mesh of triangles, which share the corners that they have in common."""
    from trimesh import Trimesh  # slow to import

    mesh = Trimesh(triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3), process=False)
    mesh.merge_vertices()
    return mesh
