"""A receiver's imperfections: their statistics, their independence of how a dataset is cut, and absolute power."""

import math

import numpy as np
import pytest
from scipy.stats import kstest

from scenes.files.errors import ParameterError
from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import LEAST_POWER_DB, Beamformer
from simulate.spectra.measurement import Measurement

EFFECTS = {"snr_db": 12, "gain_error_db": 1.5, "phase_error_deg": 20, "phase_noise_deg": 8}
ALL = Measurement(**EFFECTS)
PLAUSIBLE = 0.01
"""Least p-value that passes for chance; the seeds are fixed, so it never fails by bad luck."""


def responses(count: int, elements: int = 16) -> np.ndarray:
    """Spectra whose levels are up to 80 dB apart, elements of one spectrum up to some 20 dB."""
    generator = np.random.default_rng(8)
    return generator.normal(size=(count, elements, 2)) @ [1, 1j] * 10 ** generator.uniform(-5, -1, (count, 1))


def ones(count: int, elements: int = 16) -> np.ndarray:
    return np.ones((count, elements), complex)


@pytest.mark.parametrize("snr", [-7.0, 0.0, 25.0])
def test_noise_is_as_far_below_each_spectrum_as_asked(snr):
    """10 log10 of mean |y|² over mean |n|²: over all spectra and over the weakest tenth of them."""
    y = responses(3000)
    noise = Measurement(snr_db=snr).apply(y, np.arange(3000), 0) - y
    level = (np.abs(y) ** 2).mean(axis=1)
    ratio = (np.abs(noise) ** 2).mean(axis=1) / level
    weakest = np.argsort(level)[:300]
    assert -10 * math.log10(ratio.mean()) == pytest.approx(snr, abs=0.1)
    assert -10 * math.log10(ratio[weakest].mean()) == pytest.approx(snr, abs=0.2)


def test_noise_is_circular_gaussian_and_independent_from_element_to_element_and_spectrum_to_spectrum():
    noise = Measurement(snr_db=0).apply(ones(3000), np.arange(3000), 0) - 1
    for part in (noise.real, noise.imag):
        assert kstest(part.ravel() * math.sqrt(2), "norm").pvalue > PLAUSIBLE
    covariance = noise.T @ noise.conj() / 3000
    assert covariance == pytest.approx(np.eye(16), abs=0.1)  # 5 standard deviations of an entry
    assert noise.T @ noise / 3000 == pytest.approx(np.zeros((16, 16)), abs=0.1)
    assert abs((noise[1:] * noise[:-1].conj()).mean()) < 0.02


def test_noise_is_independent_from_subcarrier_to_subcarrier_and_as_strong_at_each():
    """The signal's power is its mean over elements and subcarriers: here 2.5."""
    y = np.ones((4000, 3, 4), complex) * np.array([1, 1, 2, 2])
    noise = (Measurement(snr_db=10).apply(y, np.arange(4000), 0) - y).reshape(4000, -1)
    assert noise.T @ noise.conj() / 4000 == pytest.approx(0.25 * np.eye(12), abs=0.02)  # 5 standard deviations
    assert noise.T @ noise / 4000 == pytest.approx(np.zeros((12, 12)), abs=0.02)


def test_gains_spread_normally_in_db_and_leave_the_phase():
    measured = Measurement(gain_error_db=1.5).apply(ones(1, 20_000), np.arange(1), 1)[0]
    assert kstest(20 * np.log10(np.abs(measured)) / 1.5, "norm").pvalue > PLAUSIBLE
    assert np.abs(np.angle(measured)).max() == 0


@pytest.mark.parametrize("effect", ["phase_error_deg", "phase_noise_deg"])
def test_phases_spread_normally_in_degrees_and_leave_the_magnitude(effect):
    measured = Measurement(**{effect: 20.0}).apply(ones(1, 20_000), np.arange(1), 1)[0]
    assert kstest(np.degrees(np.angle(measured)) / 20, "norm").pvalue > PLAUSIBLE
    assert np.abs(measured) == pytest.approx(np.ones(20_000))


def test_errors_of_gain_and_phase_are_the_array_s_own():
    """y'/y is the same in every spectrum, another one for every element, and another array for another seed."""
    y = responses(50)
    error = Measurement(gain_error_db=1, phase_error_deg=10).apply(y, np.arange(50), 4) / y
    assert error == pytest.approx(np.tile(error[0], (50, 1)))
    assert len(set(error[0].round(6))) == 16
    other = Measurement(gain_error_db=1, phase_error_deg=10).apply(y, np.arange(50), 5) / y
    assert np.abs(other[0] - error[0]).min() > 1e-3


def test_phase_noise_is_new_for_every_element_and_every_spectrum():
    phase = np.angle(Measurement(phase_noise_deg=10).apply(ones(3000), np.arange(3000), 0))
    assert np.corrcoef(phase.T) == pytest.approx(np.eye(16), abs=0.1)
    assert abs(np.corrcoef(phase[1:].ravel(), phase[:-1].ravel())[0, 1]) < 0.02
    assert phase.mean(axis=0) == pytest.approx(np.zeros(16), abs=math.radians(1))


def test_expected_peak_of_a_plane_wave():
    """E S² = 1 + (MN − 1) e^{-σ²} + 10^{-SNR/10} at the wave's own direction, σ in radians, |y_m| = 1."""
    array = PlanarArray()
    y = array.manifold(np.radians(200.0), np.radians(40.0))
    measured = Measurement(snr_db=3, phase_noise_deg=40).apply(np.tile(y, (4000, 1)), np.arange(4000), 0)
    power = np.abs(measured @ y.conj()) ** 2 / 16
    expected = 1 + 15 * math.exp(-(math.radians(40) ** 2)) + 10**-0.3
    assert power.mean() == pytest.approx(expected, rel=0.02)


def test_what_a_spectrum_gets_depends_on_its_number_alone():
    """Alone, in a batch, backwards: the same bits."""
    y, numbers = responses(40).astype(np.complex64), np.arange(100, 140)
    whole = ALL.apply(y, numbers, 5)
    assert (ALL.apply(y[::-1], numbers[::-1], 5)[::-1] == whole).all()
    assert all((ALL.apply(y[i : i + 1], numbers[i : i + 1], 5)[0] == whole[i]).all() for i in range(40))
    assert (ALL.apply(y, numbers + 1, 5) != whole).all()


def test_draws_of_one_effect_do_not_depend_on_the_others():
    """y' of all effects is the product of the three errors, each by itself, plus the noise by itself."""
    y, numbers = ones(20), np.arange(20)
    alone = {name: Measurement(**{name: value}).apply(y, numbers, 5) for name, value in EFFECTS.items()}
    errors = alone["gain_error_db"] * alone["phase_error_deg"] * alone["phase_noise_deg"]
    assert ALL.apply(y, numbers, 5) == pytest.approx(errors + alone["snr_db"] - 1)


def test_ideal_receiver_changes_no_bit():
    y = responses(4).astype(np.complex64)
    before = y.tobytes()
    assert Measurement().off
    assert Measurement().apply(y, np.arange(4), 9).tobytes() == before
    assert [Measurement(**{name: value}).off for name, value in EFFECTS.items()] == [False] * 4
    assert not ALL.apply(np.zeros((1, 16), np.complex64), np.arange(1), 5).any()
    assert ALL.apply(np.zeros((0, 16), np.complex64), np.arange(0), 5).shape == (0, 16)


@pytest.mark.parametrize(
    ("parameter", "wrong"),
    [("snr_db", math.nan), ("gain_error_db", -0.1), ("phase_error_deg", -1), ("phase_noise_deg", math.nan)],
)
def test_impossible_receiver_is_refused(parameter, wrong):
    with pytest.raises(ParameterError, match=f"^{parameter}: expected .*, found {wrong}$"):
        Measurement(**{parameter: wrong})


def test_power_in_free_space_is_friis_plus_array_gain():
    """A tag at boresight, 1000 λ away: each element gets (1/4π·1000)², −81.98 dB; sixteen in phase 12.04 dB more."""
    array = PlanarArray()
    distance = np.linalg.norm([0, 0, 1000] - array.positions, axis=1)
    y = np.exp(-2j * np.pi * distance) / (4 * np.pi * distance)
    power = Beamformer(array, AngularGrid(1.0)).power_db(y)
    assert power.shape == (90, 360)
    assert power[89] == pytest.approx(np.full(360, -69.94), abs=0.005)
    assert power.max() == pytest.approx(-69.94, abs=0.005)
    # Steered to φ = 0, θ: four columns in steps of π cosθ. cosθ = cos 41° = 0.7547: their mean is
    # sin(2π·0.7547) / (4 sin(π·0.7547/2)) = −0.2696, −11.38 dB, near the top of the first side lobe.
    assert power[40, 0] == pytest.approx(-69.94 - 11.38, abs=0.01)


def test_power_has_a_floor():
    """A wave from boresight has a null at φ = 0, θ = 60°, and nothing received is no −∞."""
    beamformer = Beamformer()
    assert LEAST_POWER_DB == -200
    assert beamformer.power_db(1e-4 * np.ones(16))[60, 0] == pytest.approx(-200, abs=1e-9)
    assert beamformer.power_db(np.zeros((2, 16))) == pytest.approx(np.full((2, 90, 360), -200.0), abs=1e-9)
