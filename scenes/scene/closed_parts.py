"""The connected parts of a mesh. Those that are closed are bodies; all others are sheets."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jaxtyping import Int

from scenes.scene.half_edges import connected, half_edges, shared_corners, turned

if TYPE_CHECKING:
    from trimesh import Trimesh

DECIMALS = 8  # Corners are one if their coordinates agree in so many, metres

FEWEST = 4  # No body has fewer triangles, and a town has thousands of such walls


class Parts(NamedTuple):
    """The triangles of a mesh by connected parts. Indices are in rising order."""

    closed: list[Int[np.ndarray, " k"]]  # indices of the triangles of each closed part
    others: Int[np.ndarray, " n"]  # indices of the triangles of all other parts
    faces: Int[np.ndarray, "faces 3"]  # the vertices of all triangles: one for each place, each part wound consistently


def merge_corners(mesh: Trimesh) -> Trimesh:
    """Return a copy whose faces share corners. If a file repeats them for each face or normal, no part is closed."""
    from trimesh import Trimesh  # slow to import

    copy = Trimesh(mesh.vertices, mesh.faces, process=False)
    copy.merge_vertices()
    return copy


def parts_of(mesh: Trimesh) -> Parts:
    """Divide a mesh into its connected parts."""
    faces = shared_corners(np.asarray(mesh.vertices), DECIMALS)[np.asarray(mesh.faces)]
    if len(faces) < FEWEST:
        return Parts([], np.arange(len(faces)), faces)
    edges = half_edges(faces)
    part = connected(edges)
    sizes = np.bincount(part)
    # At every edge of a closed part are two of its triangles. Further ones may be those of parts that touch it.
    edge = np.repeat(np.arange(len(edges.faces)), edges.faces)
    other = edges.faces[edge] != 2
    key, of_part = np.unique(edge[other] * len(sizes) + part[edges.order[other] // 3], return_counts=True)
    closed = sizes >= FEWEST
    closed[key[of_part != 2] % len(sizes)] = False
    reverse = turned(edges, part)
    faces[reverse] = faces[reverse, ::-1]
    inside = np.flatnonzero(closed[part])
    by_part = inside[np.argsort(part[inside], kind="stable")]
    divided = np.split(by_part, np.cumsum(sizes[closed])[:-1]) if len(inside) else []
    return Parts(divided, np.flatnonzero(~closed[part]), faces)


def closed_parts(mesh: Trimesh, parts: Parts) -> list[Trimesh]:
    """Return the closed parts of a mesh, wound consistently. ``SceneObject.closed_parts`` keeps those of an object."""
    from trimesh import Trimesh

    found = []
    for faces in parts.closed:
        used, index = np.unique(parts.faces[faces], return_inverse=True)
        found.append(Trimesh(np.asarray(mesh.vertices)[used], index.reshape(-1, 3), process=False))
    return found
