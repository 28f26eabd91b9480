"""Mixtures that predictions add up piece by piece are those of the model."""

import numpy as np
import pytest
import torch

from learn.models.kriging import kriged_field
from learn.models.kriging.helmholtz import HelmholtzField
from learn.models.kriging.interpolators import SquaredExponentialField
from learn.models.kriging.kriged_field import KrigedField
from learn.training.prediction import predicted
from tests.plane_wave_field import BEAMFORMER, WAVELENGTH

BUILT = np.zeros((2, 3)), BEAMFORMER, WAVELENGTH
FLOAT, GREY = np.dtype(np.float32), np.dtype(np.uint8)


def known(field: KrigedField, count: int) -> KrigedField:
    """The field with random values at random positions."""
    generator = np.random.default_rng(count)
    field.places, field.times = torch.from_numpy(generator.uniform(0, 3, (count, 3))).float(), torch.arange(1.0 * count)
    numbers = (
        generator.standard_normal((count, 32)) if field.of_responses else generator.integers(0, 255, (count, 32400))
    )
    field.values = torch.from_numpy(numbers).to(torch.float32 if field.of_responses else torch.uint8)
    field.nugget = torch.tensor(0.01)
    return field


def model_of(weights: dict[str, float]) -> HelmholtzField:
    model = HelmholtzField(*BUILT)
    fields = {"responses": KrigedField(*BUILT, "responses"), "smooth-spectra": SquaredExponentialField(*BUILT)}
    model._set(weights, {way: known(field, 30) for way, field in fields.items() if way in weights})
    return model.eval()


MIXTURES = [
    {"responses": 1.0},
    {"responses": 0.75, "inverse-distance": 0.25},
    {"responses": 0.25, "smooth-spectra": 0.5, "inverse-distance": 0.25},
]


@pytest.mark.parametrize("weights", MIXTURES)
@pytest.mark.parametrize("kept", [2000, 0])
def test_predictions_are_those_of_the_model(weights, kept, monkeypatch):
    monkeypatch.setattr(kriged_field, "MOST_CACHED", kept)
    model, positions = model_of(weights), np.random.default_rng(0).uniform(0, 3, (19, 3))
    assert model.beamformed() is not None
    with torch.no_grad():
        spectra, responses = model.predict(torch.from_numpy(positions).float())
    (found, finite), (levels, _) = (predicted(model, positions, dtype) for dtype in (FLOAT, GREY))
    assert finite.all()
    np.testing.assert_allclose(found.spectra, spectra, atol=1e-4)
    np.testing.assert_allclose(found.responses, torch.view_as_complex(responses), atol=1e-4)
    assert np.abs(levels.spectra - 255 * found.spectra).max() < 0.5 + 1e-3


def test_positions_that_are_not_finite_are_named():
    positions = np.random.default_rng(0).uniform(0, 3, (4, 3))
    positions[2, 0] = np.inf
    for weights in MIXTURES[:2]:
        for dtype in (FLOAT, GREY):
            assert predicted(model_of(weights), positions, dtype)[1].tolist() == [True, True, False, True]


def test_other_known_spectra_are_noticed():
    model, positions = model_of(MIXTURES[1]), np.random.default_rng(0).uniform(0, 3, (4, 3))
    predicted(model, positions, FLOAT)
    model.load_state_dict({**model.state_dict(), "fields.responses.values": model.fields["responses"].values.flip(0)})
    with torch.no_grad():
        expected = model(torch.from_numpy(positions).float())
    np.testing.assert_allclose(predicted(model, positions, FLOAT)[0].spectra, expected, atol=1e-4)
