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


class Planes:
    """Planes n·x = h, and the triangles in each of them.

    Args:
        scene: the scene.
        identifiers: the ray tracer's identifier of each object of the scene.

    Attributes:
        normals: unit vectors n, [planes, 3].
        offsets: h in metres, [planes].
        first: the triangles of plane p are ``first[p]`` … ``first[p + 1] − 1`` of ``sides``, [planes + 1].
        sides: for each side of each triangle, a unit vector e in the plane that points inwards, and a length g. A point
            x of the plane is inside if e·x ≥ g for all three sides, [triangles, 3, 4].
        faces: number of each of these triangles, counted through all objects of the scene, [triangles].
        first_face: for each identifier, number of triangles in the objects before its own, [identifiers].
        of_face: the plane of each triangle, counted through all objects of the scene.
        vertices: for each identifier, one vertex of each of the object's triangles, [triangles, 3], metres.
    """

    def __init__(self, scene: Scene, identifiers: list[int]):
        meshes = [item.mesh for item in scene.objects]
        triangles = np.concatenate([mesh.triangles for mesh in meshes])
        normals = np.concatenate([mesh.face_normals for mesh in meshes])
        offsets = (normals * triangles[:, 0]).sum(axis=1)
        self.of_face = _group(np.column_stack([normals, offsets]))
        self.first_face = np.zeros(max(identifiers) + 1, np.int64)
        self.first_face[identifiers] = np.cumsum([0] + [len(mesh.faces) for mesh in meshes[:-1]])
        self.vertices = {
            identifier: np.asarray(mesh.triangles[:, 0], np.float32)
            for identifier, mesh in zip(identifiers, meshes, strict=True)
        }

        order = np.argsort(self.of_face, kind="stable")
        count = int(self.of_face.max()) + 1
        self.first = np.searchsorted(self.of_face[order], np.arange(count + 1))
        self.normals, self.offsets = normals[order][self.first[:-1]], offsets[order][self.first[:-1]]
        self.faces, corners = order, triangles[order]
        inwards = np.cross(normals[order][:, None], np.roll(corners, -1, axis=1) - corners)
        inwards /= np.linalg.norm(inwards, axis=-1, keepdims=True)
        self.sides = np.concatenate([inwards, (inwards * corners).sum(axis=-1, keepdims=True)], axis=-1)

    def of(self, shapes: UInt32[np.ndarray, " n"], triangles: UInt32[np.ndarray, " n"]) -> Int[np.ndarray, " n"]:
        """Index of each triangle's plane.

        Args:
            shapes: identifier of each triangle's object.
            triangles: index of each triangle in its object.

        Returns:
            Indices into ``normals`` and ``offsets``.
        """
        return self.of_face[self.first_face[shapes] + triangles]


def _group(planes: Float[np.ndarray, "n 4"]) -> Int[np.ndarray, " n"]:
    """Label of each plane (normal, offset). A plane and its reverse have the same label."""
    tree = cKDTree(np.concatenate([planes, -planes]))
    pairs = tree.query_pairs(TOLERANCE, output_type="ndarray") % len(planes)
    graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(planes), len(planes)))
    return connected_components(graph, directed=False)[1]
