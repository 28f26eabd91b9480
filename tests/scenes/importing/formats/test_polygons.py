"""Polygons are cut into triangles of the same area, which turn the same way and use all corners."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from trimesh import Trimesh

from scenes.importing.formats.polygons import Cut, cut_polygons
from scenes.scene.shapes import box

DOORWAY = [(0, 0), (2.5, 0), (2.5, 2.1), (3.5, 2.1), (3.5, 0), (6, 0), (6, 2.7), (0, 2.7)]
ARROW = [(0, 0), (2, -1), (0, 3), (-2, -1)]  # A quadrilateral with a notch at its first corner
WINDOW = [(0, 0), (4, 0), (4, 4), (0, 4), (0, 0), (1, 1), (1, 2), (2, 2), (2, 1), (1, 1)]
"""A square hole, joined to the outline by an edge that is passed twice."""
MIDPOINTS = [(1, 0), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2), (0, 1), (0, 0)]
SPIRAL = [(0, 0), (5, 0), (5, 5), (1, 5), (1, 2), (3, 2), (3, 3), (2, 3), (2, 4), (4, 4), (4, 1), (0, 1)]
BUTTERFLY = [(0, 0), (1, 1), (1, 0), (0, 3)]
EVEN_BUTTERFLY = [(0, 0), (1, 1), (1, 0), (0, 1)]
"""The halves have the same area and turn opposite ways."""
STAR = [(np.cos(4 * np.pi * k / 5), np.sin(4 * np.pi * k / 5)) for k in range(5)]
TWICE_AROUND = [(0, 0), (1, 0), (1, 1), (0, 1)] * 2

TURN = Rotation.from_euler("xyz", [80, 20, 50], degrees=True)


def upright(outline) -> np.ndarray:
    """The polygon of an outline, far from the origin, in a plane that is parallel to no axis."""
    flat = np.column_stack([outline, np.zeros(len(outline))])
    return TURN.apply(flat) + np.array([300, -200, 40])


def cut(*outlines: np.ndarray) -> tuple[Trimesh, Cut]:
    vertices = np.concatenate(outlines)
    result = cut_polygons(vertices, np.arange(len(vertices)), np.array([len(each) for each in outlines]), "a.obj")
    return Trimesh(vertices, result.triangles, process=False), result


@pytest.mark.parametrize("first", range(4))
@pytest.mark.parametrize("way", [1, -1])
@pytest.mark.parametrize(("outline", "area"), [(DOORWAY, 14.1), (ARROW, 6), (WINDOW, 15), (MIDPOINTS, 4), (SPIRAL, 15)])
def test_triangles_cover_the_polygon_and_no_more(outline, area, way, first):
    polygon = upright(np.roll(outline, first, axis=0)[::way])
    mesh, result = cut(polygon)
    assert mesh.area == pytest.approx(area)
    assert len(mesh.faces) == len(outline) - 2 and set(mesh.faces.ravel()) == set(range(len(outline)))
    plane = way * TURN.apply([0, 0, 1])
    np.testing.assert_allclose(mesh.face_normals, np.tile(plane, (len(mesh.faces), 1)), atol=1e-9)
    assert result.remarks() == []


@pytest.mark.parametrize("way", [1, -1])
@pytest.mark.parametrize("first", range(8))
def test_corners_that_are_drawn_twice_change_no_area(first, way):
    twice = [(0, 0), (0, 0), (2, -1), (0, 3), (0, 3 + 1e-13), (0, 3), (-2, -1), (0, 0)]  # the arrow
    mesh, result = cut(upright(np.roll(twice, first, axis=0)[::way]))
    assert mesh.area == pytest.approx(6) and result.remarks() == []
    assert np.allclose(mesh.face_normals[mesh.area_faces > 1e-9], way * TURN.apply([0, 0, 1]))


@pytest.mark.parametrize("outline", [BUTTERFLY, EVEN_BUTTERFLY, STAR, TWICE_AROUND])
def test_polygons_that_cross_or_cover_themselves_are_named(outline):
    mesh, result = cut(upright(DOORWAY), upright(outline))
    assert mesh.area == pytest.approx(14.1) and result.crossing == [1]
    assert len(result.remarks()) == 1 and "face 2" in result.remarks()[0]


def test_bent_polygons_are_cut_and_named():
    saddle = np.array([[0, 0, 0], [1, 0, 0.5], [1, 1, 0], [0, 1, 0.5]])
    mesh, result = cut(saddle, saddle * [1, 1, 0.1])
    assert len(mesh.faces) == 4 and result.bent == [0]
    assert "cut as if flat" in result.remarks()[0]


def test_a_box_whose_sides_have_corners_on_their_edges_is_closed():
    """Each side is an octagon, and ear clipping alone would skip the corners in the middle of the edges."""
    solid = box((0, 0, 0), (2, 2, 2))
    sides = []
    for normal in np.vstack([np.eye(3), -np.eye(3)]):
        corners = solid.vertices[np.isclose((solid.vertices - 1) @ normal, 1)] - 1
        across = np.cross(normal, corners[0])
        around = corners[np.argsort(np.arctan2(corners @ across, corners @ corners[0]))]
        sides.append(1 + np.stack([around, (around + np.roll(around, -1, axis=0)) / 2], axis=1).reshape(-1, 3))
    mesh, _ = cut(*sides)
    mesh.merge_vertices()
    assert len(mesh.vertices) == 20 and mesh.is_watertight and mesh.volume == pytest.approx(8)


def test_many_polygons_of_many_sizes_keep_their_order():
    rng = np.random.default_rng(0)
    radii = [rng.uniform(0.3, 1, rng.integers(3, 12)) for _ in range(200)]
    outlines = [np.stack([r * np.cos(a), r * np.sin(a)], axis=1) for r in radii for a in [np.linspace(0, 6, len(r))]]
    mesh, result = cut(*map(upright, outlines))
    areas = [abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) / 2 for x, y in (each.T for each in outlines)]
    found = np.bincount(result.polygons, mesh.area_faces, len(outlines))
    np.testing.assert_allclose(found, np.where(np.isin(np.arange(200), result.crossing), 0, areas), rtol=1e-6)
    assert (np.diff(result.polygons) >= 0).all() and not result.crossing
