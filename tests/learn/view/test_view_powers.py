"""What the viewer shows of received powers and of delays, without a browser."""

import dataclasses

import numpy as np
import pytest
from matplotlib import colormaps

import bisplat
from learn.view.channel_tab import ChannelTab, delay_profile, require_places_and_band
from learn.view.power_subject import CELLS, PowerSubject
from learn.view.power_tab import POWER, SILENT, STRONGEST, WIDTH, PowerTab, drawn
from scenes.browser.served_page import serving

GATEWAYS = {"west": (0.0, 1.5, 2.0), "east": (6.0, 1.5, 2.0)}
FLOOR = -54.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Powers of two gateways in a yard of 6 m × 3 m, of which the weakest are not received."""
    places = np.random.default_rng(0).uniform((0, 0, 1), (6, 3, 1.4), (60, 3))
    powers = -40 - 20 * np.log10(np.linalg.norm(places[:, None] - list(GATEWAYS.values()), axis=-1))
    powers[powers < FLOOR] = np.nan
    folder = tmp_path_factory.mktemp("view") / "yard"
    bisplat.write_dataset(folder, places, powers=powers, gateways=GATEWAYS, frequency="2.4 GHz", floor_dbm=FLOOR)
    return folder


@pytest.fixture(scope="module")
def shown(folder):
    return PowerSubject.of(folder)


def test_methods_learn_from_the_training_part_and_maps_are_made_once(shown):
    np.testing.assert_array_equal(shown.known, shown.dataset.train)
    coverage = shown.coverage("inverse-distance", 1.2)
    assert shown.coverage("inverse-distance", 1.2) is coverage and coverage.height == 1.2
    assert CELLS / 2 < coverage.inside.size < 2 * CELLS
    np.testing.assert_array_equal(coverage.fitted.known, shown.known)
    place = np.array([coverage.x[30], coverage.y[20], 1.2])
    np.testing.assert_allclose(shown.predict("inverse-distance", place).value[0], coverage.median[:, 20, 30])


def test_map_and_positions_have_colours_of_one_scale(shown):
    coverage = shown.coverage("inverse-distance", 1.2)
    found = drawn(shown, coverage, "west", POWER)
    measured = shown.dataset.powers
    low, high = np.percentile(measured[~np.isnan(measured)], (1, 99))
    cell, position = (20, 20), int(np.flatnonzero(~np.isnan(measured[:, 0]))[3])

    def colour(power):
        share = np.clip((power - low) / (high - low), 0, 1)
        return (255 * np.array(colormaps["viridis"](int(255 * share))[:3])).round()

    np.testing.assert_allclose(found.image[cell][:3], colour(coverage.median[0][cell]), atol=1)
    np.testing.assert_allclose(found.points[position], colour(measured[position, 0]), atol=1)
    np.testing.assert_array_equal(found.image[..., 3] == 0, ~coverage.inside)
    unheard = np.isnan(measured[:, 0])
    assert unheard.any() and (found.points[unheard] == SILENT).all()


def test_strongest_gateway_has_the_same_colour_in_the_map_and_at_the_positions(shown):
    coverage = shown.coverage("inverse-distance", 1.2)
    found = drawn(shown, coverage, STRONGEST, POWER)
    west, east = coverage.strongest == 0, coverage.strongest == 1
    assert len(np.unique(found.image[west], axis=0)) == 1 == len(np.unique(found.image[east], axis=0))
    for gateway, cells in enumerate((west, east)):
        heard = shown.strongest_measured == gateway
        assert (found.points[heard] == found.image[cells][0, :3]).all()


def test_intervals_are_those_of_the_strongest_gateway_or_there_are_none(shown):
    coverage = shown.coverage("helmholtz", 1.2)
    one, strongest = (drawn(shown, coverage, name, WIDTH).image for name in ("west", STRONGEST))
    assert (one != strongest).any()
    deaf = np.where(coverage.strongest == 0, FLOOR - 20, coverage.median)
    silent = dataclasses.replace(coverage, median=np.where(np.isnan(coverage.median), np.nan, deaf))
    cells = drawn(shown, silent, STRONGEST, WIDTH).image
    assert (cells[silent.strongest == -1, :3] == SILENT).all() and (cells[silent.strongest == 1, :3] != SILENT).any()
    plain = shown.coverage("mean", 1.2)
    width, power = (drawn(shown, plain, "west", what).image for what in (WIDTH, POWER))
    np.testing.assert_array_equal(width, power)  # mean states no interval


def test_tab_has_a_table_of_the_powers_and_a_key(shown, join):
    tables = []

    class Watched(PowerTab):
        def _table(self, *of):
            tables.append(super()._table(*of))
            return tables[-1]

    with serving("bisplat: yard", 8720, lambda client: Watched(client, shown).close) as address:
        tab = join(address)
        width = tab.next("ImageMessage")["props"]["render_width"]
        assert width == pytest.approx(np.ptp(shown.dataset.positions[shown.known, 0]), abs=0.2)
        tab.close()
    assert "| gateway | predicted |" in tables[0] and "Survey position 1 (number 0 in files)" in tables[0]
    assert ("did not learn from it" in tables[0]) == (0 not in shown.known)


# Delays


def test_delays_of_two_paths_are_where_they_are():
    band = bisplat.Band(200e6, 64)
    frequencies = band.frequencies(2.4e9)
    paths = np.exp(-2j * np.pi * frequencies * 30e-9) + 0.1 * np.exp(-2j * np.pi * frequencies * 60e-9)
    profile = delay_profile(np.stack([paths, 1j * paths]), band)
    assert profile.resolution == 5e-9 and profile.period == pytest.approx(320e-9)
    assert profile.delays[profile.decibels.argmax()] == pytest.approx(30e-9, abs=1e-9)
    at_second = profile.decibels[np.abs(profile.delays - 60e-9).argmin()]
    assert at_second == pytest.approx(-20, abs=1.5) and profile.decibels.max() == 0


def test_few_subcarriers_show_their_whole_period():
    band = bisplat.Band(20e6, 4)
    profile = delay_profile(np.ones((1, 4)), band)
    assert np.ptp(profile.delays) == pytest.approx(profile.period)
    assert profile.delays[profile.decibels.argmax()] == pytest.approx(0, abs=1e-12)


def test_channels_have_a_profile_of_each_row(tmp_path, join):
    band = bisplat.Band(100e6, 52)
    delays = 1e-9 * np.array([20.0, 40.0])
    paths = np.exp(-2j * np.pi * delays[:, None] * band.frequencies(2.4e9))
    array = bisplat.PlanarArray(1, 4)
    wide = bisplat.write_dataset(
        tmp_path / "wide", [[0, 0, 1], [1, 0, 1]], np.repeat(paths[:, None], 4, axis=1), array, 2.4e9, bandwidth=100e6
    )
    bisplat.export_csi(wide, tmp_path / "csi")
    channels = bisplat.read_dataset(tmp_path / "csi")
    require_places_and_band(channels)
    said = []

    class Watched(ChannelTab):
        def _profile(self, index):
            said.append(super()._profile(index)[1])
            return super()._profile(index)

    with serving("bisplat: csi", 8730, lambda client: Watched(client, channels, None).close) as address:
        tab = join(address)
        assert tab.next("GuiImageMessage")
        tab.close()
    found = float(said[0].removeprefix("strongest delay ").removesuffix(" ns"))
    assert found == pytest.approx(20, abs=1)
    with pytest.raises(bisplat.InputError, match=r"tx_pos\.csv: "):
        require_places_and_band(dataclasses.replace(channels, places=None))
    with pytest.raises(bisplat.InputError, match=r"metadata\.json: .* band"):
        require_places_and_band(dataclasses.replace(channels, band=None))
