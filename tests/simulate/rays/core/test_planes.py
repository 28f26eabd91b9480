"""Planes of fine meshes, found without comparing all pairs of triangles, and the image method: where they reflect."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from trimesh import Trimesh

from scenes.places.built_in import lab
from scenes.scene.shapes import box, sheet
from simulate.rays.core.image_method import Combination, Mirrors, on_device
from simulate.rays.core.planes import BLOCK, Planes
from simulate.rays.core.ray_tracer import dr, mi
from simulate.rays.core.reflection_chains import Images


def fine_sheet(count: int, kept: float = 1.0) -> Trimesh:
    """A sheet of 3 m × 3 m in the plane z = 0, of 2 count² triangles, of which a share is kept at random."""
    x, y = np.meshgrid(*2 * [np.linspace(0, 3, count + 1)], indexing="ij")
    first = (np.arange(count)[:, None] * (count + 1) + np.arange(count)).ravel()
    up, right = first + 1, first + count + 1
    faces = np.concatenate([np.stack([first, right, right + 1], axis=1), np.stack([first, right + 1, up], axis=1)])
    faces = faces[np.random.default_rng(0).random(len(faces)) < kept]
    return Trimesh(np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1), faces, process=False)


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
def test_triangles_of_a_fine_mesh_are_not_compared_in_pairs(make_scene, turned):
    """25,000 of them would make 300 million pairs. A slanted mesh in single precision is flat to a micrometre only."""
    mesh = fine_sheet(112)
    vertices = Rotation.from_euler("xy", [turned, turned / 2], degrees=True).apply(mesh.vertices)
    mesh = Trimesh(vertices.astype(np.float32), mesh.faces, process=False)
    found = Planes(make_scene(("floor", mesh, "concrete")), [0])
    assert len(found.normals) == 1


def test_surfaces_are_known_from_gaps(make_scene):
    """Against all triangles one by one, at points of the plane inside and beside a sheet with a thousand gaps."""
    mesh = fine_sheet(40, kept=0.7)
    found = Planes(make_scene(("floor", mesh, "concrete")), [0])
    assert len(found.boxes) == -(-len(mesh.faces) // BLOCK) and len(found.normals) == 1
    points = np.random.default_rng(1).uniform(-0.2, 3.2, (500, 3)) * [1, 1, 0]
    sides = found.sides
    inside = ((sides[:, :, :3] @ points.T) >= sides[:, :, 3:]).all(axis=1)
    up = np.array([0, 0, 1])
    plane, under, over = dr.zeros(mi.UInt, 500), on_device(points - up), on_device(points + up)
    hit, face, _ = Mirrors(found).reflection(plane, under, over, 0.0, mi.Bool(True))
    hit, triangle = hit.numpy(), np.argsort(found.faces)[face.numpy()]
    assert hit.tolist() == inside.any(axis=0).tolist() and 0.3 < hit.mean() < 0.7
    assert inside[triangle[hit], np.flatnonzero(hit)].all()


def possible_paths(planes, chains, sources, targets):
    """The images, and the target, chain and source of every possible path."""
    images = Images(Mirrors(planes), chains, sources)
    size = len(chains), len(sources)
    every = Combination.of(dr.arange(mi.UInt, len(targets) * len(chains) * len(sources)), *size)
    return images, Combination.of(dr.compress(images.possible(images.ends_of(targets), every)), *size)


def test_reflections_lie_on_their_planes_at_equal_angles():
    """In the lab: every way is as long as the straight line from the last image."""
    scene = lab()
    planes = Planes(scene, list(range(len(scene.objects))))
    generator = np.random.default_rng(0)
    chains = generator.integers(len(planes.normals), size=(20_000, 2))
    sources, targets = np.array([scene.gateway.position]), generator.uniform(*scene.transmitter.region, (5, 3))
    images, paths = possible_paths(planes, chains, sources, targets)
    target, chain, _ = (each.numpy() for each in paths)
    assert len(target) > 20
    ways = images.ways(on_device(targets), paths)
    vertices = np.stack([each.numpy() for each in ways.vertices])
    points = np.concatenate([np.repeat(sources.T[None], len(target), axis=2), vertices, targets[target].T[None]])
    chain = chains[chain].T
    normals = planes.normals[chain].transpose(0, 2, 1)
    np.testing.assert_allclose((vertices * normals).sum(axis=1), planes.offsets[chain], atol=2e-6)
    steps = np.diff(points, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    units = steps / lengths[:, None]
    before, behind = (units[:-1] * normals).sum(axis=1), (units[1:] * normals).sum(axis=1)
    legs = lengths.min(axis=0) > 0.05  # vertices are in single precision
    np.testing.assert_allclose(before[:, legs], -behind[:, legs], atol=1e-4)
    np.testing.assert_allclose(ways.travelled.numpy(), lengths.sum(axis=0), rtol=1e-6)
    assert (planes.of_face[np.stack([face.numpy() for face in ways.faces])] == chain).all()


@pytest.fixture(scope="module")
def mirror(make_scene):
    """A 2 m × 2 m sheet in the plane x = −3, centred on (−3, 0, 1)."""
    return Planes(make_scene(("mirror", sheet((-3, -1, 0), (0, 2, 0), (0, 0, 2)), "concrete")), [7])


def test_nothing_behind_a_mirror_sees_itself_in_it(mirror):
    source, target = np.array([[0.0, 0.0, 1.0]]), np.array([[-4.0, 0.5, 1.0]])
    assert not dr.width(possible_paths(mirror, np.array([[0]]), source, target)[1].target)


@pytest.mark.parametrize("y, expected", [(1.66, True), (1.67, False)])
def test_reflection_beyond_the_edge_is_none(mirror, y, expected):
    """From the origin to (−1, y): reflected at three fifths of y, and the sheet ends at 1 m."""
    _, found = possible_paths(mirror, np.array([[0]]), np.array([[0.0, 0.0, 1.0]]), np.array([[-1.0, y, 1.0]]))
    assert dr.width(found.target) == expected
