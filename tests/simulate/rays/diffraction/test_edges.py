"""Which edges of a scene diffract."""

import numpy as np
import pytest
import trimesh

from scenes.places.room import BRICK, Opening, build_place, build_room
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.orientation import facing
from scenes.scene.shapes import box, sheet, union
from simulate.rays.core.propagation import Propagation
from simulate.rays.core.ray_scene import RayScene
from simulate.rays.diffraction.edges import diffracting_edges

FLOOR = ("floor", sheet((-5, -5, 0), (10, 0, 0), (0, 10, 0)), "concrete")


@pytest.fixture
def edges_of(make_scene):
    return lambda *objects: diffracting_edges(RayScene.of(make_scene(*objects), Propagation()))


def test_box_in_the_air_has_twelve_edges_of_270_degrees(edges_of):
    edges = edges_of(FLOOR, ("box", box((0, 0, 1), (1, 2, 3)), "metal"))
    assert len(edges) == 12 and np.allclose(np.degrees(edges.exterior), 270)
    assert sorted(edges.lengths.round(3)) == [1] * 4 + [2] * 8
    # Between the faces, on the side of the open angle, is air; face 0 and face n are on its border.
    middle = edges.points(np.array([0.5]))[:, 0]
    corner = np.array([0.5, 1, 2])
    outwards = edges.around(edges.exterior[:, None] / 2)[:, 0]
    assert ((middle - corner) * outwards > 0).any(axis=1).all()
    for angle in (0.0, 3 * np.pi / 2):
        on_face = middle + 0.1 * edges.around(np.full((12, 1), angle))[:, 0]
        assert (np.abs(on_face - corner) < np.array([0.5, 1, 1]) + 1e-9).all()


def test_edges_on_the_floor_are_none(edges_of):
    edges = edges_of(FLOOR, ("box", box((0, 0, 0.002), (1, 1, 2)), "metal"))
    assert len(edges) == 8 and (edges.points(np.array([0.5]))[..., 2] > 0.5).all()


def test_free_edges_of_a_sheet_are_joined_across_its_triangles(edges_of):
    screen = sheet((0, 0, 1), (3, 0, 0), (0, 0, 2), openings=[(1, 2, 0.5, 1.5)])
    edges = edges_of(FLOOR, ("screen", screen, "metal"))
    assert np.allclose(edges.exterior, 2 * np.pi)
    assert sorted(edges.lengths.round(3)) == [1] * 4 + [2, 2, 3, 3]
    assert np.allclose((edges.normals * [0, 1, 0]).sum(axis=1) ** 2, 1)


def test_edge_ends_where_another_body_touches_it(edges_of):
    """A crate covers the upper half of a screen's upright edge."""
    screen = sheet((0, 0, 1), (2, 0, 0), (0, 0, 2))
    beside = box((-0.5, -0.5, 2.0), (-0.002, 0.5, 4.0))
    edges = edges_of(FLOOR, ("screen", screen, "metal"), ("beside", beside, "brick"))
    upright = edges.subset((np.abs(edges.directions[:, 2]) > 0.5) & ~edges.sheets)
    assert sorted(upright.lengths.round(2)) == [1.0, 2.0]


def test_facets_of_a_curved_surface_and_short_edges_do_not_diffract(edges_of):
    pillar = trimesh.creation.cylinder(radius=0.3, height=2.0, sections=32)
    pillar.apply_translation((0, 0, 2))
    assert len(edges_of(FLOOR, ("pillar", pillar, "metal"))) == 0
    assert len(edges_of(FLOOR, ("cube", box((0, 0, 1), (0.07, 0.07, 1.07)), "metal"))) == 0


def test_bodies_that_share_corners_in_a_file_are_one(edges_of):
    """Two sheets of one mesh that meet at a right angle are a wedge; files repeat the corners they share."""
    corner = union(sheet((0, 0, 1), (1, 0, 0), (0, 0, 2)), sheet((0, 0, 1), (0, 1, 0), (0, 0, 2)))
    edges = edges_of(FLOOR, ("corner", corner, "metal"))
    assert sorted(np.degrees(edges.exterior).round()) == [270] + [360] * 6


def test_boards_of_a_box_end_at_its_edges_one_by_one(edges_of):
    """Each of the twelve edges of a crate is that of two half-planes; an outer wall's edges are none."""
    edges = edges_of(FLOOR, ("crate", box((0, 0, 1), (1, 1, 2)), "brick"))
    assert len(edges) == 24 and edges.sheets.all() and np.allclose(edges.exterior, 2 * np.pi)
    inside = edges.points(np.array([0.5]))[:, 0] + 0.1 * edges.tangents  # on the half-plane's own face
    assert (np.abs(inside - [0.5, 0.5, 1.5]).max(axis=1) < 0.5 + 1e-9).all()
    np.testing.assert_allclose(np.abs((edges.normals * edges.tangents).sum(axis=1)), 0, atol=1e-12)
    assert len(np.unique(np.column_stack([edges.starts, edges.directions, edges.tangents]).round(6), axis=0)) == 24


def test_openings_of_outer_walls_diffract_and_their_corners_do_not():
    """A room with a door: three edges of the opening, as the door's own edges are in the wall's slab."""
    door = Opening("door", "south", 1.0, 1.9, 0.0, 2.0, "wood")
    walls = build_room((3.0, 2.5, 2.4), [door], BRICK, BRICK, [BRICK] * 4)
    gateway = Gateway((0.6, 0.6, 1.2), facing((1.0, 1.0, 0.0)), pattern="dipole")
    room = build_place("room", walls, gateway, Transmitter((1.5, 1.0, 0.8), (2.4, 2.0, 1.6), "dipole"))
    edges = diffracting_edges(RayScene.of(room, Propagation()))
    assert sorted(edges.lengths.round(2)) == [0.9, 2.0, 2.0] and edges.sheets.all()
    assert np.allclose(edges.starts[:, 1], 0)


def test_boards_of_a_box_at_the_end_of_the_scene_have_their_edges(edges_of):
    """Its top and its far side are the outermost faces, but the slabs are inside the box and do not continue."""
    assert len(edges_of(FLOOR, ("crate", box((4, -0.5, 3), (5, 0.5, 4)), "brick"))) == 24
