"""Where the slabs of a scene's surfaces lie, and what both solvers of paths make of them."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from trimesh import Trimesh

from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.materials import RadioMaterial
from scenes.scene.orientation import facing
from scenes.scene.shapes import box, sheet
from simulate.rays.core.propagation import Propagation
from simulate.rays.core.ray_scene import RayScene
from simulate.rays.core.ray_tracer import mi
from simulate.rays.core.slabs import face_slabs
from simulate.rays.core.surfaces import Surfaces


def open_box(low: tuple[float, ...], high: tuple[float, ...]) -> Trimesh:
    """A box without its upper side, whose hole trimesh would fill."""
    closed = box(low, high)
    return Trimesh(closed.vertices, closed.faces[closed.face_normals[:, 2] < 0.5], process=False)


STONE, METAL = RadioMaterial("stone", 4.0, 0.02, 0.05), RadioMaterial("metal", 1.0, 1e7, 0.002)
OBJECTS = {
    "floor": SceneObject("floor", sheet((0, 0, 0), (4, 0, 0), (0, 4, 0)), "stone"),
    "floor upside down": SceneObject("floor", sheet((0, 0, 0), (0, 4, 0), (4, 0, 0)), "stone"),
    "shelf": SceneObject("shelf", sheet((0.5, 3, 1), (1, 0, 0), (0, 0.3, 0)), "stone", 0.03),
    "chest": SceneObject("chest", box((3, 3, 0.01), (3.5, 3.5, 1)), "stone"),
    "open chest": SceneObject("open chest", open_box((3, 3, 0.5), (3.5, 3.5, 1)), "stone"),
    "closed room": SceneObject("closed room", box((0, 0, 0), (4, 4, 3)), "stone"),
    "locker": SceneObject("locker", box((3, 0.5, 0.01), (3.5, 1, 1)), "metal"),
}


def scene_of(*names: str) -> Scene:
    gateway = Gateway((0.5, 2, 1.5), facing((1, 0, 0)))
    region = Transmitter((1.5, 1.5, 0.6), (2.5, 2.5, 1.4))
    objects = tuple(OBJECTS[name] for name in names)
    return Scene("room", 915e6, gateway, region, objects, {"stone": STONE, "metal": METAL})


@pytest.mark.parametrize(
    ("name", "fronts"),
    [
        ("floor", (0, 0.05)),
        ("floor upside down", (0.05, 0)),
        ("shelf", (0.015, 0.015)),
        ("chest", (0, 0.05)),
        ("open chest", (0.025, 0.025)),
        ("locker", (0, 0)),
        ("closed room", (0.05, 0)),
    ],
)
def test_slab_of_a_surface_lies_behind_outer_walls_inside_bodies_and_around_sheets(name, fronts):
    beside = {"floor": {"shelf", "locker"}, "open": {"floor", "shelf", "locker"}, "closed": set()}
    names = beside.get(name.split()[0], {"floor", "shelf", "chest", "locker"})
    scene = scene_of(*sorted({*names, name}))
    number = [item.name for item in scene.objects].index(OBJECTS[name].name)
    of = RayScene.of(scene, Propagation()).object_of_face == number
    found = face_slabs(scene)
    np.testing.assert_allclose(found.fronts[of], np.tile(fronts, (of.sum(), 1)), atol=1e-12)
    if name in ("floor", "shelf", "closed room"):
        assert (found.outer[of] == (name != "shelf")).all()


def test_a_turned_room_has_its_slabs_where_they_were():
    scene = scene_of("floor", "shelf", "chest", "locker")
    rotation = Rotation.from_euler("zx", (30, 20), degrees=True)
    matrix = np.eye(4)
    matrix[:3, :3] = rotation.as_matrix()
    turned = replace(
        scene,
        objects=tuple(replace(item, mesh=item.mesh.copy().apply_transform(matrix)) for item in scene.objects),
        gateway=replace(scene.gateway, position=tuple(rotation.apply(scene.gateway.position))),
        transmitter=Transmitter(*(tuple(rotation.apply((2, 2, 1)) + side) for side in (-0.2, 0.2))),
    )
    np.testing.assert_allclose(face_slabs(turned).fronts, face_slabs(scene).fronts, atol=1e-9)


def test_coefficients_on_edges_and_patches_have_the_same_phases():
    """A wave down on the chest, and one up from within it: reflected at the top of its lid, or at the bottom of it."""
    ray_scene = RayScene.of(scene_of("floor", "shelf", "chest", "locker"), Propagation())
    lid = int(np.nonzero((ray_scene.object_of_face == 2) & (ray_scene.normals[:, 2] > 0.5))[0][0])
    way = np.array([0.6, 0, -0.8])
    surfaces = Surfaces(ray_scene)
    down, up = (
        [complex(*(float(part[0]) for part in (each.real, each.imag))) for each in found]
        for found in (surfaces.coefficients(mi.UInt(lid), mi.Vector3f(*map(float, sign * way))) for sign in (1, -1))
    )
    turn = 2 * np.pi / ray_scene.description.wavelength * 0.8 * STONE.thickness
    np.testing.assert_allclose(np.array(up[:2]) / down[:2], np.exp(2j * turn), rtol=1e-4)
    np.testing.assert_allclose(up[2:], down[2:], rtol=1e-5)
    # By the transmission-line matrix of the slab, for an electric field across the plane of incidence.
    n2 = STONE.relative_permittivity - 1j * STONE.conductivity / (2 * np.pi * 915e6 * 8.8541878128e-12)
    inside = np.sqrt(n2 - 0.36)
    delta = turn / 0.8 * inside
    denominator = 2 * np.cos(delta) + 1j * np.sin(delta) * (inside / 0.8 + 0.8 / inside)
    np.testing.assert_allclose(down[2], 2 / denominator * np.exp(1j * turn), rtol=1e-4)
