"""Which triangles of a mesh share edges, and which are connected by them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int


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
