"""What holds for every model that is trained by steps."""

import numpy as np
import pytest
import torch

from learn.models.capabilities import PredictsResponses
from learn.models.model_settings import Steps
from learn.models.quadrature import quadrature
from learn.training.gradient_steps import Training
from learn.training.registry import MODELS, model_class
from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import normalise

POSITIONS = torch.tensor([[0.5, 0.0, 1.0], [3.0, -0.7, 2.2]])
FEW = quadrature(Beamformer())
SMALL = {
    "bisplat-aperture": {"primitives": 40, "width": 16},
    "nerf2": {"samples": 3, "width": 8},
    "swiftwrf": {"primitives": 20},
    "wrf-gs-plus": {"primitives": 40, "width": 16},
    "gsrf": {"primitives": 40},
}
NAMES = [name for name, entry in MODELS.items() if entry.by_steps and name != "bisplat-plus"]


@pytest.fixture(params=NAMES)
def name(request) -> str:
    return request.param


@pytest.fixture
def model(name, region, small):
    torch.manual_seed(0)
    options = small if name == "bisplat" else SMALL.get(name, {})
    return model_class(name)(region, Beamformer(), 0.33, **options)


def loss_of(model, truth):
    """The loss of a training step that looks at whole spectra."""
    pictures, unknown = (255 * truth).round().byte(), torch.zeros(len(truth), 0, 2)
    return Training(model, Steps(), FEW).loss(POSITIONS, pictures, unknown, coarse=False)


def test_pictures_are_finite_and_differ_by_position_and_the_loss_falls(model):
    truth = (0.5 + 0.4 * torch.cos(torch.deg2rad(torch.arange(360.0)))).expand(2, 90, 360)
    optimiser = torch.optim.Adam(model.parameters(), lr=1e-2)
    losses = []
    for _ in range(20):
        value = loss_of(model, truth)
        optimiser.zero_grad()
        value.backward()
        optimiser.step()
        losses.append(value.item())
    assert min(losses[-3:]) < losses[0]
    with torch.no_grad():
        pictures = model(POSITIONS)
    assert pictures.shape == (2, 90, 360) and pictures.isfinite().all()
    assert (pictures[0] - pictures[1]).abs().max() > 1e-6


def test_every_parameter_learns(model, name):
    if name == "gsrf":
        with torch.no_grad():
            model.scale_raw[:, 0] -= 1  # the turn of a round Gaussian changes nothing
    loss_of(model, torch.rand(2, 90, 360, generator=torch.Generator().manual_seed(0))).backward()
    for part, parameter in model.named_parameters():
        assert parameter.grad.isfinite().all() and parameter.grad.abs().max() > 0, part


def test_transmitters_of_a_batch_do_not_mix(model):
    with torch.no_grad():
        torch.testing.assert_close(model(POSITIONS), torch.cat([model(p[None]) for p in POSITIONS]), atol=1e-5, rtol=0)


@pytest.mark.parametrize("name", ["mlp-responses", "bisplat-aperture"])
@pytest.mark.parametrize(
    "beamformer", [Beamformer(), Beamformer(PlanarArray(rows=2, columns=3, spacing=0.4), AngularGrid(1.0))]
)
def test_predictions_are_the_spectra_of_the_predicted_responses(name, region, beamformer):
    model = model_class(name)(region, beamformer, 0.33, **SMALL.get(name, {}))
    with torch.no_grad():
        responses, pictures = torch.view_as_complex(model.responses(POSITIONS).contiguous()), model(POSITIONS)
    assert responses.shape == (2, beamformer.array.elements)
    np.testing.assert_allclose(pictures, normalise(beamformer.spectrum(responses.numpy())), atol=1e-5)


def test_predictions_at_a_few_pixels_are_those_at_all(model):
    with torch.no_grad():
        all_pixels, found = model(POSITIONS), model.coarse(POSITIONS, FEW)
    expected = all_pixels[:, FEW.rows][:, :, FEW.columns]
    if isinstance(model, PredictsResponses):  # its spectra are normalised over the pixels that are looked at
        low, high = expected.amin((1, 2), keepdim=True), expected.amax((1, 2), keepdim=True)
        expected = (expected - low) / (high - low)
    torch.testing.assert_close(found, expected, rtol=1e-4, atol=1e-5)
