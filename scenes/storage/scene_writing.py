"""Write a scene to a folder, scene.yaml and meshes."""

from __future__ import annotations

import os
import re
from collections import Counter
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from trimesh import Trimesh

from scenes.checks.validation import validate
from scenes.files.atomic import temporary_folder, write_atomically
from scenes.files.errors import InputError, require_instance, require_path
from scenes.files.input_file import require_regular
from scenes.files.json_yaml_xml import PlainDumper, plain_values
from scenes.files.long_work import doing
from scenes.files.output_folder import locked
from scenes.scene.antennas import stated
from scenes.scene.description import Scene
from scenes.scene.materials import RadioMaterial, p2040_source

SECONDS = 2e-4  # What it takes to write a mesh of a few triangles

LONGEST_STEM = 60
"""Most characters of a file's name without its suffix. At four bytes each, every file system accepts that many."""


def write_scene(scene: Scene, folder: str | Path) -> Path:
    """Write a scene to a folder, as a YAML file and a mesh for each object.

    The files are ``scene.yaml`` and ``meshes/NAME.ply``. ``load_scene`` reads back an equal scene, and the same scene
    always gives the same bytes. The YAML file is written last and atomically, so a folder with a ``scene.yaml`` is
    complete. Existing meshes with the same content are kept.

    Args:
        scene: the scene.
        folder: output folder, created if it does not exist. It must not contain a ``scene.yaml``, nor meshes of the
            same names with other content.

    Returns:
        Path of the YAML file.

    Raises:
        InputError: the scene has an invalid value, another process is writing to the folder, or files would be
            replaced. In the last case nothing is written.

    Example:
        >>> import bisplat
        >>> path = bisplat.write_scene(bisplat.load_scene("closet"), "closet")
        >>> path.as_posix()
        'closet/scene.yaml'
        >>> bisplat.load_scene(path) == bisplat.load_scene("closet")
        True
    """
    require_instance(Scene, scene=scene)
    require_path(folder=folder)
    folder = Path(folder)
    path = folder / "scene.yaml"
    validate(scene, str(path))
    meshes = {folder / name: item.mesh for name, item in zip(_mesh_names(scene), scene.objects, strict=True)}
    with locked(folder):
        found = [file for file in (path, *meshes) if os.path.lexists(file)]
        for file in found:
            require_regular(file, "a file or nothing", 2**63)
        kept = {file for file in found if file in meshes and _holds(file, _ply_of(meshes[file]))}
        if in_the_way := [file for file in found if file not in kept]:
            others = f" (and {len(in_the_way) - 1} more)" if len(in_the_way) > 1 else ""
            raise InputError(
                f"{in_the_way[0]}: expected no file of this name, found one{others}; existing files are never "
                "overwritten, so give another folder"
            )
        doing(f"{scene.name}: writing {len(meshes):,} meshes", len(meshes) * SECONDS)
        with temporary_folder(folder) as unfinished:
            written = {unfinished / str(number): file for number, file in enumerate(meshes.keys() - kept)}
            for temporary, file in written.items():
                temporary.write_bytes(_ply_of(meshes[file]))
            os.sync()  # once for all, since a disk takes long for each of thousands of files
            (folder / "meshes").mkdir(exist_ok=True)
            for temporary, file in written.items():
                temporary.replace(file)
        write_atomically(path, _yaml_of(scene))
    doing("")
    return path


def file_stem(name: str) -> str:
    """Make a name from a file safe as the name of another file: without slashes and other special characters."""
    return re.sub(r"[^\w.-]+", "_", name).strip(".")[:LONGEST_STEM].strip(".") or "object"


def _mesh_names(scene: Scene) -> list[str]:
    """Return the mesh file of each object, relative to the folder. No two are equal, even if case is ignored."""
    names: list[str] = []
    used: set[str] = set()
    count = Counter[str]()
    for item in scene.objects:
        first = stem = file_stem(item.name)
        count[first.casefold()] += 1
        while stem.casefold() in used:  # names that differ only in case or punctuation
            stem = f"{first}_{count[first.casefold()]}"
            count[first.casefold()] += 1
        used.add(stem.casefold())
        names.append(f"meshes/{stem}.ply")
    return names


def _yaml_of(scene: Scene) -> bytes:
    """Return the content of scene.yaml. Materials that no object has are left out, as reading leaves them out."""
    used = {item.material for item in scene.objects}
    further = {name: stated(gateway) for name, gateway in scene.further_gateways.items()}
    values = {
        "name": scene.name,
        "frequency": scene.frequency,
        "gateway": stated(scene.gateway),
        **({"further_gateways": further} if further else {}),
        "transmitter": stated(scene.transmitter),
        "materials": {
            name: _material_entry(material, scene.frequency)
            for name, material in scene.materials.items()
            if name in used
        },
        "objects": [
            {"name": item.name, "mesh": mesh, "material": item.material}
            | ({} if item.thickness is None else {"thickness": item.thickness})
            for item, mesh in zip(scene.objects, _mesh_names(scene), strict=True)
        ],
    }
    style: dict[str, Any] = {"sort_keys": False, "default_flow_style": None, "allow_unicode": True}
    return yaml.dump(plain_values(values), Dumper=PlainDumper, width=110, **style).encode()


def _material_entry(material: RadioMaterial, frequency: float) -> dict[str, Any]:
    """The keys of a material. One of P.2040 is named, so that it follows when the scene's frequency is changed."""
    keys = {key: value for key, value in asdict(material).items() if key not in ("name", "frequency")}
    source = p2040_source(material, frequency)
    if source is None:
        return keys | {"frequency": material.frequency or frequency}
    del keys["relative_permittivity"], keys["conductivity"]
    return {"p2040": source} | keys


def _ply_of(mesh: Trimesh) -> bytes:
    """Return binary PLY in double precision. trimesh's writer rounds to single, which would change the scene."""
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(mesh.vertices)}\nproperty double x\nproperty double y\nproperty double z\n"
        f"element face {len(mesh.faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    faces = np.zeros(len(mesh.faces), dtype=[("count", "<u1"), ("index", "<i4", 3)])
    faces["count"], faces["index"] = 3, mesh.faces
    return header.encode() + np.asarray(mesh.vertices, dtype="<f8").tobytes() + faces.tobytes()


def _holds(path: Path, content: bytes) -> bool:
    """Whether a file, which need not fit into memory, has this content."""
    return path.stat().st_size == len(content) and path.read_bytes() == content
