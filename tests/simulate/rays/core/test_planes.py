"""Planes of fine meshes: found without comparing all pairs of triangles, and searched in blocks."""

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation
from trimesh import Trimesh

from scenes.scene.shapes import box, sheet
from simulate.rays.core import planes as module
from simulate.rays.core.image_method import on_surface
from simulate.rays.core.planes import BLOCK, Planes


def fine_sheet(count: int, kept: float = 1.0) -> Trimesh:
    """A sheet of 3 m × 3 m in the plane z = 0, of 2 count² triangles, of which a share is kept at random."""
    x, y = np.meshgrid(*2 * [np.linspace(0, 3, count + 1)], indexing="ij")
    first = (np.arange(count)[:, None] * (count + 1) + np.arange(count)).ravel()
    up, right = first + 1, first + count + 1
    faces = np.concatenate([np.stack([first, right, right + 1], axis=1), np.stack([first, right + 1, up], axis=1)])
    faces = faces[np.random.default_rng(0).random(len(faces)) < kept]
    return Trimesh(np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1), faces, process=False)


@pytest.fixture
def compared(monkeypatch):
    """Numbers of pairs of planes that were found close to each other."""
    counts = []

    class Tree(cKDTree):
        def query_pairs(self, *args, **options):
            found = super().query_pairs(*args, **options)
            counts.append(len(found))
            return found

    monkeypatch.setattr(module, "cKDTree", Tree)
    return counts


def test_planes_are_numbered_by_their_first_triangles(make_scene):
    """A box has six planes; sheets in the plane of its top, in either direction, have no plane of their own."""
    top = sheet((4, 0, 1), (1, 0, 0), (0, 1, 0))
    under = sheet((6, 0, 1), (0, 1, 0), (1, 0, 0))
    above = sheet((6, 0, 1.001), (1, 0, 0), (0, 1, 0))
    objects = (("crate", box((0, 0, 0), (1, 1, 1))), ("top", top), ("under", under), ("above", above))
    found = Planes(make_scene(*((name, mesh, "concrete") for name, mesh in objects)), [0, 1, 2, 3])
    labels = found.of_face
    assert [int(label) for label in dict.fromkeys(labels.tolist())] == list(range(7))
    (of_top,) = {int(labels[number]) for number in range(12) if objects[0][1].face_normals[number, 2] > 0.5}
    assert labels[12:].tolist() == [of_top] * 4 + [6, 6]


@pytest.mark.parametrize("turned", [0, 25])
def test_triangles_of_a_fine_mesh_are_not_compared_in_pairs(make_scene, compared, turned):
    """25,000 of them would make 300 million pairs. A slanted mesh in single precision is flat to a micrometre only."""
    mesh = fine_sheet(112)
    vertices = Rotation.from_euler("xy", [turned, turned / 2], degrees=True).apply(mesh.vertices)
    mesh = Trimesh(vertices.astype(np.float32), mesh.faces, process=False)
    found = Planes(make_scene(("floor", mesh, "concrete")), [0])
    assert len(found.normals) == 1 and compared[0] < 10_000


def test_surfaces_are_known_from_gaps(make_scene):
    """Against all triangles one by one, at points of the plane inside and beside a sheet with a thousand gaps."""
    mesh = fine_sheet(40, kept=0.7)
    found = Planes(make_scene(("floor", mesh, "concrete")), [0])
    assert len(found.boxes) == -(-len(mesh.faces) // BLOCK) and len(found.normals) == 1
    points = np.random.default_rng(1).uniform(-0.2, 3.2, (500, 3)) * [1, 1, 0]
    sides = found.sides
    inside = ((sides[:, :, :3] @ points.T) >= sides[:, :, 3:]).all(axis=1)
    hit = np.array([on_surface(found.arrays, 0, *point) for point in points])
    assert (hit >= 0).tolist() == inside.any(axis=0).tolist() and 0.3 < (hit >= 0).mean() < 0.7
    assert inside[hit[hit >= 0], np.flatnonzero(hit >= 0)].all()
