"""The measuring stick: each row measured once, on the same spectra, by the same code as ``bisplat evaluate``."""

import json
import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from learn.baselines.kriging import krige_pictures, krige_responses
from learn.baselines.neighbours import nearest
from learn.comparison.ablate import ablate, variants
from learn.comparison.compare import compare
from learn.comparison.experiment import CEILING, summary
from learn.comparison.methods import METHODS, Task, Trained
from learn.comparison.sweep import sweep
from learn.metrics import score
from learn.splits import split
from scenes.errors import InputError
from simulate.array import PlanarArray
from simulate.dataset import read_dataset
from simulate.spectrum import normalise

pytestmark = pytest.mark.usefixtures("small_models", "no_ceiling")

INSTANT = 1e-6
"""Minutes that hold one step."""


@pytest.fixture
def no_ceiling(monkeypatch):
    monkeypatch.setattr("learn.comparison.experiment.array_ceiling", lambda truth, array: truth)


@pytest.fixture
def rows():
    """Function: an experiment's rows."""
    return lambda folder: [json.loads(line) for line in (folder / "results.jsonl").read_text().splitlines()]


def test_table_has_the_scores_of_each_method_on_the_test_part(tiny, tmp_path, rows):
    table = compare(tiny, tmp_path / "out", ("mean-picture", "nearest"), "files", INSTANT, 1)
    assert set(table) == {"mean-picture", "nearest", CEILING} and next(iter(table)) == CEILING
    dataset = read_dataset(tiny)
    parts = split(dataset, "files", 0)
    known = dataset.pictures[parts.known] / np.float32(255)
    copied = nearest(dataset.positions[parts.known], known, dataset.positions[parts.test])
    expected = score(copied, dataset.pictures[parts.test] / np.float32(255))
    (row,) = (row for row in rows(tmp_path / "out") if row["label"] == "nearest")
    assert expected.summary().items() <= row.items() and row["test"] == 5
    lines = (tmp_path / "out" / "per_sample" / "nearest-0.csv").read_text().splitlines()
    assert [float(line.split(",")[1]) for line in lines[1:]] == pytest.approx(expected.ssim.tolist(), abs=1e-6)
    page = (tmp_path / "out" / "table.html").read_text()
    assert "nearest" in page and f"{row['ssim_median']:.3f}" in page


def test_row_is_made_once_and_missing_ones_are_added(tiny, tmp_path, rows):
    out = tmp_path / "out"
    compare(tiny, out, ("nearest",), "files", INSTANT, 1)
    before = rows(out)
    compare(tiny, out, ("nearest", "mean-picture"), "files", INSTANT, 1)
    assert rows(out)[: len(before)] == before
    assert [row["label"] for row in rows(out)[len(before) :]] == ["mean-picture"]


def test_folder_of_another_protocol_or_of_something_else_is_refused(tiny, tmp_path):
    compare(tiny, tmp_path / "out", ("nearest",), "files", INSTANT, 1)
    with pytest.raises(InputError, match="found one whose split is files, not random"):
        compare(tiny, tmp_path / "out", ("nearest",), "random", INSTANT, 1)
    (tmp_path / "letters").mkdir()
    (tmp_path / "letters" / "love.txt").write_text("dear")
    with pytest.raises(InputError, match="expected a new folder or an earlier experiment, found other"):
        compare(tiny, tmp_path / "letters", ("nearest",), "files", INSTANT, 1)


@pytest.mark.parametrize("name", ["nearets", "no_such_module:Class", "json:NoSuchClass"])
def test_unknown_method_is_refused_before_anything_is_written(tiny, tmp_path, name):
    with pytest.raises(InputError, match="--models: expected"):
        compare(tiny, tmp_path / "out", ("nearest", name), "files", INSTANT, 1)
    assert not (tmp_path / "out").exists()


def test_method_in_the_docs_joins_the_table(tiny, tmp_path, monkeypatch, rows):
    (code,) = re.findall(r"```python\n(.*?)```", (Path(__file__).parents[3] / "docs/compare.md").read_text(), re.DOTALL)
    assert len(code.splitlines()) < 40
    (tmp_path / "mymethod.py").write_text(code)
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    table = compare(tiny, tmp_path / "out", ("mean-picture", "mymethod:KNearest"), "files", INSTANT, 1)
    assert table["mymethod:KNearest"]["ssim_median"] > table["mean-picture"]["ssim_median"]


def test_trained_model_is_a_run_that_is_not_trained_twice(tiny, tmp_path):
    task = Task(read_dataset(tiny), "files", 0, None, 1, INSTANT, None, tmp_path / "run")
    positions = task.dataset.positions[:3]
    first = Trained("bisplat-aperture")
    first.fit(task)
    weights = tmp_path / "run" / "weights.safetensors"
    written = weights.stat().st_mtime_ns
    again = Trained("bisplat-aperture")
    again.fit(replace(task, minutes=99.0))
    assert weights.stat().st_mtime_ns == written
    np.testing.assert_array_equal(again.predict(positions), first.predict(positions))
    assert first.parameters > 1000 and first.seconds > 0


def test_budget_becomes_steps(tiny, tmp_path, monkeypatch):
    monkeypatch.setattr("learn.comparison.methods._seconds_per_step", lambda config, task: 0.5)
    seen = []
    monkeypatch.setattr("learn.comparison.methods.train", lambda config, folder: seen.append(config))
    monkeypatch.setattr("learn.comparison.methods.load_run", lambda folder: None)
    Trained("mlp").fit(Task(read_dataset(tiny), "files", 0, None, 7, 3.0, None, tmp_path / "run"))
    assert seen[0].steps == 360 and seen[0].seed == 7


@pytest.mark.parametrize("name", sorted(set(METHODS) - {"bisplat-plus", "nerf2"}))
def test_every_method_fits_and_predicts(tiny, tmp_path, name):
    dataset = read_dataset(tiny)
    task = Task(dataset, "files", 0, None, 0, INSTANT, None, tmp_path / "run")
    method = METHODS[name]()
    method.fit(task)
    pictures = method.predict(dataset.positions[task.parts.test])
    assert pictures.shape == (5, 90, 360) and np.isfinite(pictures).all()


# Kriging


@pytest.fixture
def smooth(plane_waves):
    """Positions along a line, and the responses to two waves whose directions and phases turn slowly with it."""
    along = np.sort(np.random.default_rng(0).uniform(0, 1, 60))
    positions = np.stack([2 * along, 0.3 * along, np.ones(60)], axis=1)
    waves = [((np.exp(6j * t), 20 + 90 * t, 40), (0.5, 250, 60 - 20 * t)) for t in along]
    return positions, np.array([plane_waves(*each) for each in waves])


def test_kriging_is_nearer_than_the_nearest(smooth):
    positions, responses = smooth
    pictures = normalise(PlanarArray().spectrum(responses)).astype(np.float32)
    known, asked = np.arange(60) % 3 != 1, np.arange(60) % 3 == 1
    copied = np.abs(nearest(positions[known], pictures[known], positions[asked]) - pictures[asked]).mean()
    kriged = krige_pictures(positions[known], pictures[known], 0)(positions[asked])
    assert np.abs(kriged - pictures[asked]).mean() < 0.5 * copied
    kriged = krige_responses(positions[known], responses[known], PlanarArray(), 0)(positions[asked])
    assert np.abs(kriged - pictures[asked]).mean() < 0.2 * copied


# Ablation and sweep


def test_ablation_has_the_papers_rows_and_ours(tiny, tmp_path, rows):
    assert [label.replace("bisplat-plus", "") for label, _ in variants("bisplat-plus")] == [
        "",
        " without dynamic network",
        " without delta decoder",
        " without BST",
    ]
    assert dict(variants("bisplat-plus"))["bisplat-plus without BST"] == Trained("bisplat-plus", ("bst",))
    ours = dict(variants("bisplat-aperture"))
    assert ours["bisplat-aperture without aperture"].model == "bisplat"
    assert ours["bisplat-aperture without depth order"].bypass == ("order",)
    smaller = dict(variants("bisplat", 250))
    assert len(smaller) == 4
    assert smaller["bisplat (250 primitives) without BST"] == Trained("bisplat", ("bst",), {"primitives": 250})

    out = tmp_path / "out"
    table = ablate(tiny, out, ("bisplat",), "files", 2, 2)
    assert {(row["label"], row["seed"]) for row in rows(out)} == {(label, s) for label in table for s in (0, 1)}
    assert len(table) == 4 and all(row["seeds"] == 2 for row in table.values())
    assert (out / "ablation.png").stat().st_size > 5000
    configs = [json.loads(path.read_text()) for path in (out / "runs").glob("*/config.json")]
    assert len(configs) == 8 and {config["steps"] for config in configs} == {2}
    with pytest.raises(InputError, match="found one whose steps is 2, not 3"):
        ablate(tiny, out, ("bisplat",), "files", 3, 2)


def test_summary_is_the_mean_and_the_standard_deviation_over_seeds():
    rows = [{"label": "a", "seed": seed, "ssim_median": value, "date": "x"} for seed, value in enumerate((0.5, 0.7))]
    found = summary(rows, lambda row: row["label"])["a"]
    assert found["ssim_median"] == pytest.approx(0.6)
    assert found["ssim_spread"] == pytest.approx(np.sqrt(0.02)) and found["seeds"] == 2


def test_sweep_grows_the_training_part_and_keeps_the_test_part(tiny, tmp_path, rows):
    out = tmp_path / "out"
    table = sweep(tiny, out, ("nearest", "mlp"), (5, 15), "files", INSTANT, 1)
    assert set(table) == {(name, size) for name in ("nearest", "mlp") for size in (5, 15)}
    assert [row["train"] for row in rows(out)] == [5, 5, 15, 15] and {row["test"] for row in rows(out)} == {5}
    assert (out / "sweep.png").stat().st_size > 5000
    with pytest.raises(InputError, match="expected 18 spectra to train on, found 17"):
        sweep(tiny, out, ("nearest",), (18,), "files", INSTANT, 1)


def test_sweep_also_goes_on_from_a_finished_run(finished_run, tiny, tmp_path, rows):
    sweep(tiny, tmp_path / "out", ("nearest",), (10,), "files", INSTANT, 1, finished_run)
    label = f"bisplat-aperture from {finished_run.name}"
    assert [row["label"] for row in rows(tmp_path / "out")] == ["nearest", label]
