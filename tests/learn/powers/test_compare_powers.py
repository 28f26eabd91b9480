"""The table of received powers: scores, splits, what is not received, and the command."""

import csv
import json
import shutil

import numpy as np
import pytest
from learn.powers.power_comparison import of_gateway, score_powers

import bisplat
from learn.quantities.known_powers import PredictedPowers


def test_scores_by_hand():
    truth = np.array([[-50.0, -60.0], [-52.0, np.nan], [-54.0, np.nan]])
    median = np.array([[-51.0, -70.0], [-50.0, -80.0], [-60.0, -95.0]])
    found = score_powers(PredictedPowers(median, median - 3, median + 3), truth, floor=-90)
    assert (found["powers"], found["not_received"]) == (4, 2)
    assert found["error_median_db"] == 4 and found["error_p90_db"] == pytest.approx(8.8)
    assert found["rmse_db"] == pytest.approx(np.sqrt((1 + 4 + 36 + 100) / 4))
    assert found["received_rightly"] == pytest.approx(5 / 6)  # −80 dBm would have been received
    assert found["coverage_90"] == 0.5 and found["interval_median_db"] == 6
    second = score_powers(of_gateway(PredictedPowers(median), 1), truth[:, [1]], floor=-90)
    assert second["error_median_db"] == 10 and second["coverage_90"] is None
    silent = score_powers(PredictedPowers(median), np.full((3, 2), np.nan), floor=-90)
    assert silent["error_median_db"] is None and silent["powers"] == 0


def test_every_method_is_scored_on_the_same_powers(hall):
    comparison = bisplat.compare_powers(hall)
    assert len({(row["powers"], row["not_received"]) for row in comparison}) == 1
    truth = hall.rssi_dbm[hall.test]
    assert comparison.rows[0]["not_received"] == np.isnan(truth).sum() > 0
    for errors in comparison.errors.values():
        assert np.array_equal(np.isnan(errors), np.isnan(truth))
    best = comparison.table()[0]
    assert best["error_median_db"] < 2 and best["received_rightly"] > 0.8
    labels = {row["label"] for row in comparison}
    stated = {row["label"] for row in comparison if row["coverage_90"] is not None}
    assert stated == {"log-distance", "mri", "kriging", "helmholtz", "mirror-images"}
    assert labels - stated == {"mean", "nearest", "inverse-distance"}


def test_every_gateway_is_scored_by_itself(hall):
    comparison = bisplat.compare_powers(hall, ["mean", "log-distance"], seeds=2)
    facts = comparison.facts()["gateways"]["mean"]
    assert facts.keys() == {"door", "window"} and facts["door"]["seeds"] == 2
    assert sum(each["powers"] for each in facts.values()) == comparison.averages()[0]["powers"]


def test_intervals_by_distance_count_every_received_power(hall):
    comparison = bisplat.compare_powers(hall, ["nearest", "log-distance"])
    assert comparison.intervals_by_distance("nearest") == []
    bands = comparison.intervals_by_distance("log-distance")
    row = comparison.rows[1]
    assert sum(band["powers"] for band in bands) == row["powers"]
    held = sum(band["powers"] * band["coverage_90"] for band in bands)
    assert held == pytest.approx(row["powers"] * row["coverage_90"])


def test_a_report_shows_gateways_and_intervals(hall, bisplat_command, tmp_path):
    status, _, err = bisplat_command("evaluate", hall.folder, "-o", "report", "--model", "log-distance")
    assert status == 0, err
    page = (tmp_path / "report" / "report.html").read_text()
    assert "<td>window</td>" in page and (tmp_path / "report" / "error_map.png").exists()
    rows = list(csv.DictReader((tmp_path / "report" / "per_sample.csv").open()))
    heard = [row for row in rows if row["rssi_dbm"]]
    assert len(rows) == 24 and 0 < len(heard) < 24
    errors = [abs(float(row["predicted_dbm"]) - float(row["rssi_dbm"])) for row in heard]
    facts = json.loads((tmp_path / "report" / "results.json").read_text())["methods"]["log-distance"]
    assert np.median(errors) == pytest.approx(facts["error_median_db"], abs=0.01)


def test_a_frequency_that_is_not_stated_is_said(hall, bisplat_command, tmp_path):
    shutil.copytree(hall.folder, tmp_path / "ble", ignore=shutil.ignore_patterns("metadata.json"))
    assert "2400 MHz is assumed" in bisplat_command("compare", "ble", "--models", "mean")[2]


def test_nothing_received_at_the_test_positions(bisplat_command, tmp_path):
    places = np.random.default_rng(0).uniform(0, 5, (30, 3))
    powers = np.full((30, 1), np.nan)
    powers[0] = -50
    bisplat.write_rssi(tmp_path / "far", places, powers, {"far": (90, 0, 0)}, "2.4 GHz")
    status, _, err = bisplat_command("compare", tmp_path / "far", "--split", "blocked", "-o", "out")
    assert status == 0, err
    facts = json.loads((tmp_path / "out" / "results.json").read_text())
    assert all(each["error_median_db"] is None for each in facts["methods"].values())
