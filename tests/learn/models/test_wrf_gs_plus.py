"""WRF-GS+ against its equations, written once more Gaussian by Gaussian, and the projection of Gaussians in space."""

import math

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from learn.models.peers.wrf_gs_plus import WRFGSPlus
from learn.models.quadrature import composite_loss
from learn.models.splatting.splat import conic_of_axes, directions
from simulate.spectra.beamformer import Beamformer

POSITIONS = torch.tensor([[0.5, 0.0, 1.0], [3.0, -0.7, 2.2]])
AZIMUTH, ELEVATION = 100, 40  # The pixel that is computed by hand, degrees


@pytest.fixture
def make(region):
    def build(**settings) -> WRFGSPlus:
        torch.manual_seed(0)
        return WRFGSPlus(region, Beamformer(), 0.33, **{"primitives": 30, "width": 16, **settings})

    return build


def test_a_pixel_is_the_blend_of_its_gaussians_from_front_to_back(make):
    model = make()
    with torch.no_grad():
        model.opacity_raw += 0.1  # opaque enough that those in front hide those behind
        model.signal[:5] = -2.0  # clipped to 0
        model.place[7] = torch.tensor([0.05, 0.1, 0.05])  # too near to be seen
        for head in model.deformation.heads:
            head.weight *= 30
        found = model(POSITIONS)[:, ELEVATION, AZIMUTH].tolist()
        changes = model.deformation(model.place, POSITIONS - model.region.mean(dim=0))
    assert all(change.abs().max() > 0.3 for change in changes)
    for sample in range(2):
        turn, stretch, dynamic = (change[sample].double().numpy() for change in changes)
        assert found[sample] == pytest.approx(by_hand(model, turn, stretch, dynamic), rel=1e-4)
    assert found[0] != pytest.approx(found[1], rel=1e-3)


def by_hand(model, turn, stretch, dynamic) -> float:
    parameters = {name: each.detach().double().numpy() for name, each in model.named_parameters()}
    place = parameters["place"]
    total, passed = np.zeros(2), 1.0
    for i in np.argsort(np.linalg.norm(place, axis=1)):
        x, y, z = place[i]
        far = math.sqrt(x * x + y * y + z * z)
        if far <= 0.2:
            continue
        quaternion = 1.2 * parameters["quaternion"][i] + turn[i]
        rotation = Rotation.from_quat(quaternion, scalar_first=True).as_matrix()
        sizes = np.exp(6.2 * parameters["scale_raw"][i]) + stretch[i]
        covariance = rotation @ np.diag(sizes**2) @ rotation.T
        flat = seen(place[i])
        step = 1e-5
        slopes = [(seen(place[i] + step * axis) - seen(place[i] - step * axis)) / (2 * step) for axis in np.eye(3)]
        slope = np.stack(slopes, axis=1)
        on_plane = slope @ covariance @ slope.T + 0.3 * np.eye(2)
        away = np.array([(AZIMUTH - flat[0] + 180) % 360 - 180, ELEVATION - flat[1]])
        opacity = 1 / (1 + math.exp(-31 * parameters["opacity_raw"][i]))
        alpha = opacity * math.exp(-0.5 * away @ np.linalg.solve(on_plane, away))
        signal = (3.1 * parameters["signal"][i] + np.abs(dynamic[i])) / (2 * math.sqrt(math.pi)) + 0.5
        total += passed * alpha * signal.clip(0)
        passed *= 1 - alpha
    return float(np.linalg.norm(total.clip(0, 1)))


def seen(place):
    """Azimuth and elevation of the picture, which holds all latitudes, degrees."""
    x, y, z = place
    return np.degrees([math.atan2(y, x), (math.asin(z / np.linalg.norm(place)) + math.pi / 2) / 2])


def test_a_turn_of_all_gaussians_turns_the_picture_also_over_the_seam(make):
    model = make(primitives=60)
    with torch.no_grad():
        for head in model.deformation.heads:
            head.weight.zero_()
            head.bias.zero_()
        before = model(POSITIONS)
        x, y, z = model.place.clone().unbind(-1)
        model.place.copy_(torch.stack([-y, x, z], dim=-1))  # a quarter turn; the first Gaussians are round
        torch.testing.assert_close(model(POSITIONS), before.roll(90, dims=2), rtol=1e-3, atol=1e-4)
    assert (before[:, :, :1] - before[:, :, 180:181]).abs().max() > 0.01


def test_places_do_not_learn_through_the_network(make):
    model, given = make(), []
    model.deformation.register_forward_pre_hook(lambda _, inputs: given.extend(inputs))
    model(POSITIONS)
    assert not given[0].requires_grad


def test_its_loss_has_the_published_weights(make):
    model, truth = make(), torch.rand(2, 90, 360)
    with torch.no_grad():
        found = model.training_loss(POSITIONS, truth)
        predicted = model(POSITIONS)
        l1, both = (predicted - truth).abs().mean(), composite_loss(predicted, truth)
        dissimilarity = (both - 0.7 * l1) / 0.3
        torch.testing.assert_close(found, 0.8 * l1 + 0.2 * dissimilarity)


def test_fewer_gaussians_fill_the_same_space(make):
    sizes = [make(primitives=count).scale_raw.mul(6.2).exp().detach().median().item() for count in (400, 3200)]
    assert sizes[0] / sizes[1] == pytest.approx(2, rel=0.15)  # the cube root of 8


def test_directions_have_the_derivatives_of_angles():
    generator = np.random.default_rng(0)
    places = torch.from_numpy(generator.normal(size=(20, 3)))
    azimuth, latitude, change = directions(places)
    jacobian = torch.autograd.functional.jacobian(lambda p: torch.stack(directions(p)[:2]).sum(-1), places)
    torch.testing.assert_close(change, jacobian.transpose(0, 1))
    radius = places.norm(dim=-1)
    across, up = (radius * latitude.deg2rad().cos(), radius * latitude.deg2rad().sin())
    found = torch.stack([across * azimuth.deg2rad().cos(), across * azimuth.deg2rad().sin(), up], dim=-1)
    torch.testing.assert_close(found, places)
    assert all(each.isfinite().all() for each in directions(torch.tensor([[0.0, 0.0, 1.0], [0.0, 0.0, -2.0]])))


def test_conic_is_the_inverse_also_of_a_needle():
    """The two variances of the needle are 2·10¹⁰ and 0.3: a determinant by subtraction has no digit left."""
    axes = torch.tensor([[[1e5, 0.0, 0.0], [1e5, 0.0, 0.0]], [[3.0, 1.0, 0.5], [0.2, -4.0, 1.0]]])
    a, b, c = conic_of_axes(axes, 0.3)
    exact = axes.double()
    expected = torch.linalg.inv(exact @ exact.mT + 0.3 * torch.eye(2)).float()
    torch.testing.assert_close(torch.stack([a, b, b, c], -1).unflatten(-1, (2, 2)), expected, rtol=1e-4, atol=0)
