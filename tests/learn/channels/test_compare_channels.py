"""The table of predicted downlinks: scores, splits, and the command."""

import csv
import dataclasses
import json
import re
import sys

import numpy as np
import pytest

import bisplat
from bisplat.__main__ import main
from learn.channels.channel_scores import correlation, score_channels, snr_db
from tests.csi_folders import paths, write_links


@pytest.fixture(scope="module")
def links(tmp_path_factory) -> bisplat.CsiDataset:
    """60 rows, 4 antennas, 12 + 12 subcarriers, two paths each."""
    generator = np.random.default_rng(0)
    gains = generator.normal(size=(60, 2)) + 1j * generator.normal(size=(60, 2))
    channels = paths(generator.uniform(0, 0.08, (60, 2)), gains * [1, 0.3], 24)
    folder = tmp_path_factory.mktemp("channels") / "links"
    write_links(folder, channels.astype(np.complex64))
    return bisplat.read_csi(folder)


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
    truth = np.array([[[3.0, 4.0j]], [[1.0, 0.0]], [[0.0, 0.0]], [[2.0, 0.0]]])
    predicted = np.array([[[3.0, 3.5j]], [[0.0, 0.0]], [[1.0, 1.0]], [[2.0j, 2.0]]])
    np.testing.assert_allclose(snr_db(predicted, truth), [20, 0, np.nan, 10 * np.log10(4 / 12)], atol=1e-9)
    alike = (9 + 14) / (5 * np.sqrt(9 + 3.5**2))
    np.testing.assert_allclose(correlation(predicted, truth), [alike, 0, np.nan, np.sqrt(0.5)])
    found = score_channels(predicted, truth)
    assert found["rows"] == 3 and found["snr_median_db"] == 0
    assert found["snr_mean_db"] == pytest.approx((20 + 10 * np.log10(4 / 12)) / 3)
    assert found["correlation_median"] == pytest.approx(np.sqrt(0.5))
    assert score_channels(predicted, 0 * truth) == {
        "rows": 0, "snr_median_db": None, "snr_mean_db": None, "snr_p10_db": None, "correlation_median": None,
    }  # fmt: skip


def test_every_method_is_scored_on_the_same_rows(links):
    comparison = bisplat.compare_channels(links)
    assert [row["label"] for row in comparison] == ["copy", "ramp", "nearest", "delays", "helmholtz"]
    assert (comparison.known, comparison.test) == (48, 12)
    assert {row["rows"] for row in comparison} == {12}
    for row in comparison:
        assert np.median(comparison.snr_db[row["label"]]) == pytest.approx(row["snr_median_db"])
    best, *_, worst = comparison.table()
    assert best["label"] in ("delays", "helmholtz") and best["snr_median_db"] > worst["snr_median_db"] + 5
    assert str(comparison).splitlines()[1].startswith(best["label"])


def test_scores_do_not_depend_on_the_unit(links):
    up, down = (1e-200 * link.astype(complex) for link in (links.uplink, links.downlink))
    tiny = dataclasses.replace(links, uplink=up, downlink=down)
    for row, other in zip(bisplat.compare_channels(links), bisplat.compare_channels(tiny), strict=True):
        assert other["snr_median_db"] == pytest.approx(row["snr_median_db"], abs=0.01)


@pytest.mark.parametrize("split", ["files", "random", "blocked", "area"])
def test_splits_are_those_of_spectra(links, split):
    places = np.random.default_rng(1).uniform(0, 5, (len(links), 3))
    placed = dataclasses.replace(links, positions=places)
    comparison = bisplat.compare_channels(placed, ["copy"], split=split)
    parts = bisplat.split(placed, split, 0)
    assert (comparison.known, comparison.test) == (len(parts.known), len(parts.test))
    if split == "files":
        assert parts.test.tolist() == links.test.tolist()


def test_what_a_split_needs_is_said(links):
    with pytest.raises(bisplat.InputError, match=r"expected positions \(tx_pos.csv\) for the split area, found none"):
        bisplat.compare_channels(links, ["copy"], split="area")
    with pytest.raises(bisplat.InputError, match="expected 900 rows to train on, found 43"):
        bisplat.compare_channels(links, ["copy"], train_size=900)
    with pytest.raises(bisplat.InputError, match="guard: expected 0 for channels"):
        bisplat.split(links, "random", 0, guard=0.5)
    assert bisplat.compare_channels(links, ["copy"], train_size=10).known == 11


def test_many_known_rows_are_drawn_from(links, monkeypatch, capsys):
    monkeypatch.setattr("learn.channels.compare_channels.MOST_KNOWN", 20)
    monkeypatch.setattr("learn.channels.compare_channels.BLOCK", 5)
    comparison = bisplat.compare_channels(links, ["nearest"])
    assert "the methods learn from 20 of the 48 known rows" in capsys.readouterr().err
    assert comparison.snr_db["nearest"].shape == (12,)


def test_the_command_prints_the_best_first_and_writes_nothing(links, command, tmp_path):
    status, out, err = command(links.folder, "--methods", "copy", "delays")
    assert status == 0 and re.search("delays.*\n.* copy ", out)
    assert "assumed that the downlink's subcarriers follow the uplink's at the same distance" in err
    assert not list(tmp_path.iterdir())


def test_the_command_writes_tables_and_a_figure(links, command, tmp_path):
    call = (links.folder, "-o", "table", "--split", "random", "--models", "nearest", "delays")
    assert command(*call)[0] == 0
    folder = tmp_path / "table"
    names = {path.name for path in folder.iterdir()}
    assert names == {"results.json", "table.tex", "table.csv", "snr_cdf.png", "snr_cdf.pdf"}
    facts = json.loads((folder / "results.json").read_text())
    assert facts["known"] == 48 and facts["methods"].keys() == {"nearest", "delays"}
    assert "48 known rows, 12 test rows" in facts["provenance"]["spectra"]
    rows = list(csv.DictReader((folder / "table.csv").open()))
    assert float(rows[0]["snr_median_db"]) == facts["methods"][rows[0]["method"]]["snr_median_db"]
    status, _, err = command(*call)
    assert status == 1 and "--force replaces files of the same names" in err
    assert command(*call, "--force")[0] == 0


def test_a_downlink_of_zeros_has_no_scores(command, tmp_path):
    channels = np.random.default_rng(0).normal(size=(20, 2, 8)) + 0j
    channels[::5, :, 4:] = 0
    write_links(tmp_path / "silent", channels)
    status, out, err = command("silent", "-o", "out", "--json")
    assert status == 0, err
    assert all(each["snr_median_db"] is None for each in json.loads(out)["methods"].values())
