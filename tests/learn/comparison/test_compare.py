"""What a comparison promises for every quantity: one split, seeds, sizes, own methods, rows that are kept, tables."""

import csv
import importlib
import json
import shutil
import sys
from dataclasses import replace
from functools import partial
from typing import Any, ClassVar
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest

import bisplat
from learn.comparison.averages import average_name
from learn.methods.method_table import BASELINES, USUAL_BASELINES, methods_of, named_for, trained_by_steps
from learn.quantities.array_ceiling import CEILING
from learn.quantities.known import Known
from learn.quantities.quantity_table import QUANTITIES, quantity_named
from learn.reports.comparison_report import write_comparison
from learn.reports.method_report import write_method_report
from scenes.files.output_folder import locked

SLOW = {"mirror-images", "helmholtz-positions", "nerf2"}  # Tested by themselves
CHOSEN = [
    (name, quantity)
    for quantity in ("spectrum", "response", "power", "channel")
    for name in named_for(quantity)
    if name != "kriging-responses"
]


class Own:
    """A method of one's own for every quantity: the first known value everywhere."""

    known: ClassVar[list[Known]] = []
    wrong: ClassVar[Any] = None

    def fit(self, known):
        assert not hasattr(self, "value")  # a new one for each row
        Own.known.append(known)
        self.steps, self.value = 3, np.nan_to_num(known.values[0], nan=-60.0)

    def predict(self, positions, given=None):
        if Own.wrong is not None:
            return Own.wrong(self.value)
        count = len(positions) if given is None else len(given)
        return np.tile(self.value, (count, *[1] * self.value.ndim))


@pytest.fixture(autouse=True)
def afresh(monkeypatch):
    monkeypatch.setattr(Own, "known", [])
    monkeypatch.setattr(Own, "wrong", None)


def labels(comparison):
    return [row["label"] for row in comparison if row["label"] != CEILING]


@pytest.mark.parametrize("name", [pytest.param(case, id="-".join(case)) for case in CHOSEN])
def test_every_method_fits_and_predicts_the_same_again(name, request):
    method, quantity = name
    if method in SLOW or trained_by_steps(methods_of(quantity)[method]):
        pytest.skip("tested by itself")
    kind = {"spectrum": "tiny", "response": "wide", "power": "hall", "channel": "links"}[quantity]
    dataset = request.getfixturevalue(kind)
    dataset = bisplat.read_dataset(dataset) if kind == "tiny" else dataset
    of = quantity_named(quantity)
    taught, tested = Known.of(dataset, of, np.arange(20)), np.arange(20, 23)
    places = dataset.places
    found = []
    for _ in range(2):
        fitted = methods_of(quantity)[method]()
        fitted.fit(taught)
        for rows in (tested, tested[:1]):
            where, given = None if places is None else places[rows], of.given(dataset, rows)
            made = fitted.predict(where) if given is None else fitted.predict(where, given)
            found.append(of.checked(method, made, of.of(dataset, rows).shape))
    np.testing.assert_allclose(found[0].value, found[2].value)
    np.testing.assert_allclose(found[0].value[:1], found[1].value, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("name", ["nearest", "inverse-distance", "kriging"])
def test_interpolation_returns_what_is_known(kind, name):
    if kind.quantity == "channel":
        pytest.skip("has no positions")
    taught = Known.of(kind.dataset, kind.compare().quantity, np.arange(24))
    method = methods_of(kind.quantity)[name]()
    method.fit(taught)
    found, truth = method.predict(taught.positions).value, taught.values
    heard = ~np.isnan(truth)
    assert np.linalg.norm((found - truth)[heard]) < 0.3 * np.linalg.norm(truth[heard])


@pytest.mark.parametrize("split", ["files", "random", "blocked", "area"])
def test_every_method_learns_from_the_same_part_and_is_scored_on_another(kind, split):
    places = np.random.default_rng(1).uniform(0, 5, (len(kind.dataset), 3))
    dataset = replace(kind.dataset, places=places)
    comparison = kind.compare({"mine": Own}, dataset=dataset, split=split)
    parts = bisplat.split(dataset, split, 0)
    (known,) = Own.known
    assert known.rows.tolist() == parts.known.tolist() and comparison.test.tolist() == parts.test.tolist()
    assert not set(parts.known) & set(parts.test)
    assert {(row["known"], row["test"]) for row in comparison if row["label"] != CEILING} == {
        (len(parts.known), len(parts.test))
    }
    assert set(labels(comparison)) == {*BASELINES.get(kind.quantity, USUAL_BASELINES), "mine"}  # always in
    best, *_ = kind.compare(dataset=kind.dataset).table()
    assert best["label"] in (kind.methods[1], "inverse-distance", "nearest")


def test_sizes_share_the_test_part_and_are_contained_in_larger_ones(kind):
    comparison = kind.compare({"mine": Own}, sizes=(10, 5))
    small, large = Own.known
    assert (len(small.parts.train), len(large.parts.train)) == (5, 10)
    assert set(small.parts.train) < set(large.parts.train)
    assert small.parts.test.tolist() == large.parts.test.tolist()
    mine = [row for row in comparison if row["label"] == "mine"]
    assert [row["train_size"] for row in mine] == [5, 10] and {"mine, 5", "mine, 10"} < set(comparison.each)
    alone = kind.compare({"mine": Own}, sizes=[10])
    assert next(row[kind.score] for row in alone if row["label"] == "mine") == mine[1][kind.score]
    for sizes in ([], [5, 5], ["x"], [10_000]):
        with pytest.raises(bisplat.InputError, match="expected"):
            kind.compare({"mine": Own}, sizes=sizes)


def test_seeds_fit_each_method_anew_on_the_same_split(kind):
    comparison = kind.compare({"mine": Own}, seeds=2, budget=0.5, seed=7)
    assert [(known.seed, known.minutes, known.how.seed) for known in Own.known] == [(0, 0.5, 7), (1, 0.5, 7)]
    (mine,) = [row for row in comparison.averages() if row["label"] == "mine"]
    assert mine["seeds"] == 2 and mine[kind.score.replace("median", "spread")] == 0
    assert "± seeds" in str(comparison).splitlines()[0] and comparison.facts()["fits"] == comparison.rows
    assert "mine (3)" in comparison.remark() and "only 3" in comparison.doubts()["mine"]


def test_own_methods_are_classes_functions_objects_or_names(kind, tmp_path, monkeypatch):
    (tmp_path / "named_method.py").write_text("from tests.learn.comparison.test_compare import Own as Mine\n")
    monkeypatch.chdir(tmp_path)
    given = {"class": Own, "function": lambda: Own(), "object": Own(), "name": "named_method:Mine"}
    comparison = kind.compare(given)
    assert len({row[kind.score] for row in comparison if row["label"] in given}) == 1
    assert "named_method:Mine" in labels(kind.compare(["named_method:Mine"]))


@pytest.mark.parametrize(
    ("wrong", "found"),
    [
        (lambda value: value[None, :1], "an array"),
        (lambda value: 1 / 0, "ZeroDivisionError: .*test_compare.py, line"),
        (lambda value: sys.exit(), "SystemExit"),
        (lambda value: None, "an array"),
    ],
)
def test_errors_of_own_methods_name_them_and_leave_no_row(kind, wrong, found, monkeypatch, tmp_path):
    monkeypatch.setattr(Own, "wrong", staticmethod(wrong))
    with pytest.raises(bisplat.InputError, match=f"mine: .*{found}") as raised:
        kind.compare({"mine": Own}, output=tmp_path / "out")
    assert "\n" not in str(raised.value)
    assert '"mine"' not in (tmp_path / "out" / "results.jsonl").read_text()


@pytest.mark.parametrize(
    "methods",
    [["unheard-of"], ["nowhere:Class"], {"mine": int}, [], "mean", ["nearest=x"], ["=x"], ["theirs="]],
)
def test_wrong_methods_are_refused_before_anything_is_written(kind, methods, tmp_path):
    with pytest.raises(bisplat.InputError, match=r"methods: expected .* found"):
        kind.compare(methods, output=tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_comparison_is_a_table_for_pandas_for_a_terminal_and_for_a_notebook(kind):
    comparison = kind.compare()
    frame = pd.DataFrame(comparison)
    assert frame["label"].tolist() == [row["label"] for row in comparison.rows] and len(comparison) == len(frame)
    table = [row[kind.score] for row in comparison.table() if row["label"] != CEILING]
    assert table == sorted(table, reverse=kind.quantity != "power")
    assert len(str(comparison).splitlines()) >= len(frame) + 1
    cells = [cell.text for cell in ElementTree.fromstring(comparison._repr_html_()).iter("td")]
    assert set(labels(comparison)) < set(cells) and "Comparison(" in repr(comparison)


@pytest.mark.parametrize("sizes", [(), (10, 5)])
def test_the_command_writes_tables_a_page_and_figures(kind, bisplat_command, tmp_path, sizes):
    call = ["compare", kind.dataset.folder, "-o", "out", "--split", "random", "--methods", *kind.methods]
    call += ["--quantity", "response"] if kind.quantity == "response" else []
    status, out, err = bisplat_command(*call, *(["--sizes", *sizes] if sizes else ["--seeds", 2]))
    assert status == 0 and kind.methods[1] in out, err
    folder = tmp_path / "out"
    facts = json.loads((folder / "results.json").read_text())
    rows = list(csv.DictReader((folder / "table.csv").open()))
    for row in rows:
        name = row["method"].removesuffix(" †")
        assert float(row[kind.score]) == facts["methods"][name][kind.score]
    figure = "sweep" if sizes else {"spectrum": "ssim", "power": "error"}.get(kind.quantity, "snr") + "_cdf"
    names = {path.name for path in folder.iterdir()}
    assert {"table.tex", "table.html", f"{figure}.png", f"{figure}.pdf", "protocol.json", "per_sample"} <= names
    assert "<td>" in (folder / "table.html").read_text()


class Stops(Own):
    """The third fit is interrupted."""

    def fit(self, known):
        super().fit(known)
        if len(Own.known) == 3:
            raise KeyboardInterrupt


def test_an_interrupted_comparison_shows_its_table_and_makes_the_missing_fits_alone(kind, tmp_path, capsys):
    compare = partial(kind.compare, {"mine": Stops, "last": Own}, seeds=2)
    with pytest.raises(KeyboardInterrupt):
        compare(output=tmp_path / "kept")
    said = capsys.readouterr().err
    assert "interrupted" in said and kind.compare().columns[kind.score] in said
    continued = compare(output=tmp_path / "kept")
    again = compare(output=tmp_path / "kept")
    assert again.rows == continued.rows and len(Own.known) == 5
    whole = compare()
    timeless = {"seconds": 0, "milliseconds": 0}
    by_key = {(row["label"], row["seed"]): row for row in whole}
    for row in again:
        assert {**row, **timeless} == {**by_key[row["label"], row["seed"]], **timeless}
    for name, arrays in whole.each.items():
        for key, values in arrays.items():
            np.testing.assert_array_equal(again.each[name][key], values)


def test_other_methods_and_sizes_join_a_comparison(kind, tmp_path):
    kind.compare([kind.methods[1]], sizes=[10], output=tmp_path / "kept")
    joined = kind.compare({"mine": Own}, sizes=[5], output=tmp_path / "kept")
    assert {f"{kind.methods[1]}, 10", "mine, 5"} < {average_name(row) for row in joined}
    assert set(joined.each) == {average_name(row) for row in joined}


def test_another_method_with_the_same_label_is_fitted_again(kind, tmp_path, capsys):
    compare = partial(kind.compare, output=tmp_path / "kept")
    before = compare({"mine": kind.methods[0]}).rows
    assert compare({"mine": kind.methods[0]}).rows == before
    after = compare({"mine": kind.methods[1]}).rows
    assert "mine" in capsys.readouterr().err and len(after) == len(before)
    scores = [next(row[kind.score] for row in rows if row["label"] == "mine") for rows in (before, after)]
    assert scores[0] != scores[1]


def test_a_folder_of_other_settings_data_or_of_another_process_is_refused_and_kept(kind, tmp_path):
    compare = partial(kind.compare, output=tmp_path / "kept")
    compare()
    before = {path: path.read_bytes() for path in (tmp_path / "kept").rglob("*") if path.is_file()}
    moved = replace(kind.dataset, places=np.zeros((len(kind.dataset), 3)) + np.arange(len(kind.dataset))[:, None])
    for options in ({"split": "blocked"}, {"seed": 1}, {"dataset": moved}):
        with pytest.raises(bisplat.InputError, match="found"):
            compare(**options)
    with locked(tmp_path / "kept"), pytest.raises(bisplat.InputError, match="no other process"):
        compare()
    assert all(path.read_bytes() == content for path, content in before.items())
    (tmp_path / "kept" / "protocol.json").write_text("[]")
    with pytest.raises(bisplat.InputError, match=r"protocol\.json: expected .*, found"):
        compare()


def test_index_files_that_changed_are_not_mixed(kind, tmp_path):
    kind.compare(split="files", output=tmp_path / "kept")
    other = replace(kind.dataset, train=kind.dataset.train[:-1])
    with pytest.raises(bisplat.InputError, match="index files"):
        kind.compare(split="files", dataset=other, output=tmp_path / "kept")


def test_labels_whose_files_would_have_one_name_are_refused(kind, tmp_path):
    with pytest.raises(bisplat.InputError, match="found 'my_model' beside 'my model'"):
        kind.compare({"my model": Own, "my_model": Own}, output=tmp_path / "out")
    assert not (tmp_path / "out" / "results.jsonl").exists()


def test_predictions_of_another_program_are_a_row(kind, tmp_path):
    test = kind.compare().parts.test
    truth = kind.compare().quantity.of(kind.dataset, test)
    (tmp_path / "theirs").mkdir()
    np.save(tmp_path / "theirs" / kind.compare().quantity.file, np.nan_to_num(truth, nan=-99.0))
    comparison = kind.compare([f"theirs={tmp_path / 'theirs'}"], seeds=2)
    assert [row["label"] for row in comparison].count("theirs") == 1
    assert comparison.table()[0]["label"] == "theirs"


OWN = """
import numpy as np

class Level:
    def __init__(self, level=0.5):
        self.level = level

    def fit(self, known):
        self.shape = known.values.shape[1:]

    def predict(self, positions, given=None):
        count = len(positions) if given is None else len(given)
        return np.full((count, *self.shape), self.level)
"""


@pytest.fixture
def own(tmp_path, monkeypatch):
    """Function: text of a module -> its class Level, as a new process imports it."""
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])

    def imported(text):
        (tmp_path / "own_level.py").write_text(text)
        importlib.invalidate_caches()
        shutil.rmtree(tmp_path / "__pycache__", ignore_errors=True)
        sys.modules.pop("own_level", None)
        return importlib.import_module("own_level").Level

    yield imported
    sys.modules.pop("own_level", None)


def test_an_edited_class_is_measured_again_and_a_comment_is_no_edit(kind, tmp_path, own):
    def source(method):
        rows = kind.compare({"mine": method}, output=tmp_path / "out").rows
        return next(row["source"] for row in rows if row["label"] == "mine"), rows

    first, rows = source(own(OWN))
    assert source(own(f"# a comment\n{OWN}")) == (first, rows)
    edited, _ = source(own(OWN.replace("self.level)", "0.25)")))
    instance, last = source(own(OWN)(level=0.75))
    assert len({first, edited, instance}) == 3 and len(last) == len(rows)


def test_figures_of_a_comparison_that_was_not_kept_can_be_written(kind, tmp_path):
    write_comparison(kind.compare(), tmp_path / "later")
    assert (tmp_path / "later" / "table.html").stat().st_size > 1000


NOISE = """
\"\"\"Noise figures: one file, and one line in the table of quantities.\"\"\"
import numpy as np
from learn.quantities.quantity import OfEach, Quantity, Scored
from scenes.files.npz_file import Expected


class NoiseFigures(Quantity):
    name, things, in_words, predicted, kinds, file = "noise", "positions", "noise figures", "dB", "f", "noise.npy"
    columns = {"error_mean_db": "mean error (dB)"}
    small_is_good = True
    of_each = OfEach("error_db", "error (dB)", "share of positions")

    def require(self, dataset):
        assert (dataset.folder / "noise.npy").is_file()

    def of(self, dataset, rows):
        return np.load(dataset.folder / "noise.npy")[rows]

    def score(self, prediction, truth, dataset):
        error = np.abs(prediction.value - truth)
        return Scored({"error_mean_db": float(error.mean())}, {"error_db": error})

    def arrays(self, shape):
        return {"error_db": Expected("errors", "f", shape)}
"""


def test_a_new_quantity_is_one_file_and_one_line(tiny, tmp_path, monkeypatch):
    folder = shutil.copytree(tiny, tmp_path / "measured")
    data = bisplat.read_dataset(folder)
    np.save(folder / "noise.npy", data.positions @ [1.0, 2.0, 0.5] + 3)
    (tmp_path / "noise_figures.py").write_text(NOISE)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setitem(QUANTITIES, "noise", "noise_figures:NoiseFigures")
    comparison = bisplat.compare(folder, ["kriging"], quantity="noise", output=tmp_path / "out")
    assert labels(comparison)[-1] == "kriging" == comparison.table()[0]["label"]
    assert set(labels(comparison)) == {*USUAL_BASELINES, "kriging"}
    write_comparison(comparison, tmp_path / "out")
    assert "noise figures" in (tmp_path / "out" / "table.html").read_text()
    run = bisplat.train(folder, tmp_path / "run", model="kriging", quantity="noise")
    np.testing.assert_allclose(
        bisplat.load_run(run.folder).predict(data.positions).value, run.predict(data.positions).value
    )
    scored = {row["label"]: row["error_mean_db"] for row in bisplat.evaluate(run)}
    assert scored == pytest.approx({row["label"]: row["error_mean_db"] for row in comparison})
    write_method_report(bisplat.evaluate(run), "kriging", tmp_path / "report")
