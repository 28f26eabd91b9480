"""The spectrum of responses, which their scale and common phase do not change."""

import numpy as np
import torch

from learn.models.base import BeamformingLayer
from simulate.spectra.beamformer import Beamformer

RESPONSES = torch.from_numpy(np.random.default_rng(0).normal(size=(3, 16, 2))).float()


def test_scale_has_no_effect_down_to_the_weakest_links():
    layer = BeamformingLayer(Beamformer())
    for scale in (1e-12, 1e-6, 1e6):
        torch.testing.assert_close(layer(scale * RESPONSES), layer(RESPONSES), atol=1e-5, rtol=0)


def test_no_response_is_a_black_spectrum_with_a_finite_gradient():
    responses = torch.zeros(1, 16, 2, requires_grad=True)
    spectrum = BeamformingLayer(Beamformer())(responses)
    spectrum.sum().backward()
    assert not spectrum.any() and torch.isfinite(responses.grad).all()


def test_gradient_is_that_of_finite_differences():
    responses = RESPONSES.double().requires_grad_()
    layer = BeamformingLayer(Beamformer()).double()
    largest = int(
        responses.detach()[0].abs().argmax()
    )  # the number that the others are divided by is among those tested
    layer(responses)[0, 40, 100].backward()
    for number in (largest, 3):
        change = torch.zeros_like(responses)
        change[0].view(-1)[number] = 1e-6
        with torch.no_grad():
            higher, lower = (layer(responses + sign * change)[0, 40, 100] for sign in (1, -1))
        np.testing.assert_allclose(responses.grad[0].view(-1)[number], (higher - lower) / 2e-6, rtol=1e-5)
