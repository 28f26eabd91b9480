"""The closed parts of a mesh, which are bodies; all others are sheets."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from trimesh import Trimesh


def merge_corners(mesh: Trimesh) -> Trimesh:
    """Return a copy whose faces share corners. If a file repeats them for each face or normal, no part is closed."""
    from trimesh import Trimesh  # slow to import

    copy = Trimesh(mesh.vertices, mesh.faces, process=False)
    copy.merge_vertices()
    return copy


def closed_parts(mesh: Trimesh) -> list[Trimesh]:
    """Return the closed parts of a mesh, wound consistently. ``SceneObject.closed_parts`` keeps those of an object."""
    if len(mesh.faces) < 4:  # no body has fewer, and a town has thousands of such walls
        return []
    from trimesh.repair import fix_winding

    parts = list(merge_corners(mesh).split(only_watertight=True, repair=False))
    for part in parts:
        fix_winding(part)  # solid angles of triangles with opposite winding would cancel
    return parts
