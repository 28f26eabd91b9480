"""Where slabs and conductors come to lie on the cells."""

import numpy as np
import pytest

from scenes.importing.thick_walls import walls_as_sheets
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject, shifted
from scenes.scene.materials import RadioMaterial
from scenes.scene.orientation import facing
from scenes.scene.shapes import box, rotate, sheet
from simulate.fullwave.cells import AIR, CONDUCTOR, edge_materials
from simulate.fullwave.run_plan import plan
from simulate.fullwave.yee_grid import YeeGrid, numerical_permittivity

STONE = RadioMaterial("stone", 5.0, 0.05, 0.1)
METAL = RadioMaterial("metal", 1.0, 1e7, 0.002)
GRID = YeeGrid((0.0, 0.0, 0.0), 0.02, (50, 50, 50))


def scene(*objects: SceneObject) -> Scene:
    gateway, region = Gateway((0.8, 0.5, 0.5), facing((-1, 0, 0))), Transmitter((0.3, 0.3, 0.3), (0.5, 0.5, 0.5))
    return Scene("cells", 915e6, gateway, region, objects, {"stone": STONE, "metal": METAL})


def permittivity_along(place: Scene, axis: int, line: tuple) -> np.ndarray:
    """ε_r of the edges along an axis, at those on a line through the cells."""
    found = edge_materials(place, GRID)
    return found.permittivity[found.index[axis][line]]


def test_openings_of_walls_stay_open():
    wall = SceneObject("wall", sheet((0.9, 0, 0), (0, 1, 0), (0, 0, 1), openings=[(0.3, 0.7, 0.3, 0.7)]), "stone")
    in_the_opening, beside_it = (permittivity_along(scene(wall), 1, (slice(46, 50), level, 25)) for level in (25, 5))
    assert (in_the_opening == 1).all() and (beside_it > 4.8).all()


@pytest.mark.parametrize("low", [0.503, 0.9])  # between the antennas and an outer wall; and that
def test_sheet_of_a_wall_that_is_drawn_as_a_box_fills_the_same_cells(low):
    drawn = scene(
        SceneObject("wall", box((low, 0.1, 0.1), (low + 0.1, 0.9, 0.9)), "stone"),
        SceneObject("far", sheet((0, 0, 0), (0, 1, 0), (0, 0, 1)), "metal"),
        *([SceneObject("behind", sheet((1.5, 0, 0), (0, 1, 0), (0, 0, 1)), "metal")] if low < 0.9 else []),
    )
    one_sheet, found = walls_as_sheets(drawn)
    assert found == {"wall": 0.1}
    for axis in range(3):
        line = (slice(20, None), 25, 25)
        assert np.array_equal(permittivity_along(one_sheet, axis, line), permittivity_along(drawn, axis, line))


def test_fractions_of_a_slab_add_up_to_its_thickness():
    board = SceneObject("board", sheet((0.503, 0.1, 0.1), (0, 0.8, 0), (0, 0, 0.8)), "stone", thickness=0.05)
    place = scene(board, SceneObject("room", box((0, 0, 0), (1, 1, 1)), "metal"))
    slab = numerical_permittivity(5.0, place.wavelength, GRID.cell)
    tangential = permittivity_along(place, 1, (slice(1, -1), 25, 25))
    assert (tangential - 1).sum() * GRID.cell == pytest.approx((slab - 1) * 0.05, rel=0.03)
    assert tangential.max() == pytest.approx(slab)
    across = permittivity_along(place, 0, (slice(1, -1), 25, 25))
    assert (1 - 1 / across).sum() * GRID.cell == pytest.approx((1 - 1 / slab) * 0.05, rel=0.03)


def test_walls_are_closed_at_the_corners_of_the_room():
    room = box((0.16, 0.16, 0.16), (0.84, 0.84, 0.84))
    found = edge_materials(scene(SceneObject("room", room, "stone")), GRID)
    around = found.index[2][4:47, 4:47, 25] != AIR
    inside = found.index[2][9:42, 9:42, 25] != AIR
    assert not inside.any()
    assert around[0].all() and around[:, 0].all() and around[-1].all() and around[:, -1].all()


def test_conductor_is_the_faces_nearest_to_its_surface():
    place = scene(SceneObject("plate", sheet((0.3, 0.1, 0.512), (0.4, 0, 0), (0, 0.8, 0)), "metal"))
    index = edge_materials(place, GRID).index
    planes = {axis: np.unique(np.argwhere(index[axis] == CONDUCTOR)[:, 2]).tolist() for axis in range(3)}
    assert planes == {0: [26], 1: [26], 2: []}
    along_x = np.argwhere(index[0] == CONDUCTOR)
    assert (along_x.min(axis=0)[:2], along_x.max(axis=0)[:2]) == (pytest.approx([15, 5]), pytest.approx([34, 45]))


def test_oblique_conductor_has_no_holes():
    tilted = sheet((0.2, 0.2, 0.2), (0.6, 0.0, 0.0), (0.0, 0.35, 0.45))
    index = edge_materials(scene(SceneObject("plate", tilted, "metal")), GRID).index
    # A path of cells from one side to the other, along y, meets a conducting face in every column of the sheet.
    faces = (index[0] == CONDUCTOR)[:-1, :, :-1] & (index[2] == CONDUCTOR)[:-1, :, :-1]
    for i in range(11, 39):
        for k in range(11, 31):
            assert faces[i, :, k].any(), (i, k)


def test_cells_do_not_depend_on_the_place():
    """The cells are counted from the scene's corner, and a scene in map coordinates gets the same materials."""
    board = SceneObject("board", sheet((0.52, 0.1, 0.1), (0, 0.8, 0), (0, 0, 0.8)), "stone")
    locker = SceneObject("locker", rotate(box((0.1, 0.1, 0.1), (0.3, 0.3, 0.7)), 20), "metal")
    room = SceneObject("room", box((0, 0, 0), (1, 1, 1)), "stone")
    near, step = scene(board, locker, room), np.array([98_765.43, -87_654.32, 519.7])
    far = shifted(near, step)
    planned, moved = (plan(each, each.transmitter.region, 0.02) for each in (near, far))
    assert moved.grid.shape == planned.grid.shape and moved.steps == planned.steps
    np.testing.assert_allclose(np.array(moved.grid.origin) - planned.grid.origin, step)
    assert np.abs(moved.box - planned.box).max() <= 1  # a corner of the region on a face of a cell
    expected, found = edge_materials(near, planned.grid), edge_materials(far, moved.grid)
    assert (found.index != expected.index).mean() < 1e-5  # edges exactly between two levels
