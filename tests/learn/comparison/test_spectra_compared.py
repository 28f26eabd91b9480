"""What is of spectra alone: the ceiling, constant pictures, trained models and their budgets, ablations, kriging."""

import shutil
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from PIL import Image

import bisplat
from learn.comparison.variants import variants
from learn.data.metrics import score
from learn.data.neighbours import nearest
from learn.data.splits import split
from learn.fitted.runs import load_run, train
from learn.methods.interpolation import Kriging, KrigingResponses
from learn.methods.method_table import methods_of, usual_names
from learn.methods.trained_model import TrainedModel
from learn.quantities.array_ceiling import CEILING
from learn.quantities.known import HowSplit, Known
from learn.quantities.spectra import Spectra
from learn.reports.comparison_report import validation_curve, write_comparison
from learn.training.budget import Speed
from learn.training.config import read_config
from learn.training.run_files import read_training
from learn.training.validation_part import Learned
from scenes.files.errors import InputError
from simulate.dataset.dataset_folder import read_dataset
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.identification import Identification
from simulate.spectra.spectrum import evenly, normalise, spectrum_of
from tests.docs.pages import blocks

pytestmark = pytest.mark.usefixtures("small_models")

INSTANT = 1e-6  # Minutes that hold one step

compare = partial(bisplat.compare, budget=INSTANT)


def known_in(dataset, folder, minutes=INSTANT, seed=0) -> Known:
    how = HowSplit("files", 0, None, 0.0)
    return Known(dataset, Spectra(), split(dataset, "files", 0), seed, minutes, None, folder, how)


class Grey:
    """A method of one's own: the same grey everywhere."""

    def __init__(self, level=0.5):
        self.level = level

    def fit(self, known):
        self.known = known

    def predict(self, positions):
        return np.full((len(positions), 90, 360), self.level)


def test_scores_are_those_of_evaluate_and_the_ceiling_is_last(tiny, tmp_path):
    comparison = compare(tiny, ["nearest"], output=tmp_path / "out")
    table = [row["label"] for row in comparison.table()]
    assert set(table) == {"mean-picture", "nearest", "inverse-distance", CEILING} and table[-1] == CEILING
    dataset = read_dataset(tiny)
    parts = split(dataset, "files", 0)
    known = spectrum_of(dataset.pictures[parts.known])
    copied = nearest(dataset.positions[parts.known], known, dataset.positions[parts.test])
    expected = score(copied, spectrum_of(dataset.pictures[parts.test]), dataset.grid)
    row = next(row for row in comparison if row["label"] == "nearest")
    assert expected.summary().items() <= row.items()
    assert (row["train"], row["known"], row["test"]) == (17, 19, 5)
    np.testing.assert_array_equal(comparison.each["nearest"]["ssim"], expected.ssim)
    write_comparison(comparison, tmp_path / "out")
    page = (tmp_path / "out" / "table.html").read_text()
    assert f"{row['ssim_median']:.3f}" in page and "ceiling (bound)" in page


PAGE = "docs/how-to/add-my-own-model.md"
_, LOOP, *_ = (block.text for block in blocks(PAGE) if block.language == "python" and not block.file)


def test_loop_of_ones_own_in_the_docs_scores_the_mean_picture_as_a_comparison_does(workplace, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "data").symlink_to(workplace / "data")
    values: dict = {}
    exec(LOOP, values)
    row = next(row for row in compare("data/lab", ["mean-picture"], split="random") if row["label"] == "mean-picture")
    assert values["scores"].summary()["ssim_median"] == pytest.approx(row["ssim_median"], abs=1e-5)


def test_fewer_test_spectra_are_spread_over_the_test_part(tiny):
    comparison = compare(tiny, ["nearest"], tested=2)
    assert {row["test"] for row in comparison} == {2}
    assert comparison.test.tolist() == evenly(split(read_dataset(tiny), "files", 0).test, 2).tolist()


def test_methods_worse_than_the_mean_picture_are_named(tiny):
    comparison = compare(tiny, {"black": Grey(0.0)})
    assert "black" in comparison.doubts() and "mean-picture" not in comparison.doubts()
    assert "black" in comparison.remark()


def test_no_method_learns_from_positions_within_the_guard(tiny, tmp_path):
    """The positions of ``tiny`` are 0.56 wavelengths apart."""
    dataset, grey = read_dataset(tiny), Grey()
    row = compare(tiny, {"recording": lambda: grey}, guard=0.6).rows[-2]
    train(tiny, tmp_path / "run", model="helmholtz", guard=0.6)
    test = dataset.positions[split(dataset, "files", 0).test]
    kept = load_run(tmp_path / "run").model.state_dict()
    places = next(value.numpy() for name, value in kept.items() if name.endswith("places"))
    for known in (grey.known.positions, places):
        away = np.linalg.norm(known[:, None] - test, axis=-1).min()
        assert len(known) == row["known"] < 19 and away > 0.6 * dataset.wavelength


def test_black_spectra_are_left_out_of_every_score_and_alone_are_refused(tiny, tmp_path, capsys):
    folder, dataset = shutil.copytree(tiny, tmp_path / "black"), read_dataset(tiny)
    pictures = [folder / "spectrum" / f"{dataset.names[index]}.png" for index in split(dataset, "files", 0).test]
    black = Image.fromarray(np.zeros((90, 360), np.uint8))
    for path in pictures[:2]:
        black.save(path)
    scored = compare(folder, ["nearest"])
    assert "2 of 5 test spectra are constant" in capsys.readouterr().err
    assert {row["test"] for row in scored} == {3}
    np.testing.assert_array_equal(
        scored.each["nearest"]["ssim"], compare(tiny, ["nearest"]).each["nearest"]["ssim"][2:]
    )
    for path in pictures[2:]:
        black.save(path)
    with pytest.raises(InputError, match="found 5 constant ones"):
        compare(folder, ["nearest"], output=tmp_path / "none")
    assert not (tmp_path / "none").exists()


def test_spectra_of_two_elements_are_not_scored(tiny, tmp_path):
    data, small = read_dataset(tiny), Identification(Beamformer(PlanarArray(1, 2)), source="metadata")
    with pytest.raises(InputError, match="at least 3 elements to score spectra, found 1 × 2"):
        compare(replace(data, receiver=replace(data.receiver, identification=small)), output=tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_trained_model_is_a_run_that_is_not_trained_twice(tiny, tmp_path):
    known = known_in(read_dataset(tiny), tmp_path / "run", seed=1)
    positions, first, again = known.dataset.positions[:3], TrainedModel("bisplat-aperture"), None
    first.fit(known)
    written = (tmp_path / "run" / "weights.safetensors").stat().st_mtime_ns
    again = TrainedModel("bisplat-aperture")
    again.fit(replace(known, minutes=99.0))
    assert (tmp_path / "run" / "weights.safetensors").stat().st_mtime_ns == written
    np.testing.assert_array_equal(again.predict(positions).value, first.predict(positions).value)
    assert first.parameters > 1000 and first.seconds >= 0


def test_a_budget_becomes_steps_and_ends_by_the_clock(tiny, tmp_path, monkeypatch):
    """The speed that is measured is a thousand times too high."""
    monkeypatch.setattr("learn.training.budget.measured_speed", lambda *_: Speed(step=1e-5, validation=0.0))
    method = TrainedModel("mlp")
    method.fit(known_in(read_dataset(tiny), tmp_path / "run", minutes=0.02))
    planned = read_config(tmp_path / "run").config.by_steps.steps
    assert planned > 10_000 and 0 < method.steps < planned and method.seconds < 10


def test_finding_phases_is_part_of_the_budget(tiny, tmp_path, monkeypatch):
    where = "learn.training.budget."
    monkeypatch.setattr(f"{where}learned_responses", lambda *_: Learned(None, seconds=60.0))
    monkeypatch.setattr(f"{where}measured_speed", lambda *_: Speed(step=60.0, validation=0.0))
    TrainedModel("mlp-responses").fit(known_in(read_dataset(tiny), tmp_path / "run", 3.0))
    assert read_config(tmp_path / "run").config.by_steps.steps == 2
    assert read_training(tmp_path / "run").seconds >= 60


@pytest.mark.parametrize("effort", [{"steps": 3}, {"budget": INSTANT}])
def test_another_device_may_continue_with_steps_but_not_with_a_budget(effort, tiny, tmp_path, monkeypatch):
    call = partial(bisplat.compare, tiny, ["nearest"], output=tmp_path, **effort)
    before = call().rows
    monkeypatch.setattr("learn.comparison.compare.device_name", lambda: "64 CPU threads")
    if "steps" in effort:
        assert call().rows == before
    else:
        with pytest.raises(InputError, match="device '64 CPU threads'"):
            call()


NEED_RESPONSES = {"mirror-images", "kriging-responses"}
NAMES = set(usual_names("spectrum", methods_of("spectrum"))) - {"bisplat-plus", "nerf2"} - NEED_RESPONSES


@pytest.mark.parametrize("name", sorted(NAMES))
def test_every_method_fits_and_predicts(tiny, tmp_path, name):
    dataset = read_dataset(tiny)  # without responses
    known = known_in(dataset, tmp_path / "run")
    method = methods_of("spectrum")[name]()
    method.fit(known)
    pictures = method.predict(dataset.positions[known.parts.test]).value
    assert pictures.shape == (5, 90, 360) and np.isfinite(pictures).all()


@pytest.mark.parametrize("name", sorted(NEED_RESPONSES))
def test_methods_that_need_responses_are_left_out_where_a_dataset_has_pictures_alone(tiny, name, capsys):
    assert name not in {row["label"] for row in compare(tiny, [name])}
    assert f"left out {name}" in capsys.readouterr().err


@pytest.fixture
def smooth(plane_waves, tiny):
    """A dataset of two waves whose directions and phases turn slowly along a line, and which rows are known."""
    along = np.sort(np.random.default_rng(0).uniform(0, 1, 60))
    positions = np.stack([2 * along, 0.3 * along, np.ones(60)], axis=1)
    waves = [((np.exp(6j * t), 20 + 90 * t, 40), (0.5, 250, 60 - 20 * t)) for t in along]
    responses = np.array([plane_waves(*each) for each in waves])
    pictures = np.round(255 * normalise(Beamformer().spectrum(responses))).astype(np.uint8)
    names = [f"{number:05d}" for number in range(1, 61)]
    data = replace(
        read_dataset(tiny), names=names, values={"spectrum": pictures, "response": responses}, places=positions
    )
    return data, np.arange(60) % 3 != 1


def test_kriging_is_nearer_than_the_nearest(smooth):
    dataset, known = smooth
    taught, asked = Known.of(dataset, Spectra(), np.flatnonzero(known)), dataset.positions[~known]
    truth = dataset.spectra[~known]
    copied = np.abs(nearest(taught.positions, taught.values, asked) - truth).mean()
    for method, share in ((Kriging(), 0.5), (KrigingResponses(), 0.2)):
        method.fit(taught)
        assert np.abs(method.predict(asked).value - truth).mean() < share * copied


def test_an_ablation_has_the_papers_rows_and_ours(tiny, tmp_path):
    papers = variants(["bisplat-plus"])
    assert len(papers) == 4
    assert papers["bisplat-plus without BST"] == TrainedModel("bisplat-plus", {"bypass": ["bst"]})
    ours = variants(["bisplat-aperture"])
    assert ours["bisplat-aperture with TX-PE"].options == {"encoding": "octaves"}
    assert ours["bisplat-aperture without depth order"].options == {"ordered": False}
    smaller = variants(["bisplat"], 250)["bisplat (250 primitives) without BST"]
    assert smaller == TrainedModel("bisplat", {"primitives": 250, "bypass": ["bst"]})
    with pytest.raises(InputError, match="models: expected models whose parts can be switched off"):
        variants(["mlp"])
    out = tmp_path / "out"
    comparison = bisplat.compare(tiny, variants(["bisplat"]), steps=2, seeds=2, output=out)
    trained = [row for row in comparison.averages() if row.get("steps") is not None]
    assert len(trained) == 4 and all(row["seeds"] == 2 for row in trained)
    write_comparison(comparison, out, variants=True)
    assert min((out / f"{name}.png").stat().st_size for name in ("variants", "learning_curves")) > 5000


def test_a_model_also_starts_from_the_weights_of_a_run(tiny, tmp_path):
    run = train(tiny, tmp_path / "before", model="mlp", steps=1, find_phases=False)
    rows = bisplat.compare(tiny, ["mlp"], sizes=[5], init=run, steps=2, output=tmp_path / "out").rows
    assert {"mlp", "mlp from before"} < {row["label"] for row in rows}
    with pytest.raises(InputError, match="init: expected a run of a model that is trained by steps"):
        bisplat.compare(tiny, ["nearest"], init=train(tiny, tmp_path / "closed"))


def test_a_learning_curve_goes_on_after_an_interruption(tmp_path):
    for attempt, steps in enumerate(([10, 20], [20, 30])):
        folder = tmp_path / "logs" / f"version_{attempt}"
        folder.mkdir(parents=True)
        lines = [f"{step - 1},{0.1 * attempt + step / 100}" for step in steps]
        (folder / "metrics.csv").write_text("\n".join(["step,validation_ssim", *lines, ""]))
    steps, ssim = validation_curve(tmp_path)
    assert steps == [10, 20, 30] and ssim == pytest.approx([0.1, 0.3, 0.4])
