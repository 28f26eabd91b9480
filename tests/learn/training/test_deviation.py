"""How far a prediction may be off: what a run states about spectra that it does not know holds for them."""

import json

import numpy as np
import pytest
from PIL import Image

import bisplat
from learn.evaluation.evaluate import evaluate
from learn.reports.evaluation_report import write_evaluation
from learn.training.deviation import LEAST, LEAST_VALIDATED, NORMAL, fit_deviation
from learn.training.run_folder import load_run

VARIANCE = np.random.default_rng(1).uniform(size=4000)


@pytest.mark.parametrize(
    ("constant", "growth", "variance"), [(0.05, 0.0, None), (0.05, 0.0, VARIANCE), (0.02, 0.3, VARIANCE)]
)
def test_intervals_hold_nine_tenths_of_new_errors(constant, growth, variance):
    generator = np.random.default_rng(0)
    true = np.sqrt(constant**2 + growth**2 * (0 if variance is None else variance)) * np.ones(4000)
    # Far errors are more frequent than those of a normal distribution.
    errors = true[:, None] * generator.standard_t(4, size=(4000, 5))
    half = None if variance is None else variance[:2000]
    found = fit_deviation(errors[:2000], half)
    stated = found.at(None if variance is None else variance[2000:], 2000)
    assert np.mean(np.abs(errors[2000:]) <= NORMAL * stated[:, None]) == pytest.approx(0.9, abs=0.02)
    if growth:  # positions of large variance are told from those of small
        assert np.corrcoef(stated, true[2000:])[0, 1] > 0.98


def test_a_few_errors_say_nothing_and_none_is_below_half_a_grey_level():
    assert fit_deviation(np.zeros((LEAST_VALIDATED - 1, 9)), None) is None
    assert fit_deviation(np.zeros((50, 9)), None).at(None, 1) == LEAST


@pytest.fixture(scope="module")
def run(tmp_path_factory, write_folder):
    """A run on 150 spectra, 108 of them to train on, 12 to validate."""
    folder = tmp_path_factory.mktemp("deviation")
    return bisplat.train(write_folder(folder / "data", 150), folder / "run", model="mlp", steps=6)


def test_a_run_states_the_deviation_of_its_validation(run):
    kept = json.loads((run.folder / "training.json").read_text())["deviation"]
    stated = run.deviation(np.array([[2.0, 0.5, 1.0], [1.0, 0.0, 1.0]]))
    np.testing.assert_allclose(stated, kept["constant"])  # a network has no variance of its own
    assert kept["growth"] == 0 and kept["constant"] > LEAST


@pytest.mark.slow
def test_evaluation_shows_how_often_the_intervals_hold(run, tmp_path, no_ceiling):
    evaluation = evaluate(run)
    write_evaluation(evaluation, tmp_path)
    metrics = json.loads((tmp_path / "metrics.json").read_text())
    errors = np.abs(evaluation.truth - evaluation.prediction)[:, ::5, ::5]
    within = errors <= NORMAL * run.deviation(evaluation.positions)[:, None, None]
    assert metrics["within_90_percent_interval"] == pytest.approx(within.mean())
    with Image.open(tmp_path / "reliability.png") as image:
        image.verify()
    assert "Reliability: how many of the true values" in (tmp_path / "report.html").read_text()


@pytest.mark.slow
def test_a_run_of_an_earlier_version_states_none(run, no_ceiling, tmp_path):
    path = run.folder / "training.json"
    before = path.read_text()
    try:
        path.write_text(json.dumps({name: value for name, value in json.loads(before).items() if name != "deviation"}))
        earlier = load_run(run.folder)
        assert earlier.deviation(np.zeros((1, 3))) is None
        evaluation = evaluate(earlier)
        write_evaluation(evaluation, tmp_path)
        assert "within_90_percent_interval" not in evaluation.metrics()
        assert not (tmp_path / "reliability.png").exists()
    finally:
        path.write_text(before)
