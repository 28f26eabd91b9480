"""Mesh files of other programs, turned into scene objects: units, up axis, names, materials."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from trimesh import Trimesh

from scenes.description import Gateway, Scene, SceneObject, Transmitter, validate
from scenes.errors import InputError, did_you_mean
from scenes.materials import material_names, p2040_material

MESH_SUFFIXES = (".glb", ".gltf", ".obj", ".off", ".ply", ".stl")
METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
# (x, y, z) -> (x, -z, y)
Y_UP_TO_Z_UP = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
# A triangle less than this high [m] has no normal worth the name, so nothing can be reflected off it.
SLIVER = 1e-6


@dataclass(frozen=True)
class ImportReport:
    """What an import found."""

    sizes: dict[str, tuple[float, float, float]]  # m along x, y, z, per object
    degenerate: dict[str, int]  # triangles without area that were dropped, per object that had any


def default_up(path: Path) -> str:
    """The vertical axis: "y" for glTF, as its specification says (section 3.4), "z" for all others."""
    return "y" if path.suffix.lower() in (".glb", ".gltf") else "z"


def read_meshes(path: Path) -> list[tuple[str, Trimesh]]:
    """Every mesh of a file with its node's name, node transforms applied, in the file's own unit and axes.

    Vertices and triangles are as the file has them: nothing is merged or dropped.

    Raises:
        InputError: no such file, an unsupported format, an unreadable file, or one without triangles.
    """
    if path.suffix.lower() not in MESH_SUFFIXES:
        known = ", ".join(MESH_SUFFIXES)
        raise InputError(f'{path}: "{path.suffix}" is not a mesh format we read; expected one of {known}')
    if not path.is_file():
        raise InputError(f"{path}: no such mesh file")
    options: dict[str, Any] = {"process": False}
    if path.suffix.lower() == ".obj":
        options |= {"split_objects": True, "split_groups": True, "group_material": False}
    try:
        loaded = trimesh.load_scene(path, **options)
        nodes = [(node, *loaded.graph.get(node)) for node in loaded.graph.nodes_geometry]
        meshes = [
            (str(node), loaded.geometry[key].copy().apply_transform(transform))
            for node, transform, key in sorted(nodes, key=lambda n: str(n[0]))
            if isinstance(loaded.geometry[key], Trimesh) and len(loaded.geometry[key].faces)
        ]
    except Exception as error:  # trimesh's readers raise whatever their parsing trips over
        raise InputError(f"{path}: not a readable {path.suffix[1:].upper()} file ({error})") from error
    if not meshes:
        raise InputError(f"{path}: holds no triangles (is it a point cloud?)")
    if path.suffix.lower() in (".ply", ".stl", ".off"):  # formats without names
        meshes = [(path.stem, mesh) for _, mesh in meshes]
    return meshes


def _material_of(name: str, stem: str, materials: Sequence[tuple[str, str]], default: str | None) -> str | None:
    """First match wins; the node's name goes before the file's."""
    for candidate in (name, stem):
        for pattern, material in materials:
            if fnmatchcase(candidate, pattern):
                return material
    return default


def import_mesh(
    path: str | Path,
    materials: Sequence[tuple[str, str]],
    default_material: str | None = None,
    unit: str = "m",
    up: str | None = None,
) -> tuple[list[SceneObject], ImportReport]:
    """Read GLB/GLTF (an object per node), OBJ (per `o` and `g`), PLY, STL or OFF (one) into world metres.

    Args:
        materials: (glob pattern, material) pairs; the first pattern that matches an object's name, and then
            the first that matches the file's name without its ending, gives its material.
        default_material: for objects that nothing matches.
        unit: the file's unit: m, cm, mm, in or ft.
        up: the file's vertical axis, "y" or "z"; without it "y" for glTF, as its specification says, else
            "z". A y-up file is turned by +90° about x: (x, y, z) becomes (x, −z, y).

    Returns:
        The objects in order of their names, repeated names numbered, and what was found on the way.

    Raises:
        InputError: a file `read_meshes` refuses, an unknown unit, axis or material, objects without a
            material, or an object of which no triangle has any area.
    """
    path = Path(path)
    if unit not in METRES:
        raise InputError(f'{path}: unknown unit "{unit}"; {did_you_mean(unit, METRES)}')
    if up not in (None, "y", "z"):
        raise InputError(f'{path}: up must be "y" or "z", found "{up}"')
    for material in (*(m for _, m in materials), default_material):
        if material is not None and material not in material_names():
            suggestion = did_you_mean(material, material_names())
            raise InputError(f'{path}: unknown material "{material}"; {suggestion}')

    to_world = np.diag([METRES[unit]] * 3 + [1.0])
    if (up or default_up(path)) == "y":
        to_world = Y_UP_TO_Z_UP @ to_world
    meshes = read_meshes(path)
    chosen = {name: _material_of(name, path.stem, materials, default_material) for name, _ in meshes}
    unmatched = [name for name, material in chosen.items() if material is None]
    if unmatched:
        raise InputError(f"{path}: no material for {', '.join(unmatched)}; add a pattern or a default material")

    objects, degenerate = [], {}
    seen: Counter[str] = Counter()
    for name, mesh in meshes:
        seen[name] += 1
        unique = name if seen[name] == 1 else f"{name}_{seen[name]}"
        mesh = Trimesh(mesh.vertices, mesh.faces, process=False).apply_transform(to_world)
        mesh.merge_vertices()  # corners split by normals or textures would leave a closed shell open
        keep = mesh.nondegenerate_faces(height=SLIVER)
        if not keep.any():
            raise InputError(f'{path}: "{unique}" has no triangle with an area; is the unit really {unit}?')
        if not keep.all():
            degenerate[unique] = int(np.count_nonzero(~keep))
            mesh.update_faces(keep)
            mesh.remove_unreferenced_vertices()
        objects.append(SceneObject(unique, mesh, chosen[name] or ""))
    sizes = {o.name: _size(o.mesh) for o in objects}
    return objects, ImportReport(sizes, degenerate)


def import_scene(
    path: Path,
    materials: Sequence[tuple[str, str]],
    default_material: str | None,
    unit: str,
    up: str | None,
    frequency: float,
    gateway: Gateway,
    transmitter: Transmitter,
) -> tuple[Scene, ImportReport]:
    """A scene made of a mesh file, named for it: `import_mesh` with a gateway and a transmitter region.

    Args:
        path, materials, default_material, unit, up: as of `import_mesh`.
        frequency: Hz.
        gateway: where it is and how it looks, in world metres (after unit and axes are converted).
        transmitter: its region, in world metres.

    Raises:
        InputError: as `import_mesh` and `validate`, or a material unknown at the frequency.
    """
    objects, report = import_mesh(path, materials, default_material, unit, up)
    used = sorted({item.material for item in objects})
    resolved = {name: p2040_material(name, frequency) for name in used}
    scene = Scene(path.stem, frequency, gateway, transmitter, tuple(objects), resolved)
    validate(scene, str(path))
    return scene, report


def _size(mesh: Trimesh) -> tuple[float, float, float]:
    x, y, z = (float(e) for e in mesh.extents)
    return x, y, z
