"""Solids are closed with normals outwards; sheets have the area they should."""

import numpy as np
import pytest

from scenes.files.errors import ParameterError
from scenes.scene.shapes import box, rotate, sheet, union


def test_box():
    mesh = box((1, 2, 3), (2, 4, 6))
    assert mesh.is_watertight and mesh.volume == pytest.approx(6)
    np.testing.assert_allclose(mesh.bounds, [[1, 2, 3], [2, 4, 6]])


def test_sheet_normal_is_u_cross_v():
    mesh = sheet((0, 1, 0), (2, 0, 0), (0, 0, 3))
    assert mesh.area == pytest.approx(6)
    np.testing.assert_allclose(mesh.face_normals, [[0, -1, 0]] * 2)


def test_sheet_openings_are_holes():
    mesh = sheet((0, 0, 0), (8, 0, 0), (0, 0, 3), [(1, 2, 1, 2), (4, 6, 0, 2)])
    assert mesh.area == pytest.approx(24 - 1 - 4)
    centres = mesh.triangles_center[:, [0, 2]]
    assert not np.any(np.all((centres > [1, 1]) & (centres < [2, 2]), axis=1))
    assert not np.any(np.all((centres > [4, 0]) & (centres < [6, 2]), axis=1))


def test_union_keeps_every_part():
    mesh = union(box((0, 0, 0), (1, 1, 1)), box((2, 0, 0), (3, 1, 1)))
    assert len(mesh.faces) == 24 and mesh.volume == pytest.approx(2)


def test_turned_counterclockwise_as_seen_from_above():
    """The corner (3, 1) of a box around (2, 1.5) goes to (2, 1.5) + (cos 30° + 0.5 sin 30°, sin 30° − 0.5 cos 30°)."""
    mesh = rotate(box((1, 1, 0), (3, 2, 1)), 30)
    corner = np.array([2 + np.sqrt(0.75) + 0.25, 1.5 + 0.5 - np.sqrt(0.75) / 2, 0])
    assert np.linalg.norm(mesh.vertices - corner, axis=1).min() < 1e-9


@pytest.mark.parametrize(("width", "end"), [(0.1 + 0.2, 0.3), (4.0, 4 + 9e-7), (3.9999999999999996, 4.0)])
def test_an_opening_that_ends_at_the_edge_leaves_no_sliver(width, end):
    mesh = sheet((0, 0, 0), (width, 0, 0), (0, 0, 1), [(width / 3, end, 0.2, 1)])
    assert mesh.area_faces.min() > 0.01 and mesh.bounds[1, 0] == pytest.approx(width, abs=1e-12)


def test_sides_with_rounded_coordinates_are_perpendicular():
    assert sheet((0, 0, 0), (3.123, 1.457, 0), (-0.933, 2.0, 0)).area == pytest.approx(3.446 * 2.207, rel=1e-3)


@pytest.mark.parametrize(
    ("v", "openings", "expected"),
    [
        ((0, 0, 2.5), [(0, 4, 0, 2.5)], "openings: expected openings that leave something of the sheet, found"),
        ((1, 0, 2.5), (), "v: expected a vector perpendicular to u"),
    ],
)
def test_no_sheet_is_left_or_rectangular(v, openings, expected):
    with pytest.raises(ParameterError, match=expected):
        sheet((0, 0, 0), (4, 0, 0), v, openings)
