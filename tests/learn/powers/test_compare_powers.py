"""The table of received powers: scores, splits, what is not received, and the command."""

import csv
import json
import re
import sys

import numpy as np
import pytest

import bisplat
from bisplat.__main__ import main
from learn.powers.known_powers import PredictedPowers
from learn.powers.power_scores import of_gateway, score_powers

GATEWAYS = {"door": (0.0, 0, 2), "window": (9.0, 0, 2)}


@pytest.fixture(scope="module")
def hall(tmp_path_factory) -> bisplat.RssiDataset:
    """60 positions and two gateways; what lies below −61 dBm is not received."""
    generator = np.random.default_rng(0)
    places = generator.uniform((0, 0, 0), (9, 6, 2), (60, 3))
    distances = np.linalg.norm(places[:, None] - list(GATEWAYS.values()), axis=-1)
    powers = -40 - 25 * np.log10(distances) + generator.normal(0, 2, distances.shape)
    powers[powers < -61] = np.nan
    assert 0.1 < np.isnan(powers).mean() < 0.6
    folder = tmp_path_factory.mktemp("powers") / "hall"
    return bisplat.write_rssi(folder, places, powers, GATEWAYS, "2.4 GHz", floor_dbm=-61)


@pytest.fixture
def command(monkeypatch, capsys, tmp_path):
    """Function: arguments of ``bisplat compare`` -> status, stdout, stderr."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["bisplat", "compare", *map(str, arguments)])
        status = 0
        try:
            main()
        except SystemExit as ended:
            status = int(ended.code or 0)
        return status, *capsys.readouterr()

    return run


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
    assert [row["label"] for row in comparison] == [
        *("mean", "nearest", "inverse-distance", "log-distance", "mri", "kriging", "helmholtz")
    ]
    assert len({(row["powers"], row["not_received"]) for row in comparison}) == 1
    truth = hall.rssi_dbm[hall.test]
    assert comparison.rows[0]["not_received"] == np.isnan(truth).sum() > 0
    for errors in comparison.errors.values():
        assert np.array_equal(np.isnan(errors), np.isnan(truth))
    best = comparison.table()[0]
    assert best["error_median_db"] < 2 and best["received_rightly"] > 0.8
    stated = {row["label"] for row in comparison if row["coverage_90"] is not None}
    assert stated == {"log-distance", "mri", "kriging", "helmholtz"}


@pytest.mark.parametrize("split", ["files", "random", "blocked", "area"])
def test_splits_are_those_of_spectra(hall, split):
    comparison = bisplat.compare_powers(hall, ["mean"], split=split)
    parts = bisplat.split(hall, split, 0)
    assert (comparison.known, comparison.test) == (len(parts.known), len(parts.test))
    assert not set(parts.known) & set(parts.test)
    if split == "files":
        assert parts.test.tolist() == hall.test.tolist()


def test_train_size_and_guard_leave_fewer_known(hall):
    whole = bisplat.compare_powers(hall, ["mean"], split="random")
    fewer = bisplat.compare_powers(hall, ["mean"], split="random", train_size=10)
    guarded = bisplat.compare_powers(hall, ["mean"], split="random", guard=5)
    assert fewer.test == whole.test and fewer.known == 11 and guarded.known < whole.known
    assert guarded.distances.distance.min() >= 5 * hall.wavelength
    with pytest.raises(bisplat.InputError, match="expected 900 positions to train on, found 43"):
        bisplat.compare_powers(hall, ["mean"], split="random", train_size=900)


def test_the_command_prints_the_best_first_and_writes_nothing(hall, command, tmp_path):
    status, out, err = command(hall.folder, "--split", "random", "--methods", "mean", "log-distance")
    assert status == 0 and re.search("log-distance.*\n.* mean ", out) and "were not received" in out
    assert "from each of 12 test positions to the nearest of 48 known ones" in err
    assert not list(tmp_path.iterdir())


def test_the_command_writes_tables_and_a_figure(hall, command, tmp_path):
    call = (hall.folder, "-o", "table", "--models", "nearest", "helmholtz")
    assert command(*call)[0] == 0
    folder = tmp_path / "table"
    names = {path.name for path in folder.iterdir()}
    assert names == {"results.json", "table.tex", "table.csv", "error_cdf.png", "error_cdf.pdf"}
    facts = json.loads((folder / "results.json").read_text())
    assert facts["known"] == 48 and facts["methods"].keys() == {"nearest", "helmholtz"}
    assert facts["gateways"]["helmholtz"].keys() == GATEWAYS.keys()
    rows = list(csv.DictReader((folder / "table.csv").open()))
    assert float(rows[0]["error_median_db"]) == facts["methods"][rows[0]["method"]]["error_median_db"]
    status, _, err = command(*call)
    assert status == 1 and "--force replaces files of the same names" in err
    assert command(*call, "--force")[0] == 0


def test_json_is_what_the_folder_has(hall, command):
    status, out, _ = command(hall.folder, "--models", "nearest", "--json")
    assert status == 0 and json.loads(out)["methods"]["nearest"]["error_median_db"] > 0


def test_a_frequency_that_is_not_stated_is_said(hall, command, tmp_path):
    folder = tmp_path / "ble"
    folder.mkdir()
    for path in hall.folder.iterdir():
        if path.name != "metadata.json":
            (folder / path.name).write_bytes(path.read_bytes())
    assert "no frequency is stated, so 2400 MHz is assumed" in command(folder, "--models", "mean")[2]


def test_nothing_received_at_the_test_positions(command, tmp_path):
    places = np.random.default_rng(0).uniform(0, 5, (30, 3))
    powers = np.full((30, 1), np.nan)
    powers[0] = -50
    bisplat.write_rssi(tmp_path / "far", places, powers, {"far": (90, 0, 0)}, "2.4 GHz")
    status, _, err = command(tmp_path / "far", "--split", "blocked", "-o", "out")
    assert status == 0, err
    facts = json.loads((tmp_path / "out" / "results.json").read_text())
    assert all(each["error_median_db"] is None for each in facts["methods"].values())
