"""Predictions of a benchmark get the scores that our own methods get, and wrong ones are refused with a sentence."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import bisplat
from learn.benchmark import frozen as frozen_file
from learn.benchmark.benchmark_sets import SETS, BenchmarkSet, benchmarks
from learn.benchmark.folder_files import record_set
from learn.benchmark.frozen import freeze, frozen
from learn.benchmark.make_benchmark import parts_of_tasks
from learn.benchmark.method_results import add_result, read_results
from scenes.files.errors import InputError
from simulate.csi.csi_dataset import read_csi
from simulate.dataset.dataset_folder import read_dataset
from simulate.dataset.dataset_writer import write_index
from simulate.generation.dataset_parts import picture_names
from simulate.rssi.given_powers import write_rssi
from simulate.rssi.rssi_dataset import read_rssi
from simulate.rssi.rssi_writer import powers_csv
from tests.csi_folders import paths, write_links

COUNT = 40


@pytest.fixture(scope="module")
def sets(tmp_path_factory, workplace) -> Path:
    """Small frozen sets of each kind: spectra, powers and channels."""
    folder = tmp_path_factory.mktemp("sets")
    rng = np.random.default_rng(0)
    places = rng.uniform(0, 3, (COUNT, 3))
    shutil.copytree(workplace / "data" / "lab", folder / "spectra")
    powers = (-50 - 10 * places[:, :2]).round()
    powers[3, 1] = np.nan
    write_rssi(folder / "powers", places, powers, {"door": (0, 0, 1), "roof": (1, 1, 2)}, 2.4e9)
    gains = rng.standard_normal((COUNT, 2)) + 1j * rng.standard_normal((COUNT, 2))
    write_links(folder / "channels", paths(rng.uniform(0, 0.05, (COUNT, 2)), gains, 12))
    shutil.copy(folder / "powers" / "tx_pos.csv", folder / "channels")
    with pytest.MonkeyPatch.context() as patches:
        patches.setattr(frozen_file, "FACTS", folder / "frozen.json")
        for kind, read in (("spectra", read_dataset), ("powers", read_rssi), ("channels", read_csi)):
            of = BenchmarkSet("a test", kind, "closet", COUNT)
            patches.setitem(SETS, kind, of)
            dataset = read(folder / kind)
            names = getattr(dataset, "names", [str(row) for row in range(len(dataset))])
            for task, parts in parts_of_tasks(of, dataset).items():
                (folder / kind / "tasks" / task).mkdir(parents=True)
                for part, rows in zip(("train", "test"), parts, strict=True):
                    write_index(folder / kind / "tasks" / task / f"{part}_index.txt", [names[row] for row in rows])
            record_set(folder / kind, kind)
            frozen.cache_clear()
            freeze(kind, folder / kind)
        benchmarks.cache_clear()
        frozen.cache_clear()
        yield folder
    benchmarks.cache_clear()
    frozen.cache_clear()


@pytest.fixture
def guesses(tmp_path) -> Path:
    """A folder for predictions."""
    folder = tmp_path / "guesses"
    folder.mkdir()
    return folder


def test_spectra_get_the_scores_of_compare(sets, guesses, tmp_path):
    task = bisplat.read_benchmark("spectra-random", sets / "spectra")
    (row,) = [
        each for each in bisplat.compare(task, ["nearest"], output=tmp_path / "own") if each["label"] == "nearest"
    ]
    distances = np.linalg.norm(task.positions[task.test][:, None] - task.positions[task.train], axis=-1)
    copied = task.spectra[task.train[distances.argmin(axis=1)]]
    np.save(guesses / "spectra.npy", copied)
    found = bisplat.score_predictions(guesses, sets / "spectra", "spectra-random")
    assert found["ssim_median"] == pytest.approx(row["ssim_median"], abs=1e-9)
    assert found["aoa_error_median_deg"] == pytest.approx(row["aoa_error_median_deg"])
    (guesses / "spectra.npy").unlink()
    for name, spectrum in zip([task.names[each] for each in task.test], copied, strict=True):
        Image.fromarray((255 * spectrum).round().astype(np.uint8)).save(guesses / f"{name}.png")
    pictures = bisplat.score_predictions(guesses, sets / "spectra", "spectra-random")
    assert pictures["ssim_median"] == pytest.approx(found["ssim_median"])
    assert pictures["predictions_sha256"] != found["predictions_sha256"]


def test_powers_are_scored_by_their_gateways_names(sets, guesses):
    task = bisplat.read_benchmark("powers-random", sets / "powers")
    off = np.nan_to_num(task.rssi_dbm[task.test], nan=-100.0) + 2
    (guesses / "gateway_rssi.csv").write_text(powers_csv(["roof", "door"], off[:, ::-1]))
    found = bisplat.score_predictions(guesses, sets / "powers", "powers-random")
    assert found["error_median_db"] == 2 and found["coverage_90"] is None
    for name, add in (("low", -3), ("high", -1)):
        (guesses / f"gateway_rssi_{name}.csv").write_text(powers_csv(["door", "roof"], off + add))
    assert bisplat.score_predictions(guesses, sets / "powers", "powers-random")["coverage_90"] == 1
    (guesses / "gateway_rssi_high.csv").write_text(powers_csv(["door", "roof"], off - 4))
    with pytest.raises(InputError, match=r"gateway_rssi_low.csv: expected no power above that of gateway_rssi_high"):
        bisplat.score_predictions(guesses, sets / "powers", "powers-random")


def test_channels_get_the_scores_of_compare(sets, guesses):
    task = bisplat.read_benchmark("channels-random", sets / "channels")
    (row,) = bisplat.compare_channels(task, ["copy"])
    np.save(guesses / "downlink.npy", task.uplink[task.test])
    found = bisplat.score_predictions(guesses, sets / "channels", "channels-random")
    assert found["snr_median_db"] == pytest.approx(row["snr_median_db"], abs=1e-6)
    assert found["correlation_median"] == pytest.approx(row["correlation_median"])


def refusals(kind: str, count: int) -> list[tuple[str, object, str]]:
    """File, content and what is said, for predictions of a kind."""
    bad = np.full((count, 90, 360), 0.5)
    bad[1] = np.nan
    return {
        "spectra": [
            (
                "spectra.npy",
                np.zeros((count + 1, 90, 360)),
                f"expected spectra \\[{count}, 90, 360\\] of the test",
            ),
            (
                "spectra.npy",
                np.full((count, 90, 360), 200.0),
                "expected numbers from 0 to 1 .*, found float64 up to",
            ),
            ("spectra.npy", bad, f"found others in 1 of {count} rows, first in row 1"),
            ("notes.txt", "hello", "expected spectra.npy, or a picture NAME.png of each test spectrum, found neither"),
        ],
        "powers": [
            ("gateway_rssi.csv", "door\n-50\n", 'expected a column for each gateway, found none of "roof"'),
            ("gateway_rssi.csv", "door,roof\n-50,-50\n", f"a row for each of the {count} test positions, found 1 rows"),
            ("others.csv", "", "gateway_rssi.csv: expected a CSV of received powers, found"),
        ],
        "channels": [
            ("downlink.npy", np.zeros((count, 4, 6)), f"expected channels \\[{count}, 4, 6\\] of the test rows"),
            ("downlink.npy", np.full((count, 4, 6), 1j * np.nan), f"found others in {count} of {count} rows"),
        ],
    }[kind]


@pytest.mark.parametrize("kind", ["spectra", "powers", "channels"])
def test_wrong_predictions_are_refused(sets, guesses, kind):
    count = len(bisplat.read_benchmark(f"{kind}-random", sets / kind).test)
    with pytest.raises(InputError, match="nowhere: expected a folder of predictions, found nothing there"):
        bisplat.score_predictions("nowhere", sets / kind, f"{kind}-random")
    for name, content, said in refusals(kind, count):
        for path in guesses.iterdir():
            path.unlink()
        if isinstance(content, str):
            (guesses / name).write_text(content)
        else:
            np.save(guesses / name, content)
        with pytest.raises(InputError, match=said):
            bisplat.score_predictions(guesses, sets / kind, f"{kind}-random")


def test_unknown_benchmark_is_named_with_the_nearest(sets):
    with pytest.raises(InputError, match="found 'spectra-randum'; did you mean \"spectra-random\""):
        bisplat.score_predictions("x", sets / "spectra", "spectra-randum")


def test_results_of_a_method_are_added_to_its_file(sets, tmp_path):
    path = tmp_path / "mine.json"
    scores = {"error_median_db": 2.0, "coverage_90": None, "powers": 8, "predictions_sha256": "ab"}
    add_result(path, "mine", "powers-random", scores, replaced=False)
    add_result(path, "mine", "spectra-blocked", {"ssim_median": 0.5}, replaced=False)
    found = read_results(path)
    assert list(found["results"]) == ["spectra-blocked", "powers-random"] and found["method"] == "mine"
    assert found["results"]["powers-random"]["predictions_sha256"] == "ab"
    assert found["results"]["powers-random"]["test_sha256"] == frozen()["powers"]["tasks"]["random"]["test"]
    with pytest.raises(InputError, match="expected no scores on powers-random yet, found some; --force replaces them"):
        add_result(path, "mine", "powers-random", scores, replaced=False)
    with pytest.raises(InputError, match="expected the results of the method 'other', found those of 'mine'"):
        add_result(path, "other", "powers-blocked", scores, replaced=False)
    add_result(path, "mine", "powers-random", {"error_median_db": 1.0}, replaced=True)
    assert read_results(path)["results"]["powers-random"]["scores"] == {"error_median_db": 1.0}
    path.write_text(json.dumps({"method": "mine", "results": {"attic-random": found["results"]["powers-random"]}}))
    with pytest.raises(InputError, match=r"mine.json: benchmark: expected a dataset and a task"):
        read_results(path)


def test_known_rows_are_as_many_as_the_task_says_and_nested(sets):
    dataset = read_rssi(sets / "powers")
    of = replace(SETS["powers"], known=(5, 12))
    parts = parts_of_tasks(of, dataset)
    assert [len(known) for known, _ in parts.values()] == [5, 12, 5, 12]
    for split in ("random", "blocked"):
        few, more = (set(parts[f"{split}-{size}"][0].tolist()) for size in (5, 12))
        assert few < more and not more & set(parts[f"{split}-12"][1].tolist())


@pytest.fixture
def twice(tmp_path, monkeypatch) -> Path:
    """A small frozen set whose positions have spectra at two frequencies each."""
    hertz = (902e6, 1.8e9)
    sight = bisplat.Propagation(max_depth=0, diffraction=False, rays=100)
    folder = bisplat.simulate("closet", tmp_path / "twice", COUNT, propagation=sight, frequencies=hertz).folder
    of, names = (
        BenchmarkSet("a test", "spectra", "closet", COUNT, options={"frequencies": hertz}),
        picture_names(2 * COUNT),
    )
    monkeypatch.setattr(frozen_file, "FACTS", tmp_path / "frozen.json")
    monkeypatch.setitem(SETS, "twice", of)
    for task, parts in parts_of_tasks(of, read_dataset(folder, hertz[0])).items():
        (folder / "tasks" / task).mkdir(parents=True)
        for part, rows in zip(("train", "test"), parts, strict=True):
            write_index(folder / "tasks" / task / f"{part}_index.txt", [names[row] for row in rows])
    record_set(folder, "twice")
    for cached in (benchmarks, frozen):
        cached.cache_clear()
    freeze("twice", folder)
    frozen.cache_clear()
    yield folder
    for cached in (benchmarks, frozen):
        cached.cache_clear()


def test_every_frequency_of_a_set_is_known_and_tested_at_the_same_positions(twice, tmp_path):
    low, high = (bisplat.read_benchmark("twice-random", twice, hertz) for hertz in (902e6, 1.8e9))
    for part in ("train", "test"):
        rows = getattr(low, part), getattr(high, part)
        np.testing.assert_array_equal(low.positions[rows[0]], high.positions[rows[1]])
        assert not {low.names[row] for row in rows[0]} & {high.names[row] for row in rows[1]} and len(rows[0])
    pictures = {name: spectrum for each in (low, high) for name, spectrum in zip(each.names, each.spectra, strict=True)}
    names = (twice / "tasks" / "random" / "test_index.txt").read_text().split()
    assert len(names) == len(low.test) + len(high.test)
    truth = np.stack([pictures[name] for name in names])
    scores = []
    for predicted in (truth, np.roll(truth, 1, axis=0), truth[::-1]):
        (tmp_path / "out").mkdir(exist_ok=True)
        np.save(tmp_path / "out" / "spectra.npy", predicted)
        scores.append(bisplat.score_predictions(tmp_path / "out", twice, "twice-random")["ssim_median"])
    assert scores[0] == pytest.approx(1) and max(scores[1:]) < 0.99
