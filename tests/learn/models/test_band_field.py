"""Kriging of responses over a band: exact waves, the algebra, the stated deviation, and its state."""

import copy

import numpy as np
import pytest
import torch

from learn.models.kriging.band_field import BandField
from learn.models.kriging.delay_powers import white_noise
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer

WAVELENGTH, CARRIER, SUBCARRIERS, SPACING = 299_792_458 / 1e9, 1e9, 12, 2e6
FREQUENCIES = CARRIER + SPACING * (np.arange(SUBCARRIERS) - SUBCARRIERS // 2)


@pytest.fixture(autouse=True, scope="module")
def quick():
    """A short search, which is enough for so few positions."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("learn.models.kriging.vecchia.FITTED_ON", 40)
        patch.setattr("learn.models.kriging.vecchia.ITERATIONS", 25)
        patch.setattr("learn.models.kriging.deviation_curve.FOLDED", 72)
        yield


def places(count: int, seed: int = 0, size: float = 0.5) -> np.ndarray:
    return np.random.default_rng(seed).uniform(0, size, (count, 3))


def two_waves(positions: np.ndarray, frequencies: np.ndarray = FREQUENCIES) -> np.ndarray:
    """Responses [K, 2, subcarriers] of two plane waves of delays 20 and 70 ns at the origin."""
    directions, delays = np.array([[1, 0, 0], [0, 0.6, 0.8]]), np.array([20e-9, 70e-9])
    late = delays - positions @ directions.T / 299_792_458
    waves = np.exp(-2j * np.pi * frequencies * late[..., None])
    return np.einsum("aw,kws->kas", np.array([[1, 0.5], [0.8j, -0.7]]), waves)


def fitted(positions: np.ndarray, responses: np.ndarray) -> BandField:
    field = BandField(np.stack([positions.min(0), positions.max(0)]), Beamformer(PlanarArray(1, 2)), WAVELENGTH)
    field.fit_to(positions, responses, np.arange(len(positions), dtype=float))
    return field


def many_waves(positions: np.ndarray) -> np.ndarray:
    """Responses [K, 2, subcarriers] of 40 plane waves from all sides, with delays up to 100 ns."""
    generator = np.random.default_rng(0)
    directions = generator.standard_normal((40, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    gains, delays = generator.standard_normal((2, 40, 2)) @ [1, 1j], generator.uniform(0, 1e-7, 40)
    late = delays - positions @ directions.T / 299_792_458
    return np.einsum("aw,kws->kas", gains, np.exp(-2j * np.pi * FREQUENCIES * late[..., None]))


def held(field: BandField, positions: np.ndarray) -> float:
    """Share of the responses of many waves within the stated 90 % intervals."""
    predicted, deviation = field.at(positions)
    error = predicted - many_waves(positions)
    return float(np.mean(np.abs([error.real, error.imag]) <= 1.645 * deviation[:, None, None]))


def snr(predicted: np.ndarray, truth: np.ndarray) -> float:
    return float(10 * np.log10((np.abs(truth) ** 2).sum() / (np.abs(predicted - truth) ** 2).sum()))


@pytest.fixture(scope="module")
def field(quick) -> BandField:
    known = places(80)
    return fitted(known, two_waves(known))


def test_two_plane_waves_of_known_delays_are_predicted(field):
    new = places(50, seed=1, size=0.4) + 0.05
    assert snr(field.at(new)[0], two_waves(new)) > 35


def test_of_many_subcarriers_every_third_tells_the_delays_of_all():
    frequencies = CARRIER + SPACING / 10 * (np.arange(150) - 75)
    known, new = places(60), places(20, seed=1)
    assert snr(fitted(known, two_waves(known, frequencies)).at(new)[0], two_waves(new, frequencies)) > 20


def test_all_components_together_are_the_dense_solution(field):
    """Kriging of all known responses at all subcarriers at once, with the covariance K ⊗ R + ν I ⊗ R + σ² I."""
    known = places(9, seed=2)
    generator = np.random.default_rng(0)
    responses = two_waves(known) + 0.1 * generator.standard_normal((9, 2, SUBCARRIERS, 2)) @ [1, 1j]
    small = fitted(known, responses)
    small.drift = torch.tensor(1e9)
    new = places(1, seed=3)
    ratio = np.exp(-np.linalg.norm(known - known[:, None], axis=-1) / float(small.length))
    phases = np.exp(2j * np.pi / WAVELENGTH * known @ small.directions.numpy().T)
    k = (phases * small.shares.numpy()) @ phases.conj().T * ratio
    to_new = np.exp(2j * np.pi / WAVELENGTH * new @ small.directions.numpy().T)
    cross = (
        (phases * small.shares.numpy())
        @ to_new.conj().T
        * np.exp(-np.linalg.norm(known - new, axis=1) / float(small.length))[:, None]
    )
    components, powers = torch.view_as_complex(small.components).numpy(), small.powers.numpy()
    r = (components * powers) @ components.conj().T
    nugget = float((small.noises - small.noise / small.powers).mean())
    dense = np.kron(k + nugget * np.eye(9), r) + small.noise * np.eye(9 * SUBCARRIERS)
    values = responses.transpose(0, 2, 1).reshape(-1, 2)
    expected = (np.kron(cross.conj().T, r) @ np.linalg.solve(dense, values)).T
    np.testing.assert_allclose(small.at(new)[0][0], expected, atol=2e-3)


def test_noise_between_subcarriers_is_told_from_paths():
    known = places(60, seed=4)
    noise = 0.1 * np.random.default_rng(1).standard_normal((60, 2, SUBCARRIERS, 2)) @ [1, 1j]
    responses = two_waves(known) + noise
    assert white_noise(responses) == pytest.approx(0.02, rel=0.15)
    assert white_noise(two_waves(known)) < 1e-6
    alone = fitted(known, responses)
    assert snr(alone.at(known)[0], two_waves(known)) > snr(responses, two_waves(known)) + 3


def learned(known: np.ndarray) -> BandField:
    field = fitted(known, many_waves(known))
    field.learn_deviations(many_waves(known))
    return field


@pytest.mark.parametrize(("known", "new", "size", "least"), [(100, 150, 0.6, 0.8), (24, 100, 0.9, 0.83)])
def test_stated_deviations_hold(known, new, size, least):
    """Of a field with many waves, whose positions are too far apart for an exact prediction; also of few of them."""
    assert least < held(learned(places(known, seed=1, size=size)), places(new, seed=2, size=size)) < 0.97


def test_stated_deviations_hold_between_clusters_of_known_positions():
    """Positions that are left out one by one have near neighbours, other than the new ones."""
    centres = np.repeat(places(12, seed=1, size=1.0), 10, axis=0)
    field = learned(centres + places(120, seed=2, size=0.1))
    assert 0.83 < held(field, places(100, seed=3, size=1.0)) < 0.97
    _, deviation = field.at(np.array([centres[0] + 0.05, [99, 99, 99]]))
    assert deviation[1] > 2 * deviation[0]


def test_what_is_nearer_than_a_radius_is_left_out(field):
    known = field.places.numpy()
    beyond = np.linalg.norm(known - known[3], axis=1) >= 0.2
    others = copy.deepcopy(field)
    others.times, others.values, others.places = (each[beyond] for each in (field.times, field.values, field.places))
    found, variance = field.with_variance(known[3:4], np.array([3]), 0.2)
    expected, alone = others.with_variance(known[3:4], None)
    np.testing.assert_allclose(found, expected, atol=1e-3 * np.abs(expected).max())
    np.testing.assert_allclose(variance, alone, rtol=1e-2)


def test_a_stored_field_predicts_the_same(field):
    other = BandField(np.zeros((2, 3)), Beamformer(PlanarArray(1, 2)), 1.0)
    other.load_state_dict(field.state_dict())
    new = places(5, seed=6)
    np.testing.assert_array_equal(other.at(new)[0], field.at(new)[0])
    np.testing.assert_array_equal(other.at(new)[1], field.at(new)[1])
    for wrong in ({"components": torch.zeros(0)}, {"noises": -field.noises}, {"variances": torch.tensor([1.0, 0.0])}):
        with pytest.raises(RuntimeError):
            other.load_state_dict({**field.state_dict(), **wrong})
