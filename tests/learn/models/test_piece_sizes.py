"""Predicting the first k positions gives the first k of many, for every k, also with weights that were loaded."""

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from learn.methods.interpolation import KrigingResponses
from learn.models.images.image_field import ImageField
from learn.models.kriging import stacking, vecchia
from learn.models.kriging.helmholtz import HelmholtzField
from learn.quantities.known import Known
from learn.quantities.spectra import Spectra
from learn.training.prediction import predict
from tests.plane_wave_field import BEAMFORMER, WAVELENGTH, dataset_of, plane_waves

MANY = 33
PLACES = np.random.default_rng(0).uniform(0, 0.6, (40, 3))
WAVES = plane_waves(PLACES, 40, seed=1)
NOISE = np.random.default_rng(2).standard_normal((*WAVES.shape, 2)) @ [1, 1j]
NOISY = WAVES + 0.5 * np.abs(WAVES).mean() * NOISE
"""So noisy that ``helmholtz`` mixes kriging of responses with other ways."""

Predict = Callable[[np.ndarray], np.ndarray]


def fitted(model: HelmholtzField | ImageField, responses: np.ndarray, keep_responses: bool = True) -> Predict:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(vecchia, "ITERATIONS", 3)
        patch.setattr(stacking, "FOLDS", 1)
        patch.setattr(stacking, "CLEAR_LEAD", 1.0)  # all ways are tried
        patch.setattr("learn.models.kriging.retrieved_field.LEAST_RETRIEVED", 1000)
        model.fit(dataset_of(PLACES, responses, keep_responses), np.arange(len(PLACES)))
    model.eval()
    if keep_responses and isinstance(model, HelmholtzField):
        assert len(model._used) > 1
    loaded = type(model)(np.zeros((2, 3)), BEAMFORMER, WAVELENGTH)
    loaded.load_state_dict(model.state_dict())
    some = PLACES[:2] + 0.1
    np.testing.assert_allclose(predict(loaded.eval(), some).spectra, predict(model, some).spectra, atol=1e-5)
    return lambda positions: predict(loaded, positions).spectra


@cache
def method(name: str) -> Predict:
    region = np.array([[0.0, 0, 0], [0.6, 0.6, 0.6]])
    if name == "kriging-responses":
        kriging = KrigingResponses()
        kriging.fit(Known.of(dataset_of(PLACES, WAVES), Spectra(), np.arange(len(PLACES))))
        return lambda positions: kriging.predict(positions).value
    if name == "mirror-images":
        return fitted(ImageField(region, BEAMFORMER, WAVELENGTH), WAVES)
    of_pictures = name == "helmholtz of pictures"
    return fitted(HelmholtzField(region, BEAMFORMER, WAVELENGTH), NOISY, keep_responses=not of_pictures)


@pytest.mark.parametrize("name", ["helmholtz", "helmholtz of pictures", "mirror-images", "kriging-responses"])
def test_the_first_positions_are_predicted_as_among_many(name):
    positions = np.random.default_rng(3).uniform(0, 0.6, (MANY, 3))
    all_of_them = method(name)(positions)
    for count in range(1, MANY + 1):
        found = method(name)(positions[:count])
        assert found.shape == (count, 90, 360)
        np.testing.assert_allclose(found, all_of_them[:count], atol=1e-5)
