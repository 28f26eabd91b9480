"""What comparisons of received powers and of channels have in common: splits, seeds, sizes, own methods, commands."""

import csv
import json
import re
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
import torch
from learn.comparison.method_factories import chosen_methods
from learn.comparison.scored_methods import Parts

import bisplat


@dataclass(frozen=True)
class Kind:
    """One of both kinds, with two of its methods, of which the second is the better one."""

    dataset: Any  # powers or channels
    compare: Any  # the function that compares methods
    worse: str  # name of a method
    better: str  # name of a better one
    score: str  # key of the score that ranks them
    things: str  # what is known and tested
    figure: str  # name of the figure without suffix


@pytest.fixture(params=["powers", "channels"])
def kind(request, hall, links) -> Kind:
    if request.param == "powers":
        words = ("mean", "log-distance", "error_median_db", "positions", "error_cdf")
        return Kind(hall, bisplat.compare_powers, *words)
    return Kind(links, bisplat.compare_channels, "copy", "delays", "snr_median_db", "rows", "snr_cdf")


class Own:
    """A method of one's own for both kinds: nothing is received, and the uplink is the downlink."""

    seeds: ClassVar[list[tuple[int, float]]] = []
    wrong: ClassVar[Any] = None

    def fit(self, known):
        self.seeds.append((known.seed, known.minutes))
        self.steps = 3
        self.gateways = getattr(known, "powers", np.zeros((0, 0))).shape[1]

    def predict(self, given, positions=None):
        if self.wrong is not None:
            return self.wrong(given)
        return given if np.iscomplexobj(given) else np.full((len(given), self.gateways), -60.0 - self.seeds[-1][0])


@pytest.mark.parametrize("split", ["files", "random", "blocked", "area"])
def test_splits_are_those_of_spectra(kind, split):
    places = np.random.default_rng(1).uniform(0, 5, (60, 3))
    dataset = replace(kind.dataset, positions=places)
    comparison = kind.compare(dataset, [kind.worse], split=split)
    parts = bisplat.split(dataset, split, 0)
    assert (comparison.known, comparison.test) == (len(parts.known), len(parts.test))
    assert not set(parts.known) & set(parts.test)
    if split == "files":
        assert parts.test.tolist() == dataset.test.tolist()


def test_sizes_share_the_test_part_and_are_contained_in_larger_ones(kind):
    parts = Parts.of(kind.dataset, "random", 0, (30, 10), 0.0)
    small, large = (parts.of_size[size] for size in (10, 30))
    assert set(small.train) < set(large.train) and small.test.tolist() == large.test.tolist()
    comparison = kind.compare(kind.dataset, [kind.worse, kind.better], split="random", train_size=(30, 10))
    assert [(row["train_size"], row["known"]) for row in comparison] == [(10, 11)] * 2 + [(30, 33)] * 2
    assert comparison.known == 33
    assert set(comparison.of_each()) == set(comparison.facts()["methods"]) == {
        f"{name}, {size}" for name in (kind.worse, kind.better) for size in (10, 30)
    }  # fmt: skip
    alone = kind.compare(kind.dataset, [kind.better], split="random", train_size=10)
    assert alone.rows[0][kind.score] == comparison.rows[1][kind.score]
    for sizes in ([], [5, 5], ["x"]):
        with pytest.raises(bisplat.InputError, match="train_size: expected"):
            kind.compare(kind.dataset, [kind.worse], train_size=sizes)


def test_seeds_fit_each_method_anew_on_the_same_split(kind, monkeypatch):
    monkeypatch.setattr(Own, "seeds", [])
    comparison = kind.compare(kind.dataset, {"mine": Own, "other": kind.worse}, seeds=2, budget=0.5, seed=7)
    assert Own.seeds == [(0, 0.5), (1, 0.5)]
    assert [(row["label"], row["seed"]) for row in comparison] == [("mine", 0), ("other", 0), ("mine", 1), ("other", 1)]
    mine, other = comparison.averages()
    assert mine["seeds"] == other["seeds"] == 2 and other[kind.score.replace("median", "spread")] == 0
    both = [row[kind.score] for row in comparison if row["label"] == "mine"]
    assert mine[kind.score] == pytest.approx(np.mean(both))
    assert mine[kind.score.replace("median", "spread")] == pytest.approx(np.std(both, ddof=1))
    assert "± seeds" in str(comparison).splitlines()[0] and len(comparison.facts()["fits"]) == 4
    assert "mine (3)" in comparison.remark()


def test_own_methods_are_classes_functions_objects_or_names(kind, tmp_path, monkeypatch):
    (tmp_path / "named_method.py").write_text("from tests.learn.comparison.test_fits import Own as Mine\n")
    monkeypatch.chdir(tmp_path)
    given = {"class": Own, "function": lambda: Own(), "object": Own(), "name": "named_method:Mine", "ours": kind.worse}
    comparison = kind.compare(kind.dataset, given)
    first, *others, _ = comparison.rows
    assert all(row[kind.score] == first[kind.score] for row in others)
    assert kind.compare(kind.dataset, ["named_method:Mine"]).rows[0]["label"] == "named_method:Mine"


@pytest.mark.parametrize(
    ("wrong", "found"),
    [
        (lambda given: given[:1, :1], "an array"),
        (lambda given: 1 / 0, "ZeroDivisionError: .*test_fits.py, line"),
        (lambda given: given * np.nan if np.iscomplexobj(given) else np.full((len(given), 2), np.nan), "not finite"),
    ],
)
def test_errors_of_own_methods_name_them(kind, wrong, found, monkeypatch):
    monkeypatch.setattr(Own, "wrong", staticmethod(wrong))
    with pytest.raises(bisplat.InputError, match=f"mine: .*{found}") as raised:
        kind.compare(kind.dataset, {"mine": Own})
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("methods", "found"),
    [(["bisplat"], "bisplat"), (["nowhere:Class"], "nowhere"), ({"mine": int}, "int"), ([], "none"), ("mean", "mean")],
)
def test_wrong_methods_are_refused(kind, methods, found):
    with pytest.raises(bisplat.InputError, match=f"methods: expected .* found .*{found}"):
        kind.compare(kind.dataset, methods)


def test_methods_that_are_trained_by_steps_are_only_compared_if_named():
    class Learned(Own):
        by_steps = True

    known = {"quick": Own, "learned": Learned}
    assert list(chosen_methods(None, known)) == ["quick"] and list(chosen_methods(["learned"], known)) == ["learned"]


def test_the_command_writes_tables_and_a_figure(kind, bisplat_command, tmp_path):
    call = ("compare", kind.dataset.folder, "-o", "table", "--split", "random", "--models", kind.worse, kind.better)
    assert bisplat_command(*call, "--seeds", 2)[0] == 0
    folder = tmp_path / "table"
    kept = {"protocol.json", "results.jsonl", "per_sample"}
    tables = {"results.json", "table.tex", "table.csv"}
    assert set(listing(folder)) == kept | tables | {f"{kind.figure}.png", f"{kind.figure}.pdf"}
    facts = json.loads((folder / "results.json").read_text())
    assert facts["known"] == 48 and list(facts["methods"]) == [kind.better, kind.worse] and len(facts["fits"]) == 4
    assert f"48 known {kind.things}, 12 test {kind.things}" in facts["provenance"]["spectra"]
    assert facts["provenance"]["seed"] == "0 to 1"
    rows = list(csv.DictReader((folder / "table.csv").open()))
    assert float(rows[0][kind.score]) == facts["methods"][rows[0]["method"]][kind.score]
    assert float(rows[0][kind.score.replace("median", "spread")]) == 0
    assert bisplat_command(*call)[0] == 0  # with the first seed alone, which is there
    assert json.loads((folder / "results.json").read_text())["fits"] == facts["fits"]


def test_sweep_writes_a_figure_and_all_rows(kind, bisplat_command, tmp_path):
    call = ("sweep", kind.dataset.folder, "-o", "sizes", "--sizes", 30, 10, "--methods", kind.worse, kind.better)
    status, out, err = bisplat_command(*call)
    assert status == 0 and re.search(rf"{kind.better}, 10.*\n.* {kind.worse}, 10 .*\n.* {kind.better}, 30", out), err
    assert {"results.json", "table.tex", "table.csv", "sweep.png", "sweep.pdf"} < set(listing(tmp_path / "sizes"))
    assert len(json.loads((tmp_path / "sizes" / "results.json").read_text())["methods"]) == 4


class Stops(Own):
    """The second fit is interrupted."""

    fits: ClassVar[int] = 0

    def fit(self, known):
        Stops.fits += 1
        if Stops.fits == 2:
            raise KeyboardInterrupt
        super().fit(known)


def test_an_interrupted_comparison_makes_the_missing_fits_alone(kind, tmp_path, monkeypatch):
    monkeypatch.setattr(Stops, "fits", 0)
    methods = {"mine": Stops, "other": kind.worse}
    compare = partial(kind.compare, kind.dataset, methods, split="random", seeds=2)
    with pytest.raises(KeyboardInterrupt):
        compare(output=tmp_path / "kept")
    assert len((tmp_path / "kept" / "results.jsonl").read_text().splitlines()) == 2  # both methods, first seed
    continued = compare(output=tmp_path / "kept")
    assert Stops.fits == 3
    again = compare(output=tmp_path / "kept")
    assert Stops.fits == 3 and again.rows == continued.rows and len(again) == 4
    assert sorted(listing(tmp_path / "kept" / "per_sample")) == ["mine-0.npz", "other-0.npz"]
    whole = compare()
    for each in (again, continued):
        assert str(each).splitlines()[0] == str(whole).splitlines()[0]
        for row, same in zip(each, whole, strict=True):
            assert {**row, "seconds": 0} == {**same, "seconds": 0}
        for name, scores in whole.of_each().items():
            np.testing.assert_array_equal(each.of_each()[name], scores)


def test_other_methods_and_sizes_join_a_comparison(kind, tmp_path):
    compare = partial(kind.compare, kind.dataset, split="random", output=tmp_path / "kept")
    compare([kind.better], train_size=30)
    joined = compare([kind.worse], train_size=10)
    assert [(row["label"], row["train_size"]) for row in joined] == [(kind.better, 30), (kind.worse, 10)]
    assert joined.known == 33 and set(joined.of_each()) == {f"{kind.better}, 30", f"{kind.worse}, 10"}


def test_another_method_with_the_same_label_is_fitted_again(kind, tmp_path, capsys):
    compare = partial(kind.compare, kind.dataset, split="random", output=tmp_path / "kept")
    first = compare({kind.better: kind.worse}).rows
    assert compare({kind.better: kind.worse}).rows == first
    again = compare([kind.better]).rows
    assert "have changed, so it is measured again" in capsys.readouterr().err
    assert len(again) == 1 and again[0][kind.score] != first[0][kind.score]


def test_a_folder_of_other_settings_or_data_is_refused_and_kept(kind, tmp_path):
    compare = partial(kind.compare, methods=[kind.worse], output=tmp_path / "kept")
    compare(kind.dataset, split="random")
    before = {path: path.read_bytes() for path in (tmp_path / "kept").rglob("*") if path.is_file()}
    with pytest.raises(bisplat.InputError, match=r"split 'files', found .* 'random'"):
        compare(kind.dataset)
    other = replace(kind.dataset, train=kind.dataset.train[:-1])
    with pytest.raises(bisplat.InputError, match="found one of other data"):
        compare(other, split="random")
    assert all(path.read_bytes() == content for path, content in before.items())
    (tmp_path / "kept" / "per_sample" / f"{kind.worse}-0.npz").unlink()
    with pytest.raises(bisplat.InputError, match=r"-0\.npz: expected"):
        compare(kind.dataset, split="random")


def test_the_report_of_one_method_beside_the_baselines(kind, bisplat_command, tmp_path):
    call = partial(bisplat_command, "evaluate", kind.dataset.folder, "--split", "random", "--model", kind.better)
    status, out, err = call("-o", "report")
    assert status == 0 and "report: report/report.html" in err and kind.better in out, err
    folder = tmp_path / "report"
    page = (folder / "report.html").read_text()
    assert f"<h1>{kind.better} on 12 held-out {kind.things}</h1>" in page and "data:image/png;base64" in page
    assert {"results.json", "table.tex", "table.csv", "per_sample.csv", f"{kind.figure}.pdf"} <= set(listing(folder))
    assert json.loads(call("-o", "other", "--json")[1])["test"] == 12
    assert call()[0] == 1 and call("-o", "report")[0] == 1


def test_the_report_of_a_model_that_is_reduced_without_a_gpu(kind, bisplat_command, tmp_path):
    label = "nerf2" if torch.cuda.is_available() else "nerf2 (reduced)"
    options = ("--split", "random", "--model", "nerf2", "--budget", "0.0001", "-o", "report")
    status, out, err = bisplat_command("evaluate", kind.dataset.folder, *options)
    assert status == 0 and label in out, err
    assert label in (tmp_path / "report" / "report.html").read_text()


def listing(folder: Path) -> list[str]:
    """Names of the files in a folder."""
    return [path.name for path in folder.iterdir()]
