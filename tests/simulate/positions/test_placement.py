"""Where transmitters are put."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.files.errors import InputError
from scenes.scene.shapes import box
from simulate.positions.placement import PATH_STEP, chosen_positions, given_positions, place
from simulate.positions.positions import Places

LOW, HIGH = np.array([-5, -1, 0.5]), np.array([-2, 1, 2.5])
CRATE = np.array([[-4, -0.5, 0.2], [-3, 0.5, 3.0]])
KINDS = ["uniform", "grid", "path"]


@pytest.fixture(scope="module")
def scene(make_scene, floor):
    """A crate in the middle of the transmitter's region."""
    return make_scene(floor, ("crate", box(*CRATE), "brick"))


def in_crate(positions):
    return ((positions > CRATE[0]) & (positions < CRATE[1])).all(axis=1)


@pytest.mark.parametrize("kind", KINDS)
def test_positions_are_in_the_region_and_never_in_an_object(kind, scene):
    positions = place(scene, kind, 400, seed=1)
    assert positions.shape == (400, 3) or kind == "grid"
    assert (positions >= LOW).all() and (positions <= HIGH).all() and not in_crate(positions).any()


def test_uniform_positions_fill_the_region_evenly(make_scene, floor):
    """Mean and variance of a uniform law: (a + b)/2 and (b - a)²/12."""
    positions = place(make_scene(floor), "uniform", 4000, seed=2)
    assert positions.mean(axis=0) == pytest.approx((LOW + HIGH) / 2, abs=0.05)
    assert positions.var(axis=0) == pytest.approx((HIGH - LOW) ** 2 / 12, rel=0.06)


def test_grid_has_nearly_equal_steps_and_at_most_the_count(make_scene, floor):
    """A region 3 × 2 × 2 m asked for 96: cells of half a metre, 6 × 4 × 4 of them, positions in their centres."""
    positions = place(make_scene(floor), "grid", 96, seed=1)
    assert len(positions) == 96
    for axis, cells in enumerate((6, 4, 4)):
        values = np.unique(positions[:, axis].round(9))
        assert len(values) == cells
        assert np.diff(values) == pytest.approx(0.5)
        assert values[0] == pytest.approx(LOW[axis] + 0.25)


def test_grid_leaves_out_what_is_inside_objects(make_scene, floor, scene):
    everywhere = place(make_scene(floor), "grid", 96, seed=1)
    assert len(place(scene, "grid", 96, seed=1)) == (~in_crate(everywhere)).sum() < 96


@pytest.mark.parametrize("kind", ["uniform", "grid", "path"])
def test_a_flat_region_has_positions_at_its_height(kind, make_scene, floor):
    """3 × 2 m at one height, asked for 24 on a grid: cells of half a metre, 6 × 4 of them."""
    scene = make_scene(floor)
    moving = replace(scene.transmitter, region_min=(*LOW[:2], 1.2), region_max=(*HIGH[:2], 1.2))
    positions = place(replace(scene, transmitter=moving), kind, 24, seed=1)
    assert len(positions) == 24 and (positions[:, 2] == 1.2).all()
    if kind == "grid":
        assert np.diff(np.unique(positions[:, 0].round(9))) == pytest.approx(0.5)


def test_path_steps_are_eight_millimetres(make_scene, floor):
    """Straight distance of neighbours: the step along the curve, or a little less where it bends."""
    positions = place(make_scene(floor), "path", 2000, seed=3)
    steps = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    assert np.median(steps) == pytest.approx(0.008, rel=0.02)
    assert steps.max() < 1.01 * PATH_STEP


@pytest.mark.parametrize("kind", ["uniform", "path"])
def test_a_seed_decides_the_positions(kind, scene):
    assert (place(scene, kind, 50, seed=4) == place(scene, kind, 50, seed=4)).all()
    assert (place(scene, kind, 50, seed=4) != place(scene, kind, 50, seed=5)).any()


@pytest.mark.parametrize("kind", KINDS)
def test_region_without_room_is_refused(kind, make_scene):
    full_scene = make_scene(("crate", box(LOW - 0.5, HIGH + 0.5), "brick"))
    with pytest.raises(InputError, match="expected room outside the objects"):
        place(full_scene, kind, 10, seed=1)


def test_positions_of_a_csv_are_taken_as_they_are(tmp_path, scene):
    path = tmp_path / "way.csv"
    path.write_text("x,y,z\n-4.5,0,1\n-2.5,0.25,2\n7,8,9\n")
    assert given_positions(path, scene).tolist() == [[-4.5, 0, 1], [-2.5, 0.25, 2], [7, 8, 9]]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", ["line 1", "x,y,z", "empty file"]),
        ("x,y,z\n1,2,3\n1,2\n", ["position 2 (line 3)", "three finite numbers", "1,2"]),
        ("x,y,z\n-4,0,1\n-4,0,1.0000001\n", ["at least two different positions", "found 2 alike"]),
        ("x,y,z\n-2.5,0,1\n-3.5,0,1\n", ["line 3", "a free place", 'inside "crate"']),
    ],
)
def test_bad_csv_is_refused_with_file_and_row(text, words, tmp_path, scene):
    path = tmp_path / "way.csv"
    path.write_text(text)
    with pytest.raises(InputError) as error:
        given_positions(path, scene)
    assert all(word in str(error.value) for word in [str(path), "expected", "found", *words])


def test_a_grid_of_a_single_place_is_refused(make_scene, floor):
    scene = make_scene(floor)
    cube = replace(scene, transmitter=replace(scene.transmitter, region_min=(-3, -0.5, 1), region_max=(-2, 0.5, 2)))
    with pytest.raises(InputError, match=r"free places of a grid .*, found 1"):
        chosen_positions(cube, Places(n=2, placement="grid"))
