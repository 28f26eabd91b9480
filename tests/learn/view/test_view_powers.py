"""What the viewer shows of received powers and of delays, without a browser."""

import dataclasses

import numpy as np
import pytest
from matplotlib import colormaps

import bisplat
from learn.view.delay_panel import DelayPanel, delay_profile
from learn.view.power_panel import CELLS, POWER, SILENT, STRONGEST, WIDTH, coverage, draw_map
from learn.view.subject import subject
from learn.view.tab import PANELS, Tab, panels_of
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
    return subject(str(folder))


def test_methods_learn_from_the_training_part_and_maps_are_made_once(shown):
    np.testing.assert_array_equal(shown.known, shown.dataset.train)
    found = coverage(shown, "inverse-distance", 1.2)
    assert coverage(shown, "inverse-distance", 1.2) is found and found.height == 1.2
    assert CELLS / 2 < found.inside.size < 2 * CELLS
    np.testing.assert_array_equal(found.fitted.known, shown.known)
    place = np.array([[found.x[30], found.y[20], 1.2]])
    np.testing.assert_allclose(
        shown.fitted("power", "inverse-distance").predict(place).value[0], found.median[:, 20, 30]
    )


def test_map_and_positions_have_colours_of_one_scale(shown):
    found = coverage(shown, "inverse-distance", 1.2)
    drawn = draw_map(found, "west", POWER)
    measured = shown.dataset.powers
    low, high = np.percentile(measured[~np.isnan(measured)], (1, 99))
    cell, position = (20, 20), int(np.flatnonzero(~np.isnan(measured[:, 0]))[3])

    def colour(power):
        share = np.clip((power - low) / (high - low), 0, 1)
        return (255 * np.array(colormaps["viridis"](int(255 * share))[:3])).round()

    np.testing.assert_allclose(drawn.image[cell][:3], colour(found.median[0][cell]), atol=1)
    np.testing.assert_allclose(drawn.points[position], colour(measured[position, 0]), atol=1)
    np.testing.assert_array_equal(drawn.image[..., 3] == 0, ~found.inside)
    unheard = np.isnan(measured[:, 0])
    assert unheard.any() and (drawn.points[unheard] == SILENT).all()


def test_strongest_gateway_has_the_same_colour_in_the_map_and_at_the_positions(shown):
    found = coverage(shown, "inverse-distance", 1.2)
    drawn = draw_map(found, STRONGEST, POWER)
    measured = shown.dataset.powers
    west, east = found.strongest == 0, found.strongest == 1
    assert len(np.unique(drawn.image[west], axis=0)) == 1 == len(np.unique(drawn.image[east], axis=0))
    for gateway, cells in enumerate((west, east)):
        heard = np.nan_to_num(measured, nan=-99).argmax(axis=1) == gateway
        assert (drawn.gateways[gateway] == drawn.image[cells][0, :3]).all()
        assert (drawn.points[heard] == drawn.image[cells][0, :3]).all()


def test_intervals_are_those_of_the_strongest_gateway_or_there_are_none(shown):
    found = coverage(shown, "helmholtz", 1.2)
    one, strongest = (draw_map(found, name, WIDTH).image for name in ("west", STRONGEST))
    assert (one != strongest).any()
    deaf = np.where(found.strongest == 0, FLOOR - 20, found.median)
    silent = dataclasses.replace(found, median=np.where(np.isnan(found.median), np.nan, deaf))
    cells = draw_map(silent, STRONGEST, WIDTH).image
    assert (cells[silent.strongest == -1, :3] == SILENT).all() and (cells[silent.strongest == 1, :3] != SILENT).any()
    plain = coverage(shown, "mean", 1.2)
    width, power = (draw_map(plain, "west", what).image for what in (WIDTH, POWER))
    np.testing.assert_array_equal(width, power)  # mean states no interval


def test_tab_has_a_table_of_the_powers_and_a_key(shown, join):
    with serving("bisplat: yard", 8720, lambda client: Tab(client, shown).close) as address, join(address) as tab:
        width = tab.next("ImageMessage")["props"]["render_width"]
        assert width == pytest.approx(np.ptp(shown.dataset.positions[shown.known, 0]), abs=0.2)
        assert tab.next("GuiImageMessage")
        words = said(tab, "| gateway | predicted |")
    assert "Recorded position 1 (0 in files)" in words
    assert ("did not learn from it" in words) == (0 not in shown.known)


def test_a_quantity_without_a_panel_of_its_own_has_lines_and_scores(shown, join, monkeypatch):
    monkeypatch.delitem(PANELS, "power")
    with serving("bisplat: yard", 8740, lambda client: Tab(client, shown).close) as address, join(address) as tab:
        assert tab.next("GuiImageMessage") and "median error (dB)" in said(tab, "Recorded position 1")


def said(tab, sentence: str) -> str:
    """The description that has a sentence."""
    while sentence not in (words := tab.next("GuiUpdateMessage")["updates"].get("_markdown", "")):
        pass
    return words


# Delays


def test_delays_of_two_paths_are_where_they_are():
    band = bisplat.Band(200e6, 64)
    frequencies = band.frequencies(2.4e9)
    paths = np.exp(-2j * np.pi * frequencies * 30e-9) + 0.1 * np.exp(-2j * np.pi * frequencies * 60e-9)
    profile = delay_profile(np.stack([paths, 1j * paths]), band)
    assert profile.delays[profile.decibels.argmax()] == pytest.approx(30e-9, abs=1e-9)
    at_second = profile.decibels[np.abs(profile.delays - 60e-9).argmin()]
    assert at_second == pytest.approx(-20, abs=1.5) and profile.decibels.max() == 0


def test_few_subcarriers_show_their_whole_period():
    band = bisplat.Band(20e6, 4)
    profile = delay_profile(np.ones((1, 4)), band)
    assert np.ptp(profile.delays) == pytest.approx(1 / band.spacing)
    assert profile.delays[profile.decibels.argmax()] == pytest.approx(0, abs=1e-12)


def test_channels_have_a_profile_of_each_row(tmp_path, join):
    band = bisplat.Band(100e6, 52)
    delays = 1e-9 * np.array([20.0, 40.0])
    paths = np.exp(-2j * np.pi * delays[:, None] * band.frequencies(2.4e9))
    array = bisplat.PlanarArray(1, 4)
    wide = bisplat.write_dataset(
        tmp_path / "wide", [[0, 0, 1], [1, 0, 1]], np.repeat(paths[:, None], 4, axis=1), array, 2.4e9, bandwidth=100e6
    )
    bisplat.export(wide, tmp_path / "csi", "csi")
    channels = bisplat.read_dataset(tmp_path / "csi")
    shown = subject(str(channels.folder))
    assert panels_of(shown) == {"channel": DelayPanel}
    with serving("bisplat: csi", 8730, lambda client: Tab(client, shown).close) as address, join(address) as tab:
        assert tab.next("GuiImageMessage")
        words = said(tab, "strongest delay: ")
    found = float(words.partition("strongest delay: ")[2].removesuffix(" ns"))
    assert found == pytest.approx(20, abs=1)
    with pytest.raises(bisplat.InputError, match=r"metadata\.json: .* band"):
        DelayPanel.suits(dataclasses.replace(channels, band=None), "channel")
    (channels.folder / "tx_pos.csv").unlink()
    with pytest.raises(bisplat.InputError, match=r"tx_pos\.csv"):
        subject(str(channels.folder))
