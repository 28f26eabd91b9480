"""The measuring stick: each row measured once, on the same spectra, by the same code as ``bisplat evaluate``."""

import csv
import importlib
import json
import shutil
import sys
import tempfile
from dataclasses import replace
from functools import partial
from inspect import signature
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest
from learn.comparison.ablate import ablate, variants
from learn.comparison.averaged_table import FEW_STEPS, averaged
from learn.comparison.experiment import CEILING
from learn.comparison.known_spectra import KnownSpectra
from learn.comparison.spectrum_methods import TrainedModel, method_named, method_names
from PIL import Image
from safetensors.torch import load_file, save_file

from bisplat.commands import comparison_commands, training_commands
from learn.comparison import experiment
from learn.comparison import spectrum_methods as trained_model
from learn.comparison.compare import compare, spectrum_factories, sweep
from learn.data.metrics import score
from learn.data.neighbours import nearest
from learn.data.splits import split
from learn.methods.interpolation import krige_responses, krige_spectra
from learn.reports.comparison_report import validation_curve, write_ablation, write_comparison, write_sweep
from learn.training.budget import Speed
from learn.training.config import read_config
from learn.training.run_files import read_training
from learn.training.run_folder import load_run
from learn.training.train import train
from learn.training.validation_part import Learned
from scenes.files.errors import InputError, ParameterError
from scenes.files.output_folder import locked
from simulate.dataset.dataset_folder import read_dataset
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.identification import Identification
from simulate.spectra.spectrum import evenly, normalise, spectrum_of
from tests.docs.pages import blocks

pytestmark = pytest.mark.usefixtures("small_models", "no_ceiling")

INSTANT = 1e-6  # Minutes that hold one step


@pytest.fixture
def no_ceiling(monkeypatch):
    monkeypatch.setattr(experiment, "array_ceiling", lambda truth, beamformer, recorded: truth)


@pytest.fixture
def rows():
    """Function: an experiment's rows."""
    return lambda folder: [json.loads(line) for line in (folder / "results.jsonl").read_text().splitlines()]


def test_table_has_the_scores_of_each_method_on_the_test_part(tiny, tmp_path, rows):
    comparison = compare(tiny, ("mean-picture", "nearest"), budget=INSTANT, output=tmp_path / "out")
    labels = [row["label"] for row in comparison.table()]
    assert set(labels) == {"mean-picture", "nearest", CEILING} and labels[-1] == CEILING  # though it scores highest
    dataset = read_dataset(tiny)
    parts = split(dataset, "files", 0)
    known = spectrum_of(dataset.pictures[parts.known])
    copied = nearest(dataset.positions[parts.known], known, dataset.positions[parts.test])
    expected = score(copied, spectrum_of(dataset.pictures[parts.test]), dataset.grid)
    (row,) = (row for row in rows(tmp_path / "out") if row["label"] == "nearest")
    assert expected.summary().items() <= row.items()
    assert (row["train"], row["known"], row["test"]) == (17, 19, 5)
    lines = (tmp_path / "out" / "per_sample" / "nearest-0.csv").read_text().splitlines()
    assert [float(line.split(",")[1]) for line in lines[1:]] == pytest.approx(expected.ssim.tolist(), abs=1e-6)
    np.testing.assert_allclose(comparison.per_sample(row)["ssim"], expected.ssim, atol=1e-6)
    write_comparison(comparison, tmp_path / "out")
    page = (tmp_path / "out" / "table.html").read_text()
    assert "nearest" in page and f"{row['ssim_median']:.3f}" in page and "ceiling (bound)" in page


def test_row_is_made_once_and_missing_ones_are_added(tiny, tmp_path, rows):
    out = tmp_path / "out"
    compare(tiny, ("nearest",), budget=INSTANT, output=out)
    before = rows(out)
    assert compare(tiny, ("nearest", "mean-picture"), budget=INSTANT, output=out).rows == rows(out)
    assert rows(out)[: len(before)] == before
    assert [row["label"] for row in rows(out)[len(before) :]] == ["mean-picture"]


@pytest.mark.parametrize("text", ["", "[]", "{"])
def test_damaged_protocol_is_one_sentence(tiny, tmp_path, text):
    (tmp_path / "protocol.json").write_text(text)
    with pytest.raises(InputError, match=r"protocol\.json: expected .*, found"):
        compare(tiny, ("nearest",), budget=INSTANT, output=tmp_path)


def test_folder_of_another_process_or_protocol_or_of_something_else_is_refused(tiny, tmp_path):
    with locked(tmp_path / "out"), pytest.raises(InputError, match="no other process"):
        compare(tiny, ("nearest",), budget=INSTANT, output=tmp_path / "out")
    compare(tiny, ("nearest",), budget=INSTANT, output=tmp_path / "out")
    with pytest.raises(InputError, match="split 'random', found one with split 'files'"):
        compare(tiny, ("nearest",), "random", INSTANT, output=tmp_path / "out")
    (tmp_path / "letters").mkdir()
    (tmp_path / "letters" / "love.txt").write_text("dear")
    with pytest.raises(InputError, match="letters: expected a new folder or an earlier experiment"):
        compare(tiny, ("nearest",), budget=INSTANT, output=tmp_path / "letters")


@pytest.mark.parametrize("name", ["nearets", "no_such_module:Class", "json:NoSuchClass", "twin"])
def test_unknown_method_is_refused_before_anything_is_written(tiny, tmp_path, name):
    with pytest.raises(InputError, match="models: expected"):
        compare(tiny, ("nearest", name), budget=INSTANT, output=tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("predict", "found"),
    [
        (lambda positions: np.zeros((len(positions), 32400)), r"an array \[5, 32400\] of float64"),
        (lambda positions: np.zeros((len(positions), 90, 360), complex), r"of complex128"),
        (lambda positions: np.full((len(positions), 90, 360), np.nan), "values that are not finite in 5 of them"),
    ],
)
def test_a_method_that_predicts_no_spectra_is_refused_and_leaves_no_row(tiny, tmp_path, predict, found):
    class Wrong:
        def fit(self, task):
            self.predict = predict

        def predict(self, positions):
            raise NotImplementedError

    with pytest.raises(InputError, match=f"wrong: expected predict to return real, finite spectra .*{found}"):
        compare(tiny, {"wrong": Wrong}, budget=INSTANT, output=tmp_path / "out")
    assert not (tmp_path / "out" / "results.jsonl").is_file() and not list(tmp_path.rglob("*.csv"))


PAGE = "docs/how-to/add-my-own-model.md"
_, LOOP, *_ = (block.text for block in blocks(PAGE) if block.language == "python" and not block.file)


def test_loop_of_ones_own_in_the_docs_scores_the_mean_picture_as_a_comparison_does(workplace, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "data").symlink_to(workplace / "data")
    values: dict = {}
    exec(LOOP, values)
    (row, _) = compare("data/lab", ("mean-picture",), "random", INSTANT, output=tmp_path / "out")
    assert values["scores"].summary()["ssim_median"] == pytest.approx(row["ssim_median"], abs=1e-5)


class Grey:
    """A method of one's own: the same grey everywhere."""

    def __init__(self, level=0.5):
        self.level = level

    def fit(self, task):
        assert not hasattr(self, "fitted")  # a new one for each row
        self.fitted = True

    def predict(self, positions):
        return np.full((len(positions), 90, 360), self.level)


def test_methods_are_given_as_classes_objects_and_functions_too(tiny, tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))  # where a comparison without an output folder is kept
    models = {"grey": Grey, "black": Grey(0.0), "white": lambda: Grey(1.0), "copy": "nearest"}
    comparison = compare(read_dataset(tiny), models, budget=INSTANT, seeds=2)
    assert comparison.folder.parent == tmp_path
    assert [row["label"] for row in comparison] == [*models, *models, CEILING]
    mean = {row["label"]: row["mae_mean"] for row in comparison}
    assert mean["black"] + mean["white"] == pytest.approx(1, abs=1e-6) and mean["grey"] < 0.5
    for wrong in ("budget", "seeds"):
        with pytest.raises(ParameterError, match=f"{wrong}: expected .*, found 0"):
            compare(tiny, ("nearest",), **{wrong: 0})


def test_comparison_is_a_table_for_pandas_for_a_terminal_and_for_a_notebook(tiny, tmp_path):
    comparison = compare(tiny, ("nearest", "mean-picture"), budget=INSTANT, output=tmp_path / "out")
    frame = pd.DataFrame(comparison)
    assert frame["label"].tolist() == ["nearest", "mean-picture", CEILING] and len(comparison) == 3
    assert frame["ssim_median"].tolist() == [row["ssim_median"] for row in comparison.rows]
    assert pd.DataFrame(comparison.table()[:-1])["ssim_median"].is_monotonic_decreasing
    assert len(str(comparison).splitlines()) == 4
    cells = [cell.text for cell in ElementTree.fromstring(comparison._repr_html_()).iter("td")]
    assert set(frame["label"]) - {CEILING} < set(cells)


def test_fewer_test_spectra_are_spread_over_the_test_part(tiny, tmp_path, rows):
    out = tmp_path / "out"
    compare(tiny, ("nearest",), budget=INSTANT, test_spectra=2, output=out)
    assert {row["test"] for row in rows(out)} == {2}
    with (out / "per_sample" / "nearest-0.csv").open() as file:
        scored = [row["name"] for row in csv.DictReader(file)]
    dataset = read_dataset(tiny)
    assert scored == [dataset.names[index] for index in evenly(split(dataset, "files", 0).test, 2)]
    with pytest.raises(InputError, match="test_spectra"):
        compare(tiny, ("nearest",), budget=INSTANT, output=out)  # another test part than before


def test_model_that_was_trained_for_a_few_steps_only_is_named(tiny, tmp_path):
    comparison = compare(tiny, ("nearest", "mlp", "helmholtz"), budget=INSTANT, output=tmp_path / "out")
    steps = {row["label"]: row.get("steps") for row in comparison}
    assert steps == {"nearest": None, "mlp": 1, "helmholtz": None, CEILING: None}
    assert "mlp (1)" in comparison.remark()
    enough = [row | {"steps": FEW_STEPS, "mean_picture_ssim_median": 0.0} for row in comparison.rows]
    assert replace(comparison, rows=enough).remark() is None
    assert "1 training steps" in comparison.doubts()["mlp"]


def test_methods_below_the_mean_picture_are_named(tiny, tmp_path):
    models = {"black": Grey(0.0), "mean-picture": "mean-picture"}
    comparison = compare(tiny, models, budget=INSTANT, output=tmp_path / "out")
    black, mean, _ = comparison.rows
    assert black["mean_picture_ssim_median"] == pytest.approx(mean["ssim_median"], abs=1e-6)  # computed without its row
    assert black["ssim_median"] < mean["ssim_median"]
    assert comparison.doubts().keys() == {"black"} and comparison.remark() in str(comparison)
    write_comparison(comparison, tmp_path / "out")
    page = (tmp_path / "out" / "table.html").read_text()
    assert comparison.remark() in page and "<td>black †</td>" in page and "<td>mean-picture</td>" in page


def test_no_method_learns_from_positions_within_the_guard(tiny, tmp_path):
    """The positions of ``tiny`` are 0.56 wavelengths apart."""
    dataset, seen = read_dataset(tiny), []

    class Recording(Grey):
        def fit(self, task):
            seen.append(task.positions)

    (row, _) = compare(tiny, {"recording": Recording}, budget=INSTANT, output=tmp_path / "out", guard=0.6)
    train(tiny, tmp_path / "run", model="helmholtz", guard=0.6)
    train(tiny, tmp_path / "steps", model="mlp", guard=0.6, steps=1, find_phases=False)
    test = dataset.positions[split(dataset, "files", 0).test]
    by_steps = json.loads((tmp_path / "steps" / "split.json").read_text())
    numbers = [int(name) - 1 for part in ("train", "validation") for name in by_steps[part]]
    kept = load_run(tmp_path / "run").model.state_dict()
    places = next(value.numpy() for name, value in kept.items() if name.endswith("places"))
    for known in (*seen, places, dataset.positions[numbers]):
        away = np.linalg.norm(known[:, None] - test, axis=-1).min()
        assert len(known) == row["known"] < 19 and away > 0.6 * dataset.wavelength


def test_rows_of_other_index_files_are_not_mixed(tiny, tmp_path):
    data = shutil.copytree(tiny, tmp_path / "data")
    compare(data, ("nearest",), budget=INSTANT, output=tmp_path / "out")
    (data / "train_index.txt").write_text("\n".join(f"{number:05d}" for number in range(5, 25)))
    (data / "test_index.txt").write_text("\n".join(f"{number:05d}" for number in range(1, 5)))
    with pytest.raises(InputError, match="index files"):
        compare(data, ("nearest", "mean-picture"), budget=INSTANT, output=tmp_path / "out")


def test_labels_whose_files_would_have_one_name_are_refused_before_anything_is_measured(tiny, tmp_path):
    out = tmp_path / "out"
    with pytest.raises(InputError, match="found 'my_model' beside 'my model'"):
        compare(tiny, {"my model": Grey, "my_model": "nearest"}, budget=INSTANT, output=out)
    assert not (out / "results.jsonl").exists()


# Spectra that cannot be scored


def test_black_spectra_are_left_out_of_every_score_and_alone_are_refused(tiny, tmp_path, capsys):
    folder, dataset = shutil.copytree(tiny, tmp_path / "black"), read_dataset(tiny)
    pictures = [folder / "spectrum" / f"{dataset.names[index]}.png" for index in split(dataset, "files", 0).test]
    black = Image.fromarray(np.zeros((90, 360), np.uint8))
    for path in pictures[:2]:
        black.save(path)
    scored = compare(folder, ("nearest",), budget=INSTANT, output=tmp_path / "out")
    assert "2 of 5 test spectra are constant" in capsys.readouterr().err
    full = compare(tiny, ("nearest",), budget=INSTANT, output=tmp_path / "full")
    assert [row["test"] for row in scored] == [3, 3]
    expected = full.per_sample(full.rows[0])["ssim"][2:]
    np.testing.assert_array_equal(scored.per_sample(scored.rows[0])["ssim"], expected)
    for path in pictures[2:]:
        black.save(path)
    with pytest.raises(InputError, match="found 5 constant ones"):
        compare(folder, ("nearest",), budget=INSTANT, output=tmp_path / "none")
    assert not (tmp_path / "none").exists()


@pytest.mark.parametrize("function", [compare, partial(sweep, sizes=[3]), ablate])
def test_spectra_of_two_elements_are_not_scored(tiny, tmp_path, function):
    dataset = read_dataset(tiny)
    small = Identification(Beamformer(PlanarArray(1, 2)), source="metadata")
    with pytest.raises(InputError, match="at least 3 elements to score spectra, found 1 × 2"):
        function(replace(dataset, identification=small), output=tmp_path / "out")
    assert not (tmp_path / "out").exists()


# Methods of one's own

KNN = """
class Copy:
    def __init__(self, level=0.5):
        self.level = level

    def fit(self, task):
        task.folder.mkdir(parents=True)

    def predict(self, positions):
        import numpy as np
        return np.full((len(positions), 90, 360), self.level)
"""


@pytest.fixture
def own(tmp_path, monkeypatch):
    """Function: text of a module -> its class Copy, as a new process imports it."""
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])

    def imported(text, name="Copy"):
        (tmp_path / "own_copy.py").write_text(text)
        importlib.invalidate_caches()
        shutil.rmtree(tmp_path / "__pycache__", ignore_errors=True)
        sys.modules.pop("own_copy", None)
        return getattr(importlib.import_module("own_copy"), name)

    yield imported
    sys.modules.pop("own_copy", None)


def test_edited_class_is_measured_again_in_a_folder_of_its_own_and_its_row_replaced(tiny, tmp_path, own, capsys):
    def measured(kept):
        comparison = compare(tiny, {"mine": kept, "nearest": "nearest"}, budget=INSTANT, output=tmp_path / "out")
        return comparison.rows, capsys.readouterr().err

    first, _ = measured(own(KNN))
    same, said = measured(own(f"# a comment\n{KNN}"))
    assert same == first and "mine" not in said
    edited, said = measured(own(KNN.replace("self.level)", "0.25)")))
    assert "mine-0: it or its settings have changed" in said
    assert [row["label"] for row in edited] == [row["label"] for row in first] and edited[1:] == first[1:]
    assert edited[0]["mae_mean"] != first[0]["mae_mean"] and edited[0]["source"] != first[0]["source"]
    instance, said = measured(own(KNN)(level=0.75))  # the settings of an object count, too
    assert "its settings have changed" in said and instance[0]["mae_mean"] != edited[0]["mae_mean"]


@pytest.mark.parametrize(
    ("changed", "expected"),
    [
        ("task.folder", "mine: expected fit .* found ZeroDivisionError"),
        ("return ", "mine: expected predict .* found"),
    ],
)
def test_own_method_that_fails_is_one_sentence_and_other_rows_stay(tiny, tmp_path, own, rows, changed, expected):
    compare(tiny, {"nearest": "nearest"}, budget=INSTANT, output=tmp_path / "out")
    before = rows(tmp_path / "out")
    with pytest.raises(InputError, match=f"{expected}.*own_copy.py, line "):
        compare(tiny, {"mine": own(KNN.replace(changed, "1 / 0 #"))}, budget=INSTANT, output=tmp_path / "out")
    assert rows(tmp_path / "out") == before


@pytest.mark.parametrize("function", [compare, ablate, sweep, train])
def test_split_is_the_folders_own_by_default_everywhere(function):
    command = getattr(training_commands, function.__name__, None) or getattr(comparison_commands, function.__name__)
    assert {signature(each).parameters["split"].default for each in (function, command)} == {"files"}


def test_trained_model_is_a_run_that_is_not_trained_twice(tiny, tmp_path):
    task = KnownSpectra(read_dataset(tiny), "files", 0, None, 1, INSTANT, None, tmp_path / "run")
    positions = task.dataset.positions[:3]
    first = TrainedModel("bisplat-aperture")
    first.fit(task)
    weights = tmp_path / "run" / "weights.safetensors"
    written = weights.stat().st_mtime_ns
    again = TrainedModel("bisplat-aperture")
    again.fit(replace(task, minutes=99.0))
    assert weights.stat().st_mtime_ns == written
    np.testing.assert_array_equal(again.predict(positions), first.predict(positions))
    assert first.parameters > 1000 and first.seconds >= 0


def test_budget_becomes_steps(tiny, tmp_path, monkeypatch):
    monkeypatch.setattr("learn.training.budget.measured_speed", lambda *_: Speed(step=0.5, validation=0.0))
    seen = []
    monkeypatch.setattr(trained_model, "train_run", lambda config, folder, **_: seen.append(config))
    monkeypatch.setattr(trained_model, "load_run", lambda folder: None)
    TrainedModel("mlp").fit(KnownSpectra(read_dataset(tiny), "files", 0, None, 7, 3.0, None, tmp_path / "run"))
    assert seen[0].by_steps.steps == 360 and seen[0].seed == 7


@pytest.mark.parametrize("effort", [{"steps": 3}, {"budget": INSTANT}])
def test_another_device_may_continue_with_steps_but_not_with_a_budget(effort, tiny, tmp_path, monkeypatch):
    call = partial(compare, tiny, ["nearest"], output=tmp_path, **effort)
    call()
    monkeypatch.setattr("learn.comparison.experiment.device_name", lambda: "64 CPU threads")
    if "steps" in effort:
        assert len(call().rows) == 2
    else:
        with pytest.raises(InputError, match="device '64 CPU threads'"):
            call()


@pytest.mark.parametrize("function", [compare, partial(sweep, sizes=[10])])
def test_steps_replace_the_budget(function, tiny, tmp_path):
    rows = function(tiny, models=["mlp", "nearest"], steps=3, output=tmp_path / "out").rows
    assert [row["steps"] for row in rows if row["label"] in ("mlp", "nearest")] == [3, None]
    with pytest.raises(InputError, match=r"minutes 5\.0, found one with minutes nothing"):
        function(tiny, models=["nearest"], output=tmp_path / "out")


def test_finding_phases_is_part_of_the_budget(tiny, tmp_path, monkeypatch):
    where = "learn.training.budget."
    monkeypatch.setattr(f"{where}learned_responses", lambda *_: Learned(None, seconds=60.0))
    monkeypatch.setattr(f"{where}measured_speed", lambda *_: Speed(step=60.0, validation=0.0))
    TrainedModel("mlp-responses").fit(
        KnownSpectra(read_dataset(tiny), "files", 0, None, 7, 3.0, None, tmp_path / "run")
    )
    assert read_config(tmp_path / "run").config.by_steps.steps == 2
    assert read_training(tmp_path / "run").seconds >= 60


NEED_RESPONSES = {"mirror-images", "kriging-responses"}


@pytest.mark.parametrize("name", sorted(set(method_names()) - {"bisplat-plus", "nerf2"} - NEED_RESPONSES))
def test_every_method_fits_and_predicts(tiny, tmp_path, name):
    dataset = read_dataset(tiny)  # without responses
    task = KnownSpectra(dataset, "files", 0, None, 0, INSTANT, None, tmp_path / "run")
    method = method_named(name)()
    method.fit(task)
    pictures = method.predict(dataset.positions[task.parts.test])
    assert pictures.shape == (5, 90, 360) and np.isfinite(pictures).all()


@pytest.mark.parametrize("name", sorted(NEED_RESPONSES))
def test_methods_that_need_responses_are_left_out_where_a_dataset_has_pictures_alone(tiny, tmp_path, name):
    compared = compare(tiny, ("nearest", name), budget=INSTANT, output=tmp_path / "out")
    assert name not in {row["label"] for row in compared}
    with pytest.raises(InputError, match=f"{name}: expected element responses"):
        compare(tiny, (name,), budget=INSTANT, output=tmp_path / "alone")


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
    pictures = normalise(Beamformer().spectrum(responses)).astype(np.float32)
    known, asked = np.arange(60) % 3 != 1, np.arange(60) % 3 == 1
    copied = np.abs(nearest(positions[known], pictures[known], positions[asked]) - pictures[asked]).mean()
    kriged = krige_spectra(positions[known], pictures[known], 0)(positions[asked])
    assert np.abs(kriged - pictures[asked]).mean() < 0.5 * copied
    kriged = krige_responses(positions[known], responses[known], Beamformer(), 0)(positions[asked])
    assert np.abs(kriged - pictures[asked]).mean() < 0.2 * copied


# Ablation and sweep


def test_ablation_has_the_papers_rows_and_ours(tiny, tmp_path, rows):
    papers = dict(variants("bisplat-plus"))
    assert len(papers) == 4
    assert papers["bisplat-plus without BST"] == TrainedModel("bisplat-plus", {"bypass": ["bst"]})
    ours = dict(variants("bisplat-aperture"))
    assert ours["bisplat-aperture with TX-PE"].options == {"encoding": "octaves"}
    assert ours["bisplat-aperture without depth order"].options == {"ordered": False}
    smaller = dict(variants("bisplat", 250))["bisplat (250 primitives) without BST"]
    assert smaller == TrainedModel("bisplat", {"primitives": 250, "bypass": ["bst"]})
    out = tmp_path / "out"
    comparison = ablate(tiny, ("bisplat",), "files", 2, 2, output=out)
    table = comparison.table()
    assert {(row["label"], row["seed"]) for row in rows(out)} == {(row["label"], s) for row in table for s in (0, 1)}
    assert len(table) == 4 and all(row["seeds"] == 2 for row in table)
    write_ablation(comparison, out)
    assert (out / "ablation.png").stat().st_size > 5000
    assert (out / "learning_curves.png").stat().st_size > 5000
    steps, ssim = validation_curve(out / "runs" / "bisplat-0")
    last = json.loads((out / "runs" / "bisplat-0" / "training.json").read_text())["validation_ssim"]
    assert steps == [2] and ssim == [pytest.approx(last)]
    configs = [json.loads(path.read_text()) for path in (out / "runs").glob("*/config.json")]
    assert len(configs) == 8 and {config["by_steps"]["steps"] for config in configs} == {2}


def test_averages_are_the_mean_and_the_standard_deviation_over_seeds():
    rows = [{"label": "a", "seed": seed, "ssim_median": value, "date": "x"} for seed, value in enumerate((0.5, 0.7))]
    (found,) = averaged(rows, ["label"], "ssim_median")
    assert found["ssim_median"] == pytest.approx(0.6)
    assert found["ssim_spread"] == pytest.approx(np.sqrt(0.02)) and found["seeds"] == 2
    assert "date" not in found


def test_sweep_grows_the_training_part_and_keeps_the_test_part(tiny, tmp_path, rows):
    out = tmp_path / "out"
    comparison = sweep(tiny, (5, 15), ("nearest", "mlp"), budget=INSTANT, output=out)
    found = {(row["label"], row["train_size"]) for row in comparison.table()}
    assert found == {(name, size) for name in ("nearest", "mlp") for size in (5, 15)}
    write_sweep(comparison, out)
    assert [row["train"] for row in rows(out)] == [5, 5, 15, 15] and {row["test"] for row in rows(out)} == {5}
    assert (out / "sweep.png").stat().st_size > 5000


def test_a_run_with_other_weights_is_measured_again(finished_run, tiny, tmp_path):
    other = shutil.copytree(finished_run, tmp_path / "other" / finished_run.name)
    call = partial(sweep, tiny, (10,), ("nearest",), steps=2, output=tmp_path / "out")
    first = call(init=finished_run).rows
    assert call(init=other).rows == first  # the same weights
    weights = load_file(other / "weights.safetensors")
    changed = {name: value * 1.1 if name.endswith("weight") else value for name, value in weights.items()}
    save_file(changed, other / "weights.safetensors")
    again = call(init=other).rows
    assert [row["label"] for row in again] == [row["label"] for row in first]
    assert again[1]["ssim_median"] != first[1]["ssim_median"]


def test_a_sweep_goes_on_from_a_run_with_its_options(tiny, tmp_path, rows):
    train(tiny, tmp_path / "small", model="mlp", steps=1, options={"encoding": "octaves"})
    sweep(tiny, (10,), ("nearest",), steps=1, init=tmp_path / "small", output=tmp_path / "out")
    (config,) = (read_config(path).config for path in (tmp_path / "out" / "runs").glob("mlp*"))
    assert config.options == {"encoding": "octaves"}


@pytest.mark.parametrize(
    ("sizes", "trained", "expected"),
    [
        ((10,), {"model": "mlp", "split": "random", "seed": 1, "steps": 1, "find_phases": False}, "the test spectra"),
        ((10,), {"model": "helmholtz"}, "init: expected a run of a model that is trained by steps"),
        ((5, 100), None, "expected 100 spectra to train on, found 17"),
    ],
)
def test_what_a_sweep_cannot_do_is_refused_before_anything_is_measured(tiny, tmp_path, sizes, trained, expected):
    init = train(tiny, tmp_path / "before", **trained).folder if trained else None
    with pytest.raises(InputError, match=expected):
        sweep(tiny, sizes, ("nearest",), init=init, output=tmp_path / "out")
    assert not (tmp_path / "out" / "results.jsonl").exists()


def test_a_model_without_parts_to_switch_off_is_refused(tiny, tmp_path):
    with pytest.raises(ParameterError, match=r"models: expected .* found helmholtz"):
        ablate(tiny, ("bisplat", "helmholtz"), steps=2, output=tmp_path / "out")


def test_a_reduced_model_says_so_whatever_its_label(tiny, tmp_path):
    reduced = ["nerf2 (reduced)", "ours (reduced)"]
    assert list(spectrum_factories({"nerf2": "nerf2", "ours": "swiftwrf", "far": "nearest"})) == [*reduced, "far"]
