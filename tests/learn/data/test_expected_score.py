"""The curve of the score over the density: rising, between the rooms, worded, and turned into numbers of spectra."""

import numpy as np
import pytest

from learn.data import expected_score
from learn.data.expected_score import FILE, ScoreCurve, Spacing, expectation, facts, score_curve, scores_in
from learn.planning import next_positions as spectra_needed
from scenes.files.errors import ParameterError
from simulate.spectra.array import PlanarArray

CURVE = ScoreCurve(
    density=np.array([1.0, 4.0, 16.0]),
    low=np.array([0.5, 0.7, 0.8]),
    middle=np.array([0.6, 0.8, 0.9]),
    high=np.array([0.7, 0.85, 0.95]),
)
BOX = np.random.default_rng(0).random((2000, 3)) * [4, 3, 2]
NOTHING = np.zeros((0, 3))


@pytest.fixture
def curve(monkeypatch):
    """The same simple curve for volumes and planes."""
    for module in (expected_score, spectra_needed):
        monkeypatch.setattr(module, "score_curve", lambda shape: CURVE)


@pytest.mark.parametrize("shape", ["volume", "plane"])
def test_shipped_curve_rises_and_holds_the_rooms(shape):
    curve, rooms = score_curve(shape), scores_in(FILE, shape)
    assert len(rooms) >= 6 and len(curve.density) >= 4
    for line in (curve.density, curve.low, curve.middle, curve.high):
        assert (np.diff(line) >= 0).all()
    assert (curve.low <= curve.middle).all() and (curve.middle <= curve.high).all()
    assert curve.middle[-1] > curve.middle[0] + 0.05 and curve.high[-1] <= 1
    for scores in rooms.values():
        for density in curve.density:
            expected = curve.at(density)
            assert expected.low <= scores[density] <= expected.high


def test_curve_is_level_where_scores_fall():
    curve = ScoreCurve.over(
        {"a": {1: 0.8, 2: 0.7, 4: 0.9}, "b": {1: 0.8, 2: 0.9, 4: 0.9}, "c": {2: 0.6, 1: 0.8, 4: 0.9}}
    )
    np.testing.assert_allclose(curve.low, [0.6, 0.6, 0.9])
    np.testing.assert_allclose(curve.middle, [0.8, 0.8, 0.9])
    np.testing.assert_allclose(curve.high, [0.8, 0.9, 0.9])


def test_between_densities_the_logarithm_counts_and_beyond_them_the_end():
    assert CURVE.at(2).middle == pytest.approx(0.7)
    assert CURVE.at(0.1) == CURVE.at(1) and CURVE.at(1000) == CURVE.at(16)


def test_density_for_a_score_is_the_inverse():
    for score in (0.6, 0.65, 0.8, 0.87, 0.9):
        assert CURVE.at(CURVE.density_for(score)).middle == pytest.approx(score)
    level = ScoreCurve.over({"a": {1: 0.5, 2: 0.8, 4: 0.8, 8: 0.9}})
    assert level.density_for(0.8) == pytest.approx(2)


@pytest.mark.usefixtures("curve")
def test_expectation_is_of_the_array_that_was_measured():
    spacing = Spacing(80, "volume", 20.0)
    for other in (PlanarArray(8, 8), PlanarArray(spacing=2.7), PlanarArray(spacing=0.3)):
        assert expectation(spacing, other, True).endswith("known of 4 × 4 elements half a wavelength apart alone")
        assert facts(spacing, other, True)["expected_ssim"] is None
    assert expectation(spacing, PlanarArray(), False).endswith("is known of datasets with responses alone")
    assert facts(spacing, PlanarArray(), False)["expected_ssim"] is None
    assert facts(spacing, PlanarArray(spacing=0.491), True)["expected_ssim"] == [0.7, 0.8, 0.85]
    assert facts(spacing, PlanarArray(), True)["expected_ssim"] == [0.7, 0.8, 0.85]


@pytest.mark.usefixtures("curve")
def test_needed_spectra_count_from_the_known_ones():
    """0.8 takes 4 positions per cubic wavelength, in 24 of them."""
    needed = spectra_needed.spectra_needed(0.8, BOX, NOTHING, 1.0, [PlanarArray()])
    assert needed.more == needed.spacing.known == pytest.approx(96, abs=3)
    assert needed.expected.middle == pytest.approx(0.8, abs=0.002)
    more = spectra_needed.spectra_needed(0.8, BOX, BOX[:40], 1.0, [PlanarArray()])
    assert more.more == needed.more - 40
    assert (
        f"{needed.more - 40} more spectra, {needed.more} in all, promise a median SSIM of about 0.80" in more.sentence()
    )
    assert spectra_needed.spectra_needed(0.8, BOX, NOTHING, 2.0, [PlanarArray()]).more == pytest.approx(12, abs=1)


@pytest.mark.usefixtures("curve")
@pytest.mark.parametrize(
    ("target", "region", "known", "array", "said"),
    [
        (0.95, BOX, NOTHING, PlanarArray(), "that the curve of measured rooms has, from 0.6 to 0.9, found 0.95"),
        (0.3, BOX, NOTHING, PlanarArray(), "from 0.6 to 0.9, found 0.3"),
        (0.7, BOX, BOX[:100], PlanarArray(), "a score above 0.80, which 100 known spectra promise already, found 0.7"),
        (0.8, BOX, NOTHING, PlanarArray(8, 8), "an array of 4 × 4 elements half .*, found 8 × 8"),
        (0.8, BOX, NOTHING, PlanarArray(spacing=2.7), "half a wavelength apart.*, found 4 × 4 .* 2.7"),
        (0.8, BOX, BOX[BOX[:, 0].argsort()] * [1, 0, 0], PlanarArray(), "that fill a region, .* found a path"),
        (0.8, BOX[:5], NOTHING, PlanarArray(), "ten positions or more that are half a wavelength apart, found fewer"),
    ],
)
def test_target_that_the_curve_cannot_tell_is_refused(target, region, known, array, said):
    with pytest.raises(ParameterError, match=f"target: expected .*{said}"):
        spectra_needed.spectra_needed(target, region, known, 1.0, [array])
