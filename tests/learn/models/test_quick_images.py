"""The compiled sum of mirror images' waves is that of ``image_waves``."""

import numpy as np
import pytest
import torch

from learn.models.images.image_field import ImageField
from learn.models.images.mirror_images import image_waves
from learn.models.images.quick_images import sum_of_waves
from tests.plane_wave_field import BEAMFORMER, WAVELENGTH


@pytest.mark.parametrize("images", [0, 1, 3, 50])
def test_sums_are_those_of_the_reference(images):
    generator = np.random.default_rng(images)
    positions, middles = generator.uniform(0, 4, (11, 3)), generator.uniform(-20, 20, (images, 3))
    signs, offsets = generator.choice([-1.0, 1.0], (images, 3)), generator.uniform(-0.3, 0.3, (16, 3))
    amplitudes = generator.standard_normal((images, 2))
    tensors = (torch.from_numpy(each) for each in (positions, middles, signs, offsets))
    waves = torch.complex(*image_waves(*tensors, torch.tensor(WAVELENGTH).double())).numpy()
    elements = middles[:, None] + signs[:, None] * offsets
    found = sum_of_waves(positions, elements, amplitudes, float(np.float32(WAVELENGTH)))
    np.testing.assert_allclose(found, waves @ (amplitudes @ [1, 1j]), atol=1e-8)


def test_a_position_at_an_element_has_the_largest_magnitude():
    at = np.zeros((1, 3))
    (waves,), _ = image_waves(*(torch.from_numpy(each) for each in (at, at, at, at)), torch.tensor(1.0).double())
    assert sum_of_waves(at, at[None], np.array([[1.0, 0]]), 1.0).item() == waves.item() > 2


@pytest.mark.parametrize("images", [0, 40])
def test_the_model_predicts_the_same_in_inference_mode_and_outside(images):
    model, generator = ImageField(np.zeros((2, 3)), BEAMFORMER, WAVELENGTH), np.random.default_rng(4)
    drawn = generator.uniform(0, 3, (50, 3)), generator.uniform(-9, 9, (images, 3)), generator.normal(size=(images, 2))
    model.rest.places, model.middles, model.amplitudes = (torch.from_numpy(each).float() for each in drawn)
    model.signs, model.power = torch.ones(images, 3), torch.tensor(0.5)
    model.rest.times, model.rest.nugget = torch.arange(50.0), torch.tensor(0.01)
    model.rest.values = torch.from_numpy(generator.standard_normal((50, 32))).float()
    model.offsets = torch.from_numpy(WAVELENGTH * BEAMFORMER.array.positions).float()
    positions = torch.from_numpy(generator.uniform(0, 3, (10, 3))).float()
    with torch.inference_mode():
        quick = model.responses(positions)
    assert quick.dtype == torch.float32 and quick.abs().max() > 0.01
    torch.testing.assert_close(quick, model.responses(positions), rtol=0, atol=3e-4)
    torch.testing.assert_close(quick.double(), model.double().responses(positions.double()), rtol=0, atol=1e-5)
