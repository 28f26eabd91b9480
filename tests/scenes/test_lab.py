"""The built-in laboratory is what its docstring says."""

from itertools import combinations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scenes import load_scene
from scenes.description import validate
from scenes.occupancy import inside_object

SHELL = ("floor", "ceiling", "wall", "window", "door")


@pytest.fixture(scope="module")
def lab():
    return load_scene("lab")


def test_valid_and_furnished(lab):
    validate(lab, "lab")
    furniture = [o for o in lab.objects if not o.name.startswith(SHELL)]
    assert len(furniture) >= 12
    assert all(o.mesh.is_watertight and o.mesh.volume > 0 for o in furniture)
    assert set(lab.materials) == {o.material for o in lab.objects}
    np.testing.assert_allclose(np.ptp(lab.bounds, axis=0), [8, 6, 3], atol=0.06)


def test_gateway_looks_along_minus_x_with_y_up(lab):
    x, y, z = Rotation.from_quat(lab.gateway.orientation).as_matrix().T
    np.testing.assert_allclose([x, y, z], [[0, -1, 0], [0, 0, 1], [-1, 0, 0]], atol=0.06)


def test_region_is_free_and_in_front_of_the_gateway(lab):
    low, high = lab.transmitter.region_min, lab.transmitter.region_max
    np.testing.assert_allclose(np.subtract(high, low), [1.6, 1.3, 0.9])
    points = np.random.default_rng(0).uniform(low, high, (3000, 3))
    inside = inside_object(lab, points)
    assert 0 < inside.mean() < 0.1  # the monitor reaches into it
    assert 4 < np.linalg.norm(points.mean(axis=0) - lab.gateway.position) < 5


def crossed(start, ends, triangles):
    """Whether each segment start -> end meets a triangle: Möller and Trumbore (1997)."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    d = (ends - start)[:, None]
    p = np.cross(d, c - a)
    det = np.sum((b - a) * p, axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        u = np.sum((start - a) * p, axis=-1) / det
        q = np.cross(start - a, b - a)
        v = np.sum(d * q, axis=-1) / det
        t = np.sum((c - a) * q, axis=-1) / det
    return np.any((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & (t < 1), axis=1)


def test_mostly_but_not_only_line_of_sight(lab):
    region = lab.transmitter
    points = np.random.default_rng(0).uniform(region.region_min, region.region_max, (500, 3))
    triangles = np.concatenate([o.mesh.triangles for o in lab.objects])
    shadowed = crossed(np.array(lab.gateway.position), points, triangles).mean()
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


def test_nothing_coplanar_overlaps(lab):
    """Surfaces that coincide are hit in an arbitrary order."""
    for first, second in combinations(lab.objects, 2):
        if np.any(first.mesh.bounds[0] > second.mesh.bounds[1] + 1e-3):
            continue
        if np.any(second.mesh.bounds[0] > first.mesh.bounds[1] + 1e-3):
            continue
        for a in first.mesh.triangles:
            for b in second.mesh.triangles:
                assert not overlap(a, b), f"{first.name} and {second.name}"


def test_every_call_gives_the_same_room(lab):
    assert load_scene("lab") == lab
