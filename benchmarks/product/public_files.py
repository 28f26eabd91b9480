"""Do public mesh files have the area and the volume that an independent reader finds?

python -m benchmarks.product.public_files --json

The files are the models of Debian's package assimp-testmodels and the largest mesh of each scene of Sionna RT. The
independent reader is assimp or, where assimp or its Python package fails, VTK (pip install vtk). The figures are the
area and the volume in the units of the files. The volume is the sum over the triangles of that of the tetrahedron with
the origin, which is the enclosed volume where the surface is closed. ``--table`` writes what the independent reader
found, with which tests/scenes/importing/test_public_files.py compares the import.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any

import assimp_py
import numpy as np
import tyro
from trimesh import Trimesh

from benchmarks.ledger.printing import print_figures
from scenes.files.errors import InputError
from scenes.importing.mesh_files import MESH_SUFFIXES, read_mesh_file
from scenes.importing.mitsuba_xml import SIONNA, sionna_scene

ASSIMP_MODELS = Path("/usr/share/assimp/models")

EXPLAINED = {
    "assimp/OBJ/box_longline.obj": "a face passes the same four corners 234 times, which we leave out",
    "assimp/OBJ/box_UTF16BE.obj": "neither assimp nor VTK reads UTF-16",
    "assimp/OBJ/concave_polygon.obj": "assimp and VTK leave out 5 and 70 % of a ring of 66 corners",
    "assimp/OBJ/space_in_material_name.obj": "the same ring",
}
"""Files that are not compared, and why."""


def files() -> Iterator[tuple[str, Path]]:
    """Yield the names and paths of the files that are there."""
    for path in sorted(ASSIMP_MODELS.rglob("*")):
        if path.suffix.lower() in MESH_SUFFIXES:
            yield f"assimp/{path.relative_to(ASSIMP_MODELS)}", path
    if find_spec("sionna") is not None:
        scenes = sionna_scene(f"{SIONNA}box").parents[1]
        for folder in sorted(scenes.iterdir()):
            meshes = sorted((folder / "meshes").glob("*.ply"), key=lambda path: path.stat().st_size)
            if meshes:
                yield f"sionna/{meshes[-1].relative_to(scenes)}", meshes[-1]


def by_assimp(path: Path) -> np.ndarray:
    """Triangles [t, 3, 3] in the world, read by assimp."""
    flags = assimp_py.Process_Triangulate | assimp_py.Process_PreTransformVertices | assimp_py.Process_SortByPType
    meshes = assimp_py.import_file(str(path), flags).meshes
    return np.concatenate(
        [
            np.reshape(mesh.vertices, (-1, 3)).astype(float)[np.reshape(mesh.indices, (-1, 3))]
            for mesh in meshes
            if mesh.num_indices == 3 * mesh.num_faces
        ]
    )


def by_vtk(path: Path) -> np.ndarray:
    """Triangles [t, 3, 3] in the world, read by VTK."""
    import vtk
    from vtk.util.numpy_support import vtk_to_numpy

    readers = {".obj": vtk.vtkOBJReader, ".ply": vtk.vtkPLYReader, ".stl": vtk.vtkSTLReader}
    reader = readers.get(path.suffix.lower(), vtk.vtkGLTFReader)()
    reader.SetFileName(str(path))
    reader.Update()
    surface, triangles = vtk.vtkGeometryFilter(), vtk.vtkTriangleFilter()
    if isinstance(reader, vtk.vtkGLTFReader):
        surface = vtk.vtkCompositeDataGeometryFilter()
    surface.SetInputConnection(reader.GetOutputPort())
    triangles.SetInputConnection(surface.GetOutputPort())
    triangles.PassLinesOff()
    triangles.PassVertsOff()
    triangles.Update()
    found = triangles.GetOutput()
    if not found.GetNumberOfPolys():
        return np.zeros((0, 3, 3))
    corners = vtk_to_numpy(found.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    return vtk_to_numpy(found.GetPoints().GetData()).astype(float)[corners]


READERS: dict[str, Callable[[Path], np.ndarray]] = {"assimp": by_assimp, "VTK": by_vtk}


def by_another(path: Path) -> tuple[str, np.ndarray] | None:
    """The name of the first other reader that reads the file, and its triangles."""
    for name, read in READERS.items():
        try:
            triangles = read(path)
        except (ImportError, OSError, RuntimeError, ValueError):
            continue
        if len(triangles):
            return name, triangles
    return None


def measured(triangles: np.ndarray) -> dict[str, Any]:
    """Area, volume, corners of the bounds, and whether the surface is closed."""
    first, second, third = np.moveaxis(triangles, 1, 0)
    mesh = Trimesh(triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3))
    return {
        "area": float(np.linalg.norm(np.cross(second - first, third - first), axis=1).sum() / 2),
        "volume": float(np.einsum("ti,ti->", first, np.cross(second, third)) / 6),
        "low": triangles.min(axis=(0, 1)).tolist(),
        "high": triangles.max(axis=(0, 1)).tolist(),
        "closed": bool(mesh.is_watertight),
    }


def main(
    table: Path | None = None,
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Compare the import of public files with an independent reader."""
    figures: dict[str, Any] = {}
    expected: dict[str, Any] = {}
    for name, path in [*files()][: 3 if smallest else None]:
        try:
            ours = measured(np.concatenate([part.mesh.triangles for part in read_mesh_file(path).parts]))
        except InputError as error:
            figures[name] = {"refused": str(error).replace(f"{path}: ", "")}
            continue
        found = by_another(path)
        if found is None or name in EXPLAINED:
            figures[name] = {"area": f"{ours['area']:.6g}", "not compared": EXPLAINED.get(name, "no other reader")}
            continue
        reader, triangles = found
        theirs = measured(triangles)
        expected[name] = {"sha256": hashlib.sha256(path.read_bytes()).hexdigest(), "reader": reader, **theirs}
        figures[name] = {"area": f"{ours['area']:.6g}", "area by the other": f"{theirs['area']:.6g}"}
        figures[name] |= {"volume": f"{ours['volume']:.6g}", "volume by the other": f"{theirs['volume']:.6g}"}
        figures[name] |= {"closed": "yes" if theirs["closed"] else "no", "the other": reader}
    if table is not None:
        rows = ",\n".join(f"{json.dumps(name)}: {json.dumps(row)}" for name, row in expected.items())
        table.write_text(f"{{\n{rows}\n}}\n")
    print_figures(figures, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
