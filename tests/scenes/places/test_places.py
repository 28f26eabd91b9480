"""The built-in places are what their docstrings say."""

from itertools import combinations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scenes.checks.occupancy import crosses, inside_object
from scenes.checks.validation import validate
from scenes.places.built_in import BUILT_IN
from scenes.storage.scene_yaml import load_scene

SHELL = ("floor", "ceiling", "wall", "window", "door")


@pytest.fixture(scope="module")
def lab():
    return load_scene("lab")


@pytest.fixture(scope="module", params=BUILT_IN)
def place(request):
    return load_scene(request.param)


@pytest.mark.parametrize(
    "name, size",
    [
        ("lab", (8, 6, 3)),
        ("conference", (10, 6, 2.8)),
        ("bedroom", (4.4, 3.6, 2.5)),
        ("office", (16, 10, 2.8)),
        ("closet", (3, 2.5, 2.4)),
        ("workshop", (3.4, 2.8, 2.4)),
    ],
)
def test_size(name, size):
    np.testing.assert_allclose(np.ptp(load_scene(name).bounds, axis=0), size, atol=0.11)


def test_valid_and_furnished(place):
    validate(place, place.name)
    furniture = [o for o in place.objects if not o.name.startswith(SHELL)]
    assert len(place.objects) - len(furniture) >= 6
    assert len(furniture) >= (4 if place.name == "closet" else 8)
    assert set(place.materials) == {o.material for o in place.objects}
    solids = [o.mesh for o in furniture if o.mesh.is_watertight]
    assert all(mesh.volume > 0 for mesh in solids)


def test_every_surface_is_about_a_wavelength_or_more(place):
    """Geometric optics says nothing of smaller ones. A face: triangles of one plane that share edges."""
    for item in place.objects:
        for facet, area in zip(item.mesh.facets, item.mesh.facets_area, strict=True):
            corners = item.mesh.triangles[facet].reshape(-1, 3)
            longest = max(np.linalg.norm(corners[:, None] - corners, axis=-1).max(), 1e-9)
            assert area / longest > 0.5 * place.wavelength, item.name


def test_gateway_looks_at_the_region_and_nobody_stands_in_anything(place):
    low, high = place.transmitter.region_min, place.transmitter.region_max
    points = np.random.default_rng(0).uniform(low, high, (2000, 3))
    assert inside_object(place, points).mean() < 0.1
    boresight = Rotation.from_quat(place.gateway.orientation).apply([0, 0, 1])
    towards = points - place.gateway.position
    angle = np.degrees(np.arccos(towards @ boresight / np.linalg.norm(towards, axis=1)))
    assert angle.max() < 75


def test_gateway_looks_along_minus_x_with_y_up(lab):
    x, y, z = Rotation.from_quat(lab.gateway.orientation).as_matrix().T
    np.testing.assert_allclose([x, y, z], [[0, -1, 0], [0, 0, 1], [-1, 0, 0]], atol=0.06)


def test_region_is_as_large_and_far_as_that_of_nerf2(lab):
    low, high = lab.transmitter.region_min, lab.transmitter.region_max
    np.testing.assert_allclose(np.subtract(high, low), [1.6, 1.3, 0.9])
    assert 4 < np.linalg.norm(np.add(low, high) / 2 - lab.gateway.position) < 5


def test_mostly_but_not_only_line_of_sight(lab):
    region = lab.transmitter
    points = np.random.default_rng(0).uniform(region.region_min, region.region_max, (500, 3))
    triangles = np.concatenate([o.mesh.triangles for o in lab.objects])
    gateway = np.array(lab.gateway.position)
    shadowed = np.any([crosses(gateway, points, triangle) for triangle in triangles], axis=0).mean()
    assert 0.1 < shadowed < 0.4


def overlap(first, second):
    """Whether two triangles in one plane share an area (more than an edge): the separating axes in it."""
    normal = np.cross(first[1] - first[0], first[2] - first[0])
    normal /= np.linalg.norm(normal)
    if np.abs((second - first[0]) @ normal).max() > 1e-3:
        return False
    for triangle in (first, second):
        for k in range(3):
            axis = np.cross(normal, triangle[k - 1] - triangle[k])
            axis /= np.linalg.norm(axis)
            a, b = first @ axis, second @ axis
            if a.max() < b.min() + 1e-6 or b.max() < a.min() + 1e-6:
                return False
    return True


def test_nothing_coplanar_overlaps(place):
    """Surfaces that coincide are hit in an arbitrary order."""
    for first, second in combinations(place.objects, 2):
        if np.any(first.mesh.bounds[0] > second.mesh.bounds[1] + 1e-3):
            continue
        if np.any(second.mesh.bounds[0] > first.mesh.bounds[1] + 1e-3):
            continue
        for a in first.mesh.triangles:
            for b in second.mesh.triangles:
                assert not overlap(a, b), f"{first.name} and {second.name}"


def test_every_call_gives_the_same_place(place):
    assert load_scene(place.name) == place
