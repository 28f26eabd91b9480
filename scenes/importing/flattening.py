"""Make planes of the walls of scanned and finely meshed objects, and tell what was changed."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from trimesh import Trimesh
from trimesh.graph import connected_component_labels
from trimesh.triangles import area as area_of

from scenes.files.lengths import plain
from scenes.files.plain_text import say
from scenes.importing.flat_polygons import as_planes, holes
from scenes.importing.flat_regions import LEAST_TRIANGLES, NARROW, Regions, Surface, flat_regions
from scenes.importing.imported_objects import SLIVER
from scenes.scene.connected_parts import mesh_of
from scenes.scene.description import Scene, SceneObject
from scenes.scene.materials import RadioMaterial
from scenes.scene.shapes import union

WAVELENGTHS = 1 / 16  # Default tolerance

COARSEST = 0.05  # Metres. The default tolerance is no larger at low frequencies, since no scan is so noisy.

SMALL_HOLE = 0.25
"""Square metres. No larger holes are filled, which scans have where nothing was seen: doors and windows are larger.
Those of half a wavelength squared, which hardly let a wave pass, may be larger at low frequencies."""

MANY = 50_000  # Triangles from which a line says that regions are looked for

COLORS = {"planes": (0.62, 0.74, 0.86), "filled holes": (1.0, 0.72, 0.2), "as in the file": (0.8, 0.25, 0.2)}
"""Colours of the drawing that shows what became planes."""


@dataclass(frozen=True)
class Flattened:
    """A scene whose flat regions are planes, and what was changed."""

    scene: Scene
    sentence: str
    shown: Scene  # in the colours of what became planes, for a drawing


def flattened(scene: Scene, tolerance: float | None) -> Flattened | None:
    """Make planes of the flat regions of a scene, within a tolerance in metres, by default a sixteenth of a wavelength.

    Return None if it has no such regions but those that are exactly flat already.
    """
    within = min(scene.wavelength * WAVELENGTHS, COARSEST) if tolerance is None else tolerance
    if max(len(item.mesh.faces) for item in scene.objects) < LEAST_TRIANGLES:
        return None
    surface = _joined(scene)
    limit = f"{plain(1000 * within)} mm" + (f" (λ/{scene.wavelength / within:.3g})" if tolerance is None else "")
    many = len(surface.faces) > MANY
    if many:
        say(f"{scene.name}: looking for flat regions in {len(surface.faces):,} triangles")
    regions = flat_regions(surface, within)
    filled, regions, centres = _filled(surface, regions, max(SMALL_HOLE, (NARROW * within) ** 2))
    sides = np.linalg.norm(np.diff(surface.vertices[surface.faces], axis=1), axis=2)
    reach = NARROW * within + 2 * float(np.median(sides))
    places, planes = as_planes(filled, regions, reach, NARROW * within / 2, centres)
    if not planes:
        if many:
            say(f"{scene.name}: found none within {limit} that is not exactly flat; --flatten sets another limit")
        return None

    labels, owners, fans = regions.labels, filled.owners, np.arange(len(filled.faces)) >= len(surface.faces)
    touched = np.unique(owners[labels >= 0])
    kept = np.isin(owners, touched) & (labels < 0) & ~_loose(filled, labels, NARROW * within)
    objects, owner = list(scene.objects), {plane: owners[labels == plane][0] for plane in planes}
    for number in touched.tolist():
        own = [triangles for plane, triangles in planes.items() if owner[plane] == number]
        faces = np.concatenate([*own, filled.faces[kept & (owners == number)]])
        objects[number] = replace(objects[number], mesh=_mesh(places[faces]))
    flat, holes_filled = np.concatenate(list(planes.values())), filled.faces[fans & (kept | (labels >= 0))]
    area, rest, of_holes = (area_of(places[faces]).sum() for faces in (flat, filled.faces[kept], holes_filled))
    sentence = (
        f"flattened {np.count_nonzero(labels[~fans] >= 0):,} triangles to {len(flat):,} in {len(planes)} planes within "
        f"{limit}: {plain(area)} of {plain(area + rest)} m²; {len(np.unique(holes_filled.max(axis=1)))} holes of "
        f"{plain(of_holes)} m² filled; {plain(rest)} m² of curved or small surface kept as {kept.sum():,} triangles; "
        "--no-flatten keeps the file's triangles"
    )
    beside = 2e-3 * np.repeat(regions.normals[labels[fans & (labels >= 0)]], 3, axis=0).reshape(-1, 3, 3)
    fan = places[filled.faces[fans & (labels >= 0)]]
    untouched = [item.mesh.triangles for number, item in enumerate(objects) if number not in touched]
    rest_shown = np.concatenate([*untouched, places[filled.faces[kept]]])
    shown = _colored(scene, places[flat], np.concatenate([fan + beside, fan - beside]), rest_shown)
    return Flattened(replace(scene, objects=tuple(objects)), sentence, shown)


def _joined(scene: Scene) -> Surface:
    """All objects as one surface: those that have corners in common stay together."""
    meshes = [item.mesh for item in scene.objects]
    joined = union(*meshes)
    vertices, number = np.unique(joined.vertices, axis=0, return_inverse=True)
    owners = np.repeat(np.arange(len(meshes)), [len(mesh.faces) for mesh in meshes])
    return Surface.of(vertices, number[joined.faces], owners)


def _filled(surface: Surface, regions: Regions, largest: float) -> tuple[Surface, Regions, Int[np.ndarray, " n"]]:
    """Fill the small holes of flat regions by fans, whose triangles are of the regions around. Return their centres."""
    rims = [rim for rim in holes(surface, largest) if (regions.labels[rim // 3] >= 0).any()]
    if not rims:
        return surface, regions, np.zeros(0, int)
    start, end = surface.ends
    centres = len(surface.vertices) + np.arange(len(rims))
    beside = np.concatenate(rims)
    fans = np.column_stack([end[beside], start[beside], np.repeat(centres, [len(rim) for rim in rims])])
    vertices = np.concatenate([surface.vertices, [surface.vertices[start[rim]].mean(axis=0) for rim in rims]])
    faces, owners = np.concatenate([surface.faces, fans]), surface.owners[np.r_[: len(surface.faces), beside // 3]]
    labels = np.concatenate([regions.labels, regions.labels[beside // 3]])
    return Surface.of(vertices, faces, owners), replace(regions, labels=labels), centres


def _loose(surface: Surface, labels: Int[np.ndarray, " F"], largest: float) -> Bool[np.ndarray, " F"]:
    """Whether a face is of a small piece that no plane is part of."""
    edge = np.flatnonzero(surface.opposite >= 0)
    pairs = np.column_stack([edge, surface.opposite[edge]]) // 3
    piece = connected_component_labels(pairs, node_count=len(labels))
    count = piece.max() + 1
    low, high, flat = np.full((count, 3), np.inf), np.full((count, 3), -np.inf), np.zeros(count, bool)
    np.minimum.at(low, piece, surface.vertices[surface.faces].min(axis=1))
    np.maximum.at(high, piece, surface.vertices[surface.faces].max(axis=1))
    flat[piece[labels >= 0]] = True
    return (~flat & (np.linalg.norm(high - low, axis=1) < largest))[piece]


def _mesh(triangles: Float[np.ndarray, "n 3 3"]) -> Trimesh:
    mesh = mesh_of(triangles)
    mesh.update_faces(mesh.nondegenerate_faces(height=SLIVER))
    mesh.remove_unreferenced_vertices()
    return mesh


def _colored(scene: Scene, *shown: Float[np.ndarray, "n 3 3"]) -> Scene:
    """A scene for a drawing that has an object for each colour."""
    parts = [(name, color, each) for (name, color), each in zip(COLORS.items(), shown, strict=True) if len(each)]
    materials = {name: RadioMaterial(name, 1.0, 0.0, 1.0, color=color) for name, color, _ in parts}
    objects = tuple(SceneObject(name, _mesh(each), name) for name, _, each in parts)
    return replace(scene, objects=objects, materials=materials)
