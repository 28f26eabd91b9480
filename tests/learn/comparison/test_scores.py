"""Scores by hand, of powers and of complex responses."""

import csv
import json
import shutil

import numpy as np
import pytest

import bisplat
from learn.quantities.complex_scores import complex_scores, correlation, snr_db
from learn.quantities.powers import score_powers
from learn.reports.method_report import intervals_by_distance
from simulate.spectra.band import delay_spread
from tests.folders import write_links

Prediction = bisplat.Prediction


def test_scores_of_powers():
    truth = np.array([[-50.0, -60.0], [-52.0, np.nan], [-54.0, np.nan]])
    median = np.array([[-51.0, -70.0], [-50.0, -80.0], [-60.0, -95.0]])
    found = score_powers(Prediction(median, median - 3, median + 3), truth, floor=-90)
    assert (found["powers"], found["not_received"]) == (4, 2)
    assert found["error_median_db"] == 4 and found["error_p90_db"] == pytest.approx(8.8)
    assert found["rmse_db"] == pytest.approx(np.sqrt((1 + 4 + 36 + 100) / 4))
    assert found["received_rightly"] == pytest.approx(5 / 6)  # −80 dBm would have been received
    assert found["coverage_90"] == 0.5 and found["interval_median_db"] == 6
    silent = score_powers(Prediction(median), np.full((3, 2), np.nan), floor=-90)
    assert silent["error_median_db"] is None and silent["powers"] == 0


def test_scores_of_complex_responses():
    truth = np.array([[[3.0, 4.0j]], [[1.0, 0.0]], [[0.0, 0.0]], [[2.0, 0.0]]])
    predicted = np.array([[[3.0, 3.5j]], [[0.0, 0.0]], [[1.0, 1.0]], [[2.0j, 2.0]]])
    np.testing.assert_allclose(snr_db(predicted, truth), [20, 0, np.nan, 10 * np.log10(4 / 12)], atol=1e-9)
    alike = (9 + 14) / (5 * np.sqrt(9 + 3.5**2))
    np.testing.assert_allclose(correlation(predicted, truth), [alike, 0, np.nan, np.sqrt(0.5)])
    found = complex_scores(Prediction(predicted), truth, None)
    assert found["rows"] == 3 and found["snr_median_db"] == 0
    assert found["snr_mean_db"] == pytest.approx((20 + 10 * np.log10(4 / 12)) / 3)
    assert found["correlation_median"] == pytest.approx(np.sqrt(0.5)) and found["coverage_90"] is None
    assert set(complex_scores(Prediction(predicted), 0 * truth, None).values()) == {0, None}
    # Of four parts each, three, all and one are within 1.645 deviations.
    stated = complex_scores(Prediction(predicted, deviation=np.array([0.2, 1.0, 9.0, 1.0])), truth, None)
    assert stated["coverage_90"] == pytest.approx((3 + 4 + 1) / 12)


def test_the_error_of_a_delay_spread_is_in_nanoseconds():
    """Two paths of equal power, 250 ns apart instead of 125: spreads of 125 and 62.5 ns. 64 subcarriers of 1 MHz."""
    frequencies = 1e6 * np.arange(64)
    truth, other = (1 + np.exp(-2j * np.pi * frequencies * delay)[None, None] for delay in (125e-9, 250e-9))
    found = complex_scores(Prediction(other), truth, 64e6)
    assert found["delay_spread_error_median_ns"] == pytest.approx(62.5, rel=0.01)


def test_delay_spreads_are_scored_where_the_band_is_stated(placed, links):
    true = delay_spread(placed.downlink[placed.test], 8e6)
    row = next(row for row in bisplat.compare(placed, ["copy"]) if row["label"] == "copy")
    copied = 1e9 * np.median(np.abs(delay_spread(placed.uplink[placed.test], 8e6) - true))
    assert row["delay_spread_error_median_ns"] == pytest.approx(copied, rel=1e-4)  # the folder has complex64
    assert all(row["delay_spread_error_median_ns"] is None for row in bisplat.compare(links, ["copy"]))


def test_waves_over_a_band_are_predicted_best_by_waves(wide, monkeypatch):
    for place in ("vecchia.FITTED_ON", "vecchia.ITERATIONS"):  # a short search is enough for so few positions
        monkeypatch.setattr(f"learn.models.kriging.{place}", 30)
    scores = {row["label"]: row for row in bisplat.compare(wide, quantity="response", split="random").table()}
    assert next(iter(scores)) == "helmholtz"
    assert scores["helmholtz"]["snr_median_db"] > scores["inverse-distance"]["snr_median_db"] + 15
    assert scores["nearest"]["coverage_90"] is None and 0 < scores["helmholtz"]["coverage_90"] <= 1


def test_a_dataset_without_band_is_refused(tiny):
    with pytest.raises(bisplat.InputError, match="expected responses over a band"):
        bisplat.compare(tiny, ["nearest"], quantity="response")


def test_scores_of_channels_do_not_depend_on_the_unit(links):
    up, down = (1e-200 * link.astype(complex) for link in (links.uplink, links.downlink))
    tiny = links.with_values(channel=np.concatenate([up, down], axis=2))
    for row, other in zip(bisplat.compare(links), bisplat.compare(tiny), strict=True):
        assert other["snr_median_db"] == pytest.approx(row["snr_median_db"], abs=0.01)


def test_many_known_rows_are_drawn_from(links, monkeypatch, capsys):
    monkeypatch.setattr("learn.quantities.channels.Channels.most_known", 20)
    monkeypatch.setattr("learn.quantities.channels.Channels.at_once", 5)
    comparison = bisplat.compare(links, ["nearest"])
    assert "20 of the 48 known rows" in capsys.readouterr().err and comparison.rows[0]["known"] == 20
    assert comparison.each["nearest"]["snr_db"].shape == (12,)


def test_what_is_not_received_has_no_error_and_intervals_hold_by_distance(hall):
    comparison = bisplat.compare(hall, ["nearest", "log-distance"])
    truth = hall.powers[hall.test]
    assert comparison.rows[0]["not_received"] == np.isnan(truth).sum() > 0 and "not received" in comparison.remark()
    for each in comparison.each.values():
        assert np.array_equal(np.isnan(each["error_db"]), np.isnan(truth))
    assert intervals_by_distance(comparison, "nearest") == []
    bands = intervals_by_distance(comparison, "log-distance")
    row = next(row for row in comparison if row["label"] == "log-distance")
    assert sum(band["powers"] for band in bands) == row["powers"]
    held = sum(band["powers"] * band["coverage_90"] for band in bands)
    assert held == pytest.approx(row["powers"] * row["coverage_90"])


def test_a_report_of_powers_shows_gateways_and_intervals(hall, bisplat_command, tmp_path):
    bisplat.train(hall, tmp_path / "run", model="log-distance")
    status, _, err = bisplat_command("evaluate", tmp_path / "run")
    assert status == 0, err
    report = tmp_path / "run" / "evaluation"
    assert "<td>window</td>" in (report / "report.html").read_text() and (report / "error_map.png").exists()
    rows = list(csv.DictReader((report / "per_sample.csv").open()))
    heard = [row for row in rows if row["rssi_dbm"]]
    assert len(rows) == 24 and 0 < len(heard) < 24
    errors = [abs(float(row["predicted_dbm"]) - float(row["rssi_dbm"])) for row in heard]
    facts = json.loads((report / "results.json").read_text())["methods"]["log-distance"]
    assert np.median(errors) == pytest.approx(facts["error_median_db"], abs=0.01)
    scores = next(row for row in bisplat.compare(hall, ["log-distance"]) if row["label"] == "log-distance")
    assert scores["error_median_db"] == pytest.approx(facts["error_median_db"])


def test_a_report_of_channels_shows_delays_examples_and_a_map(placed, bisplat_command, tmp_path):
    bisplat.train(placed, tmp_path / "run", model="ramp")
    status, _, err = bisplat_command("evaluate", tmp_path / "run")
    assert status == 0, err
    report = tmp_path / "run" / "evaluation"
    names = {path.name for path in report.iterdir()}
    assert {"snr_cdf.png", "examples.png", "delay_spread.png", "snr_map.png"} <= names
    header = (report / "per_sample.csv").read_text().splitlines()[0]
    assert set(header.split(",")) == {"row", "x", "y", "z", "snr_db_copy", "snr_db_ramp", "snr_db_nearest"}


def test_a_frequency_that_is_not_stated_is_said(hall, bisplat_command, tmp_path):
    shutil.copytree(hall.folder, tmp_path / "ble", ignore=shutil.ignore_patterns("metadata.json"))
    assert "2400 MHz is assumed" in bisplat_command("compare", "ble", "--models", "mean")[2]


def test_nothing_received_or_sent_has_no_scores(bisplat_command, tmp_path):
    places = np.random.default_rng(0).uniform(0, 5, (30, 3))
    powers = np.full((30, 1), np.nan)
    powers[0] = -50
    bisplat.write_dataset(tmp_path / "far", places, powers=powers, gateways={"far": (90, 0, 0)}, frequency="2.4 GHz")
    channels = np.random.default_rng(0).normal(size=(20, 2, 8)) + 0j
    channels[::5, :, 4:] = 0
    write_links(tmp_path / "silent", channels)
    far = ("compare", "far", "--split", "blocked", "--methods", "mean", "helmholtz", "-o", "far-out", "--json")
    for call, key in ((far, "error_median_db"), (("compare", "silent", "-o", "out", "--json"), "snr_median_db")):
        status, out, err = bisplat_command(*call)
        assert status == 0, err
        assert all(each[key] is None for each in json.loads(out)["methods"].values())
