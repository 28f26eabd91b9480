"""Coverage maps: where their cells are, what they say there, and where they say nothing."""

import numpy as np
import pytest

import bisplat
from learn.fitted.coverage import NO_GATEWAY
from learn.fitted.fitted_method import fit_method

GATEWAYS = {"west": (0.0, 1.5, 2.0), "east": (6.0, 1.5, 2.0)}


def yard(folder, places, floor=-100.0):
    """Powers that fall by 20 dB per decade from two gateways."""
    places = np.asarray(places, float)
    distances = np.linalg.norm(places[:, None] - list(GATEWAYS.values()), axis=-1)
    powers = -40 - 20 * np.log10(distances)
    powers[powers < floor] = np.nan
    return bisplat.write_dataset(folder, places, powers=powers, gateways=GATEWAYS, frequency="2.4 GHz", floor_dbm=floor)


@pytest.fixture
def triangle(tmp_path):
    """Known positions in the lower left half of a rectangle of 6 m × 3 m, in a frame that does not begin at 0."""
    x, y = np.meshgrid(np.arange(0, 6.1, 1), np.arange(0, 3.1, 0.5))
    places = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 1.0)])
    return yard(tmp_path / "yard", places[places[:, 0] / 6 + places[:, 1] / 3 <= 1])


def test_cells_cover_the_known_positions_and_lie_where_their_powers_are(triangle):
    coverage = bisplat.coverage_map(triangle, step=0.5, method="log-distance")
    np.testing.assert_allclose(coverage.x, np.arange(0.25, 6, 0.5))
    np.testing.assert_allclose(coverage.y, np.arange(0.25, 3, 0.5))
    np.testing.assert_allclose(coverage.edges, (0, 0, 6, 3))
    assert coverage.median.shape == (2, 6, 12) and coverage.height == 1.0
    place = [coverage.x[3], coverage.y[1], 1.0]
    np.testing.assert_allclose(coverage.median[:, 1, 3], coverage.fitted.predict([place]).value[0])
    distance = np.linalg.norm(np.subtract(place, list(GATEWAYS.values())), axis=1)
    np.testing.assert_allclose(coverage.median[:, 1, 3], -40 - 20 * np.log10(distance), atol=0.01)


def test_nothing_is_said_outside_the_hull_unless_a_region_is_stated(triangle):
    coverage = bisplat.coverage_map(triangle, step=0.5, method="mean")
    assert coverage.inside[0, 0] and not coverage.inside[-1, -1]
    np.testing.assert_array_equal(np.isnan(coverage.median[0]), ~coverage.inside)
    assert coverage.strongest[-1, -1] == NO_GATEWAY
    stated = bisplat.coverage_map(triangle, step=0.5, method="mean", region=(-1, -1, 6.9, 3))
    assert np.isfinite(stated.median).all() and not stated.inside[0, 0] and stated.inside[3, 3]
    np.testing.assert_allclose(stated.edges, (-1, -1, 7, 3))  # the right edge is moved out to whole cells


def test_interval_is_that_of_the_method_and_some_methods_state_none(triangle):
    coverage = bisplat.coverage_map(triangle, step=1.0)
    predicted = coverage.fitted.predict([[coverage.x[0], coverage.y[0], 1.0]])
    np.testing.assert_allclose(coverage.width[:, 0, 0], (predicted.high - predicted.low)[0])
    assert bisplat.coverage_map(triangle, step=1.0, method="mean").width is None


def test_strongest_gateway_is_one_that_receives_something(tmp_path):
    x = np.linspace(0, 6, 13)
    row = yard(tmp_path / "row", np.column_stack([x, np.full(13, 1.5), np.ones(13)]), floor=-49.0)
    coverage = bisplat.coverage_map(row, step=0.5, method="nearest")
    assert coverage.median.shape == (2, 1, 12)  # positions on a line: one row of cells, all in the hull
    assert coverage.inside.all()
    strongest = coverage.strongest[0]
    assert strongest[0] == 0 and strongest[-1] == 1 and NO_GATEWAY in strongest[4:8]


def test_single_position_has_a_map_of_one_cell(tmp_path):
    alone = yard(tmp_path / "alone", [[2.0, 1.0, 1.2]])
    coverage = bisplat.coverage_map(alone, method="nearest")
    assert coverage.median.shape == (2, 1, 1) and coverage.x[0] == pytest.approx(2.0)
    assert np.isfinite(coverage.median).all()


def test_a_part_of_the_positions_and_a_height_that_none_of_them_has(triangle, capsys):
    fitted = fit_method(triangle, "power", "nearest", known=np.arange(3))
    coverage = bisplat.coverage_map(fitted, height=2.5, step=0.5)
    assert coverage.fitted is fitted and coverage.x[-1] < 2.1
    assert "the height 2.5 m is outside those of the known positions, 1 to 1 m" in capsys.readouterr().err


def test_too_many_cells_are_refused_with_a_step_that_is_not(triangle):
    with pytest.raises(bisplat.InputError, match=r"step: expected at least 0.00429 m, for at most 1,000,000 cells"):
        bisplat.coverage_map(triangle, method="mean", step=0.001)
