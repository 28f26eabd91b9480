"""Predictions are the spectra of the predicted responses, in single precision or as grey levels, in any batches."""

import numpy as np
import pytest
import torch

from learn.models.base import SpectrumModel
from learn.models.networks.aperture import BiSplatAperture
from learn.models.networks.mlp import ResponseMLP, SpectrumMLP
from learn.training.prediction import RESPONSES_AT_ONCE, predicted
from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.element_array import ElementArray
from simulate.spectra.spectrum import normalise

REGION = np.array([[0.0, -1.0, 0.5], [4.0, 1.0, 2.5]])
FLOAT, GREY = np.dtype(np.float32), np.dtype(np.uint8)
RECEIVERS = {
    "square": (Beamformer(), 0.33),
    "upside down": (Beamformer(PlanarArray(3, 2, 0.9), AngularGrid(89.0, -1.0)), 0.125),
    "circle": (Beamformer(ElementArray.circle(7, 0.08).at(2.4e9)), 0.125),
    "half a circle": (Beamformer(grid=AngularGrid(azimuth_step_deg=0.5)), 0.33),
}


def places(count):
    return np.random.default_rng(count).uniform(*REGION, (count, 3))


def model_of(kind, receiver="square"):
    torch.manual_seed(0)
    return kind(REGION, *RECEIVERS[receiver]).eval()


@pytest.mark.parametrize("receiver", RECEIVERS)
@pytest.mark.parametrize("one_field", [False, True])
def test_spectra_are_those_of_the_beamformer(receiver, one_field):
    model = model_of(ResponseMLP, receiver)
    if one_field:
        model.sample_one_field(torch.eye(3))
    prediction, finite = predicted(model, places(5), FLOAT)
    expected = normalise(RECEIVERS[receiver][0].spectrum(prediction.responses.astype(complex)))
    assert finite.all() and prediction.spectra.dtype == np.float32
    np.testing.assert_allclose(prediction.spectra, expected, atol=1e-5)


@pytest.mark.parametrize("kind", [ResponseMLP, BiSplatAperture, SpectrumMLP])
@pytest.mark.parametrize("receiver", ["square", "half a circle"])
def test_grey_levels_are_the_rounded_numbers(kind, receiver):
    model = model_of(kind, receiver)
    numbers, levels = (predicted(model, places(18), dtype)[0].spectra for dtype in (FLOAT, GREY))
    assert levels.dtype == np.uint8
    assert np.abs(levels - 255 * numbers).max() < 0.5 + 1e-3


def test_batches_do_not_change_predictions():
    model = model_of(ResponseMLP)
    points = places(RESPONSES_AT_ONCE // 16 + 3)
    together, _ = predicted(model, points, FLOAT)
    assert len(together.spectra) == len(together.responses) == len(points)
    for some in (slice(0, 1), slice(-5, None)):
        alone, _ = predicted(model, points[some], FLOAT)
        np.testing.assert_allclose(together.spectra[some], alone.spectra, atol=1e-4)
        np.testing.assert_allclose(together.responses[some], alone.responses, atol=1e-5)


def test_a_class_with_its_own_prediction_is_asked_for_it():
    class Dimmed(ResponseMLP):
        def predict(self, positions):
            spectra, responses = super().predict(positions)
            return spectra / 2, responses

    prediction, _ = predicted(model_of(Dimmed), places(3), FLOAT)
    np.testing.assert_allclose(prediction.spectra.max(axis=(1, 2)), 0.5, atol=1e-6)


class Levels(SpectrumModel):
    """Predicts the first coordinate everywhere."""

    def __init__(self, region, beamformer, wavelength):
        super().__init__(region, wavelength)

    def forward(self, positions):
        return positions[:, :1, None].expand(-1, 90, 360)


def test_other_numbers_become_0_or_1_and_black_or_white():
    points = np.array([[-0.5, 0, 0], [0.25, 0, 0], [1.5, 0, 0]])
    levels = predicted(model_of(Levels), points, GREY)[0].spectra
    assert levels[:, 0, 0].tolist() == [0, 64, 255]
    assert predicted(model_of(Levels), points, FLOAT)[0].spectra[:, 0, 0].tolist() == [0, 0.25, 1]


def test_spectra_that_are_not_finite_are_named():
    values = [0.5, np.nan, np.inf, 3e38]  # the sum over the pixels of the last one is not finite
    found, finite = predicted(model_of(Levels), np.array([[value, 0, 0] for value in values]), FLOAT)
    assert finite.tolist() == [True, False, False, True]
    np.testing.assert_array_equal(found.spectra[:, 0, 0], [0.5, np.nan, np.inf, 1])
    model = model_of(ResponseMLP)
    with torch.no_grad():
        model.network.outward.bias[3] = np.nan
    for dtype in (FLOAT, GREY):
        assert not predicted(model, places(2), dtype)[1].any()
