"""The comparison of methods that predict responses over a band, and runs that predict them."""

import dataclasses

import numpy as np
import pytest
from learn.band.compare_band import score_band

import bisplat
from learn.band.band_methods import KnownBand, Kriging, PredictedBand
from learn.data.neighbours import nearest
from scenes.files.errors import InputError

ARRAY, SUBCARRIERS = bisplat.PlanarArray(2, 2), 8


@pytest.fixture(autouse=True, scope="module")
def quick():
    """A short search, which is enough for so few positions."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("learn.models.kriging.vecchia.FITTED_ON", 30)
        patch.setattr("learn.models.kriging.vecchia.ITERATIONS", 15)
        patch.setattr("learn.models.kriging.stacking.FOLDED", 1)
        patch.setattr("learn.models.kriging.deviation_curve.FOLDED", 1)
        yield


@pytest.fixture(scope="module")
def wide(quick, tmp_path_factory) -> bisplat.Dataset:
    """Spectra of a transmitter in free space that moves far from the array."""
    positions = np.random.default_rng(0).uniform(0, 0.3, (60, 3)) + np.array([6, 0, 0])
    frequencies = bisplat.Band(40e6, SUBCARRIERS).frequencies(1e9)
    late = np.linalg.norm(positions[:, None] - 0.15 * ARRAY.positions, axis=2) / 299_792_458
    responses = np.exp(-2j * np.pi * frequencies * late[..., None]) / late[..., None]
    folder = tmp_path_factory.mktemp("band") / "wide"
    return bisplat.write_dataset(folder, positions, responses, ARRAY, 1e9, bandwidth=40e6)


def test_waves_are_predicted_best(wide):
    comparison = bisplat.compare_band(wide, split="random")
    scores = {row["label"]: row for row in comparison.table()}
    assert next(iter(scores)) == "helmholtz" and set(scores) == {"helmholtz", "kriging", "inverse-distance", "nearest"}
    assert scores["helmholtz"]["snr_median_db"] > scores["inverse-distance"]["snr_median_db"] + 15
    assert scores["nearest"]["coverage_90"] is None and 0 < scores["helmholtz"]["coverage_90"] <= 1
    assert comparison.snr_db["nearest"].shape == (12,)
    assert comparison.facts()["methods"]["nearest"]["known"] == 48


def test_a_run_predicts_the_band(wide, tmp_path):
    run = bisplat.train(wide, tmp_path / "run", split="random")
    parts = run.split(wide)
    for each in (run, bisplat.load_run(tmp_path / "run")):
        predicted = each.predict(wide.positions[parts.test]).band_responses
        truth = wide.band_responses[parts.test]
        assert predicted.shape == truth.shape
        assert np.linalg.norm(predicted - truth) < 0.2 * np.linalg.norm(truth)


def test_a_dataset_without_band_is_refused(wide):
    carrier = dataclasses.replace(wide, band=None, band_responses=None)
    with pytest.raises(InputError, match="expected responses over a band"):
        bisplat.compare_band(carrier, ["nearest"], split="random")


def test_scores_are_those_of_their_definitions():
    truth = np.ones((2, 1, 4), complex)
    predicted = PredictedBand(0.9 * truth, np.array([0.1, 0.05]))
    scores = score_band(predicted, truth, 1e6)
    assert scores["snr_median_db"] == pytest.approx(20)
    assert scores["correlation_median"] == pytest.approx(1)
    assert scores["delay_spread_error_median_ns"] == 0
    assert scores["coverage_90"] == pytest.approx(0.75)  # 0.1 is within 0.1645, but not within 0.082
    assert set(score_band(predicted, 0 * truth, 1e6).values()) == {None}


def test_the_error_of_a_delay_spread_is_in_nanoseconds(wide):
    """Two paths of equal power, 250 ns apart instead of 125: spreads of 125 and 62.5 ns. 64 subcarriers of 1 MHz."""
    frequencies = 1e6 * np.arange(64)
    truth, other = (1 + np.exp(-2j * np.pi * frequencies * delay)[None, None] for delay in (125e-9, 250e-9))
    scores = score_band(PredictedBand(other), truth, 64e6)
    assert scores["delay_spread_error_median_ns"] == pytest.approx(62.5, rel=0.01)
    (row,) = bisplat.compare_band(wide, ["nearest"], split="random").rows
    parts, responses = bisplat.split(wide, "random", 0), wide.band_responses
    copied = nearest(wide.positions[parts.known], responses[parts.known], wide.positions[parts.test])
    expected = score_band(PredictedBand(copied), responses[parts.test], 40e6)["delay_spread_error_median_ns"]
    assert row["delay_spread_error_median_ns"] == pytest.approx(expected, abs=0.01) and expected > 0.01


def test_kriging_returns_the_known_responses(wide):
    method = Kriging()
    method.fit(KnownBand(wide, np.arange(40)))
    found = method.predict(wide.positions[:40]).responses
    truth = wide.band_responses[:40]
    assert np.linalg.norm(found - truth) < 0.1 * np.linalg.norm(truth)
