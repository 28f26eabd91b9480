"""The connected parts of a mesh. Those that are closed are bodies; all others are sheets."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jaxtyping import Bool, Int

from scenes.scene.half_edges import connected, half_edges, shared_corners, turned

if TYPE_CHECKING:
    from trimesh import Trimesh

DECIMALS = 8  # Corners are one if their coordinates agree in so many, metres

FEWEST = 4  # No body has fewer triangles


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
