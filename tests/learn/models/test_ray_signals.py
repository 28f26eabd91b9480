"""NeRF² for one element: rays around a receiver, against sums that are known in closed form."""

import cmath
import math

import numpy as np
import torch

from learn.models.peers.nerf2 import RaySignals, RaySize, octaves, ray_directions

WAVELENGTH, FAR = 0.3, 5.0
RECEIVERS = np.array([[0.0, 0, 0], [2.0, 1, 0]])


def uniform(size: RaySize, attenuation: list[float], signal: list[float], frequencies: int = 1) -> RaySignals:
    """Networks that give the same outputs everywhere."""
    made = RaySignals(RECEIVERS, 3, FAR, 1.0, WAVELENGTH, size, frequencies)
    with torch.no_grad():
        for layer, outputs in ((made.field.attenuation, attenuation), (made.field.signal[-1], signal)):
            layer.weight.zero_()
            layer.bias.copy_(torch.tensor(outputs))
    return made


def test_one_path_of_one_ray_is_a_geometric_series():
    """All voxels alike: Σ s e^{jφ} q^n over n = 1 … N, with q = e^{−δΔ + j(ψ + 2πΔ/λ)}."""
    made = uniform(RaySize(1, 1, 6, width=8, layers=4), [-0.3, 0.4], [0.7, -1.0])
    with torch.no_grad():
        found = torch.view_as_complex(made(torch.zeros(3, 1, 3)).double())
    step = FAR / 5
    psi, phi = math.tau / (1 + math.exp(-0.4)) - math.pi, math.tau / (1 + math.exp(1.0))
    q = cmath.exp(-0.3 * step + 1j * (psi + math.tau * step / WAVELENGTH))
    expected = 0.7 * cmath.exp(1j * phi) * q * (1 - q**6) / (1 - q)
    assert found.shape == (3, 2, 1)
    np.testing.assert_allclose(found.numpy(), expected, rtol=1e-4)


def test_rays_add_up_and_each_subcarrier_has_its_own_outputs():
    attenuation, signal = [0.3, 0.0, 0.4, -0.2], [0.7, 0.1, -1.0, 2.0]
    one = uniform(RaySize(1, 1, 4, width=8, layers=4), attenuation, signal, frequencies=2)
    many = uniform(RaySize(5, 3, 4, width=8, layers=4), attenuation, signal, frequencies=2)
    alone = uniform(RaySize(1, 1, 4, width=8, layers=4), attenuation[1::2], signal[1::2])
    known = torch.zeros(1, 1, 3)
    with torch.no_grad():
        torch.testing.assert_close(many(known), 15 * one(known), rtol=1e-4, atol=1e-5)
        torch.testing.assert_close(one(known)[:, :, 1:], alone(known))


def test_receivers_differ_and_so_does_what_each_is_told():
    torch.manual_seed(0)
    made = RaySignals(RECEIVERS, 3, FAR, 1.0, WAVELENGTH, RaySize(4, 2, 3, width=8, layers=4))
    with torch.no_grad():
        found = made(torch.randn(2, 2, 3))
        assert torch.unique(found.flatten()).numel() == 8
        alike = made(torch.ones(2, 1, 3))
    torch.testing.assert_close(alike[0], alike[1])


def test_directions_are_those_of_the_published_program():
    """Azimuths from 0° and elevations from 10° to 90°, in steps of 10°."""
    found = ray_directions(36, 9)
    elevation, azimuth = np.radians(20), np.radians(50)
    expected = [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    np.testing.assert_allclose(found[36 + 5], expected, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1)
    np.testing.assert_allclose(found[-36:], np.array([[0, 0, 1]] * 36), atol=1e-12)


def test_octaves_have_no_pi():
    at = torch.tensor([[0.1, 0.2, -0.3]])
    encoded = octaves(at)
    assert encoded.shape == (1, 63)
    torch.testing.assert_close(encoded[:, 3 + 3 * 4 : 3 + 3 * 5], (2**4 * at).sin())
