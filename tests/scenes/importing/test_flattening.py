"""Scanned walls become planes, which meet; what is curved, open or exactly flat stays as it is."""

import numpy as np
import pytest
import trimesh
from trimesh import Trimesh
from trimesh.remesh import subdivide_to_size

from scenes.checks.occupancy import crosses
from scenes.importing.flat_polygons import _cut
from scenes.importing.flattening import flattened
from scenes.places.built_in import BUILT_IN
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.materials import p2040_materials
from scenes.scene.orientation import facing
from scenes.scene.shapes import box, sheet, union

NOISE = 0.006  # metres, of each coordinate


def scan(mesh: Trimesh, edge: float = 0.1, noise: float = NOISE) -> Trimesh:
    vertices, faces = subdivide_to_size(mesh.vertices, mesh.faces, edge)
    fine = Trimesh(vertices, faces)
    return Trimesh(fine.vertices + np.random.default_rng(1).normal(0, noise, fine.vertices.shape), fine.faces)


def scene_of(**meshes: Trimesh) -> Scene:
    return Scene(
        name="scan",
        frequency=2.4e9,  # λ/16 is 7.8 mm
        gateway=Gateway((0.5, 2.0, 1.5), facing((1, 0, 0))),
        transmitter=Transmitter((2.0, 1.0, 0.5), (2.5, 1.5, 1.5)),
        objects=tuple(SceneObject(name, mesh, "concrete") for name, mesh in meshes.items()),
        materials=p2040_materials(["concrete"], 2.4e9),
    )


def without(mesh: Trimesh, point: tuple[float, float, float], radius: float) -> Trimesh:
    """The mesh with a hole."""
    mesh.update_faces(np.linalg.norm(mesh.triangles_center - point, axis=1) > radius)
    return mesh


def room() -> Trimesh:
    """A closed room of 3 x 2.5 x 2.4 m that is seen from inside, with a cupboard and holes in a wall and a corner."""
    walls = box((0, 0, 0), (3, 2.5, 2.4))
    walls.invert()
    walls = without(without(scan(walls), (1.5, 0, 1.2), 0.15), (0, 2.5, 0), 0.15)
    return union(walls, scan(box((2, 1.7, 0.5), (2.8, 2.3, 1.5))))


def test_a_scanned_room_becomes_planes_from_which_no_ray_escapes():
    found = flattened(scene_of(room=room()), None)
    (item,) = found.scene.objects
    mesh = item.mesh
    assert len(mesh.faces) < 60 and mesh.is_watertight and "12 planes within 7.81 mm (λ/16)" in found.sentence
    assert "2 holes" in found.sentence and item.material == "concrete"
    assert mesh.area == pytest.approx(2 * (3 * 2.5 + 5.5 * 2.4) + 2 * (0.8 * 0.6 + 1.4 * 1.0), rel=0.005)
    axes = np.abs(mesh.face_normals[mesh.area_faces > 0.05]).max(axis=1)
    assert axes.min() > np.cos(np.radians(0.5))
    rays = np.random.default_rng(2).normal(size=(20_000, 3))
    starts = np.tile([1.0, 1.0, 1.0], (len(rays), 1))
    ends = starts + 9 * rays / np.linalg.norm(rays, axis=1, keepdims=True)
    assert np.any([crosses(starts, ends, triangle) for triangle in mesh.triangles], axis=0).all()


@pytest.mark.parametrize("shift", [-2e-4, -1e-12, 0, 1e-12, 2e-4])
def test_a_hole_that_touches_the_outline_is_cut_out_whatever_the_rounding(shift):
    outline = [(0, 0), (2, 0), (2 + shift, 1), (2, 2), (0, 2)]
    plane = np.array([*outline, (1.9, 0.9), (1.8, 1), (1.9, 1.1)], float)
    cut = _cut([np.arange(5), np.array([2, 5, 6, 7])], plane)
    one, two = plane[cut[:, 1]] - plane[cut[:, 0]], plane[cut[:, 2]] - plane[cut[:, 0]]
    areas = (one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]) / 2
    assert areas.min() >= 0 and areas.sum() == pytest.approx(4 + shift - (0.02 + 0.1 * shift))


def test_walls_of_two_objects_meet():
    whole = scan(union(sheet((0, 0, 0), (3, 0, 0), (0, 3, 0)), sheet((0, 0, 0), (0, 3, 0), (0, 0, 2))))
    floor = whole.triangles_center[:, 0] > whole.triangles_center[:, 2]
    parts = [whole.submesh([np.flatnonzero(which)], append=True, repair=False) for which in (floor, ~floor)]
    objects = flattened(scene_of(floor=parts[0], wall=parts[1]), None).scene.objects
    corners = [set(map(tuple, item.mesh.vertices.round(9).tolist())) for item in objects]
    common = sorted(corner[1] for corner in corners[0] & corners[1])
    assert np.ptp(common) == pytest.approx(3, abs=0.03)
    assert len(common) == sum(corner[0] < 0.05 for corner in corners[0])


def test_openings_stay():
    wall = scan(sheet((0, 0, 0), (4, 0, 0), (0, 0, 2.5), openings=[(1, 1.9, 0, 2), (2.5, 3.1, 1, 1.6)]), edge=0.05)
    found = flattened(scene_of(wall=without(wall, (0.5, 0, 0.5), 0.2)), None)
    assert found.scene.objects[0].mesh.area == pytest.approx(10 - 1.8 - 0.36, rel=0.01) and "1 holes" in found.sentence


def test_both_sides_of_a_board_stay():
    board = scan(box((0, 0, 0), (1, 0.03, 1)), edge=0.03, noise=0.002)
    mesh = flattened(scene_of(board=board), None).scene.objects[0].mesh
    large = mesh.area_faces > 0.1
    assert sorted(mesh.face_normals[large][:, 1].round(2).tolist()) == [-1, -1, 1, 1]
    assert np.ptp(mesh.triangles_center[large][:, 1]) == pytest.approx(0.03, abs=0.001)


def test_a_curved_surface_stays():
    pillar = scan(trimesh.creation.cylinder(0.4, 2.0, sections=48), edge=0.12, noise=0.003)
    found = flattened(scene_of(pillar=pillar), None)
    assert "in 2 planes within 7.81 mm (λ/16): 1 of" in found.sentence  # only its ends, 2 π 0.4² m²


def test_meshes_that_were_drawn_are_not_changed():
    drawn = [
        scan(box((0, 0, 0), (3, 3, 2)), noise=0.0),
        scan(trimesh.creation.cylinder(0.4, 2.0, sections=48), edge=0.12, noise=0.0),
        scan(sheet((0, 0, 0), (100, 0, 0), (0, 100, 0)), edge=6),  # terrain
    ]
    assert [flattened(scene_of(body=mesh), None) for mesh in drawn] == [None] * 3
    assert [flattened(make(), None) for make in BUILT_IN.values()] == [None] * len(BUILT_IN)
