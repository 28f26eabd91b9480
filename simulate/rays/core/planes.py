"""The planes of a scene's triangles. A path is identified by its planes, not by its triangles."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int, UInt32
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from scenes.scene.description import Scene

TOLERANCE = 1e-4
"""Two triangles are coplanar if their normals (unit vectors) and offsets (metres) agree this closely."""

BLOCK = 64
"""Triangles of a plane are searched in blocks of this many, each with a box around it. A fine mesh has thousands."""


class Planes:
    """Planes n·x = h, and the triangles in each of them."""

    def __init__(self, scene: Scene, identifiers: list[int]):
        meshes = [item.mesh for item in scene.objects]
        triangles = np.concatenate([mesh.triangles for mesh in meshes])
        normals = np.concatenate([mesh.face_normals for mesh in meshes])
        offsets = (normals * triangles[:, 0]).sum(axis=1)
        self.of_face = _group(np.column_stack([normals, offsets]))
        self.first_face = np.zeros(max(identifiers) + 1, np.int64)
        self.first_face[identifiers] = np.cumsum([0] + [len(mesh.faces) for mesh in meshes[:-1]])

        order = np.argsort(self.of_face, kind="stable")
        count = int(self.of_face.max()) + 1
        self.first = np.searchsorted(self.of_face[order], np.arange(count + 1))
        for plane in np.flatnonzero(np.diff(self.first) > BLOCK):  # neighbours into one block
            part = slice(self.first[plane], self.first[plane + 1])
            order[part] = order[part][cKDTree(triangles[order[part]].mean(axis=1), leafsize=BLOCK).indices]
        self.normals, self.offsets = normals[order][self.first[:-1]], offsets[order][self.first[:-1]]
        self.faces, corners = order, triangles[order]
        inwards = np.cross(normals[order][:, None], np.roll(corners, -1, axis=1) - corners)
        inwards /= np.linalg.norm(inwards, axis=-1, keepdims=True)
        self.sides = np.concatenate([inwards, (inwards * corners).sum(axis=-1, keepdims=True)], axis=-1)
        blocks = -(-np.diff(self.first) // BLOCK)
        self.first_box = np.append(0, np.cumsum(blocks))
        begins = np.repeat(self.first[:-1] - BLOCK * self.first_box[:-1], blocks) + BLOCK * np.arange(blocks.sum())
        low, high = np.minimum.reduceat(corners.min(axis=1), begins), np.maximum.reduceat(corners.max(axis=1), begins)
        self.boxes = np.stack([low, high], axis=1)
        self.low, self.high = (
            np.minimum.reduceat(low, self.first_box[:-1]),
            np.maximum.reduceat(high, self.first_box[:-1]),
        )

    def of(self, shapes: UInt32[np.ndarray, " n"], triangles: UInt32[np.ndarray, " n"]) -> Int[np.ndarray, " n"]:
        """Index of each triangle's plane."""
        return self.of_face[self.first_face[shapes] + triangles]


def _group(planes: Float[np.ndarray, "n 4"]) -> Int[np.ndarray, " n"]:
    """Label of each plane (normal, offset), in the order of their first triangles. A plane and its reverse are one.

    Planes in one cell of a grid agree closely, and the cells are compared by their means. A fine mesh has thousands of
    triangles in one plane, and too many pairs of them to compare.
    """
    whole = np.round(planes / (TOLERANCE / 2)).astype(np.int64)
    _, cell, members = np.unique(whole, axis=0, return_inverse=True, return_counts=True)
    cell = cell.ravel()
    means = np.stack([np.bincount(cell, values) / members for values in planes.T], axis=1)
    tree = cKDTree(np.concatenate([means, -means]))
    pairs = tree.query_pairs(TOLERANCE, output_type="ndarray") % len(means)
    graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(means), len(means)))
    label = connected_components(graph, directed=False)[1][cell]
    _, first, label = np.unique(label, return_index=True, return_inverse=True)
    return first.argsort().argsort()[label]
