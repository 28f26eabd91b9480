"""The table of predicted downlinks: scores, splits, and the command."""

import dataclasses
import json

import numpy as np
import pytest
from learn.channels.channel_scores import correlation, score_channels, snr_db

import bisplat
from simulate.spectra.band import delay_spread
from tests.folders import write_links


def test_scores_by_hand():
    truth = np.array([[[3.0, 4.0j]], [[1.0, 0.0]], [[0.0, 0.0]], [[2.0, 0.0]]])
    predicted = np.array([[[3.0, 3.5j]], [[0.0, 0.0]], [[1.0, 1.0]], [[2.0j, 2.0]]])
    np.testing.assert_allclose(snr_db(predicted, truth), [20, 0, np.nan, 10 * np.log10(4 / 12)], atol=1e-9)
    alike = (9 + 14) / (5 * np.sqrt(9 + 3.5**2))
    np.testing.assert_allclose(correlation(predicted, truth), [alike, 0, np.nan, np.sqrt(0.5)])
    found = score_channels(predicted, truth, None)
    assert found["rows"] == 3 and found["snr_median_db"] == 0
    assert found["snr_mean_db"] == pytest.approx((20 + 10 * np.log10(4 / 12)) / 3)
    assert found["correlation_median"] == pytest.approx(np.sqrt(0.5))
    assert set(score_channels(predicted, 0 * truth, None).values()) == {0, None}
    assert found["coverage_90"] is None
    # Of four parts each, three, all and one are within 1.645 deviations.
    stated = score_channels(predicted, truth, None, deviation=np.array([0.2, 1.0, 9.0, 1.0]))
    assert stated["coverage_90"] == pytest.approx((3 + 4 + 1) / 12)


def test_every_method_is_scored_on_the_same_rows(links):
    comparison = bisplat.compare_channels(links)
    labels = ["copy", "ramp", "nearest", "delays", "helmholtz", "helmholtz-positions"]
    assert [row["label"] for row in comparison] == labels
    assert (comparison.known, comparison.test) == (48, 12)
    assert {row["rows"] for row in comparison} == {12}
    for row in comparison:
        assert np.median(comparison.snr_db[row["label"]]) == pytest.approx(row["snr_median_db"])
    best, *_, worst = comparison.table()
    assert best["label"] in ("delays", "helmholtz") and best["snr_median_db"] > worst["snr_median_db"] + 5


def test_scores_do_not_depend_on_the_unit(links):
    up, down = (1e-200 * link.astype(complex) for link in (links.uplink, links.downlink))
    tiny = dataclasses.replace(links, uplink=up, downlink=down)
    for row, other in zip(bisplat.compare_channels(links), bisplat.compare_channels(tiny), strict=True):
        assert other["snr_median_db"] == pytest.approx(row["snr_median_db"], abs=0.01)


def test_what_a_split_needs_is_said(links):
    with pytest.raises(bisplat.InputError, match=r"tx_pos\.csv"):
        bisplat.compare_channels(links, ["copy"], split="area")
    with pytest.raises(bisplat.InputError, match="guard: expected 0"):
        bisplat.split(links, "random", 0, guard=0.5)


def test_many_known_rows_are_drawn_from(links, monkeypatch, capsys):
    monkeypatch.setattr("learn.channels.compare_channels.MOST_KNOWN", 20)
    monkeypatch.setattr("learn.channels.compare_channels.BLOCK", 5)
    comparison = bisplat.compare_channels(links, ["nearest"])
    assert "20 of the 48 known rows" in capsys.readouterr().err
    assert comparison.snr_db["nearest"].shape == (12,)


def test_delay_spreads_are_scored_where_the_band_is_stated(placed, links):
    true = delay_spread(placed.downlink[placed.test], 8e6)
    (row,) = bisplat.compare_channels(placed, ["copy"]).rows
    copied = 1e9 * np.median(np.abs(delay_spread(placed.uplink[placed.test], 8e6) - true))
    assert row["delay_spread_error_median_ns"] == pytest.approx(copied, rel=1e-4)  # the folder has complex64
    assert bisplat.compare_channels(links, ["copy"]).rows[0]["delay_spread_error_median_ns"] is None


def test_a_guard_keeps_distances_where_positions_are_known(placed):
    comparison = bisplat.compare_channels(placed, ["copy"], split="random", guard=4)
    assert comparison.known < 32 and comparison.distances.distance.min() >= 4 * placed.wavelength
    assert comparison.facts()["test_to_known_least_m"] > 0


def test_examples_are_kept_in_the_units_of_the_folder(placed):
    comparison = bisplat.compare_channels(placed, ["copy"])
    assert np.allclose(comparison.examples["copy"], placed.uplink[placed.test][comparison.shown])


def test_a_report_shows_delays_examples_and_a_map(placed, bisplat_command, tmp_path):
    status, _, err = bisplat_command("evaluate", placed.folder, "-o", "report", "--model", "ramp")
    assert status == 0, err
    names = {path.name for path in (tmp_path / "report").iterdir()}
    assert {"snr_cdf.png", "examples.png", "delay_spread.png", "snr_map.png"} <= names
    header = (tmp_path / "report" / "per_sample.csv").read_text().splitlines()[0]
    assert header == "row,x,y,z,snr_db_copy,snr_db_ramp,snr_db_nearest"


def test_a_downlink_of_zeros_has_no_scores(bisplat_command, tmp_path):
    channels = np.random.default_rng(0).normal(size=(20, 2, 8)) + 0j
    channels[::5, :, 4:] = 0
    write_links(tmp_path / "silent", channels)
    status, out, err = bisplat_command("compare", "silent", "-o", "out", "--json")
    assert status == 0, err
    assert all(each["snr_median_db"] is None for each in json.loads(out)["methods"].values())
