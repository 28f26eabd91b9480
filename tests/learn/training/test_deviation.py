"""How far a prediction may be off: what a run states about spectra that it does not know holds for them."""

import json

import numpy as np
import pytest
from PIL import Image

import bisplat
from learn.evaluation.evaluate import evaluate
from learn.models.kriging.deviation_curve import NORMAL
from learn.reports.evaluation_report import write_evaluation
from learn.training.conformal_deviation import LEAST, LEAST_VALIDATED, fit_deviation
from learn.training.run_files import read_known_positions, read_training
from scenes.files.errors import InputError

GAP = np.random.default_rng(1).uniform(0, 2, size=4000)
CURVE = ([0.0, 2.0], [0.0, 0.2])


@pytest.mark.parametrize(
    ("over", "constant", "growth"), [("distance", 0.05, 0.0), ("distance", 0.05, 1.0), ("variance", 0.0, 1.6)]
)
def test_intervals_hold_nine_tenths_of_new_errors_at_every_distance(over, constant, growth):
    generator = np.random.default_rng(0)
    # The squared error grows in proportion to the gap. Large errors are more frequent than those of a normal
    # distribution, of which nine tenths would lie within the same 1.645 deviations.
    true = np.sqrt(constant**2 + growth**2 * 0.02 * GAP)
    errors = true[:, None] * generator.standard_t(4, size=(4000, 5)) * NORMAL / 2.1318
    curve = CURVE if growth else ([0.0, 2.0], [0.0, 1e-6])
    found = fit_deviation(errors[:2000], GAP[:2000], over, curve)
    stated, new = found.at(GAP[2000:], 2000), errors[2000:]
    for low in (0.0, 0.5, 1.0, 1.5):
        band = (GAP[2000:] >= low) & (GAP[2000:] < low + 0.5)
        assert np.mean(np.abs(new[band]) <= NORMAL * stated[band, None]) == pytest.approx(0.9, abs=0.03)


def test_a_few_errors_say_nothing_and_none_is_below_half_a_grey_level():
    assert fit_deviation(np.zeros((LEAST_VALIDATED - 1, 9)), None) is None
    assert fit_deviation(np.zeros((50, 9)), None).at(None, 1) == LEAST


def test_the_deviation_is_at_most_that_of_knowing_nothing():
    errors = np.random.default_rng(0).normal(scale=0.1, size=(50, 100))
    found = fit_deviation(errors, np.full(50, 1.0), "distance", CURVE, nothing=0.15)
    assert (np.diff(found.at(np.linspace(0, 3, 30), 30)) >= 0).all()
    assert found.at(np.array([1.0, 100.0]), 2) == pytest.approx([0.1, 0.15], abs=0.01)


def test_a_model_better_than_kriging_scales_the_curve_as_far_as_validation_spectra_reach():
    errors = np.random.default_rng(0).normal(scale=0.5 * np.sqrt(0.02), size=(50, 100))
    found = fit_deviation(errors, np.ones(50), "distance", CURVE)
    expected = np.sqrt(np.interp([1.0, 2.0], CURVE[0], np.square(CURVE[1]))) * [0.5, 1.0]
    assert found.at(np.array([1.0, 2.0]), 2) == pytest.approx(expected, rel=0.05)


@pytest.fixture(scope="module")
def run(tmp_path_factory, write_folder):
    """A run on 150 spectra, 108 of them to train on, 12 to validate."""
    folder = tmp_path_factory.mktemp("deviation")
    return bisplat.train(write_folder(folder / "data", 150), folder / "run", model="mlp", steps=6)


def test_a_run_states_the_deviation_of_its_validation(run):
    kept = json.loads((run.folder / "training.json").read_text())["deviation"]
    data = run.dataset()
    known = data.positions[run.split(data).train]
    np.testing.assert_allclose(read_known_positions(run.folder), known, atol=1e-6)
    at_known, beside = run.deviation(known[:1])[0], run.deviation(known[:1] + 0.3)[0]
    assert at_known == pytest.approx(kept["constant"]) and LEAST < at_known <= beside <= kept["nothing"]
    assert kept["over"] == "distance" and kept["spectra"] == 12


def test_far_from_everything_the_deviation_is_not_a_number(run, capsys):
    stated = run.deviation(np.array([[50.0, 50.0, 1.0], [2.0, 0.5, 1.0]]))
    assert np.isnan(stated[0]) and np.isfinite(stated[1])
    assert "1 of 2 positions are more than" in capsys.readouterr().err


def test_too_few_validation_spectra_are_said(tmp_path, write_folder, capsys):
    few = bisplat.train(write_folder(tmp_path / "data", 40), tmp_path / "run", model="mlp", steps=2)
    assert few.deviation(np.zeros((1, 3))) is None
    assert "states no deviation of its predictions: 3 validation spectra cannot tell it, 10 can" in (
        capsys.readouterr().err
    )


def test_a_damaged_curve_is_refused(tmp_path):
    stated = {"constant": 0.1, "growth": 1.0, "spectra": 9, "gaps": [0.0, 1.0], "errors": [0.0]}
    (tmp_path / "training.json").write_text(json.dumps({"steps": 0, "seconds": 1.0, "deviation": stated}))
    with pytest.raises(InputError, match="expected as many ascending gaps as errors"):
        read_training(tmp_path)


@pytest.mark.slow
def test_evaluation_shows_how_often_the_intervals_hold(run, tmp_path, no_ceiling):
    evaluation = evaluate(run)
    write_evaluation(evaluation, tmp_path)
    metrics = json.loads((tmp_path / "metrics.json").read_text())
    errors = np.abs(evaluation.truth - evaluation.prediction)[:, ::5, ::5]
    within = errors <= NORMAL * run.deviation(evaluation.positions)[:, None, None]
    assert metrics["within_90_percent_interval"] == pytest.approx(within.mean())
    bands = metrics["interval_bands"].values()
    assert sum(band["spectra"] for band in bands) == len(evaluation)
    together = sum(band["spectra"] * band["within_90_percent_interval"] for band in bands)
    assert together / len(evaluation) == pytest.approx(within.mean())
    with Image.open(tmp_path / "reliability.png") as image:
        image.verify()
    assert "Reliability: how many of the true values" in (tmp_path / "report.html").read_text()
