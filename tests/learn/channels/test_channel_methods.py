"""Methods that predict the downlink: what they give exactly, and what they learn."""

import numpy as np
import pytest

from learn.channels.channel_methods import Copy, Nearest, Ramp
from learn.channels.known_channels import strongest_ramp, without_ramp
from learn.channels.linear_channels import Delays, HelmholtzChannels, fit_profile, regression
from learn.quantities.complex_scores import snr_db
from tests.folders import paths
from tests.learn.taught import taught_links

S = 26


def random(*shape: int, seed: int = 0) -> np.ndarray:
    parts = np.random.default_rng(seed).normal(size=(2, *shape))
    return parts[0] + 1j * parts[1]


def rooms(rows: int = 60, noise: float = 0.0, seed: int = 0) -> np.ndarray:
    """Rows of three paths near 0.02, 0.05 and 0.08 cycles per subcarrier."""
    generator = np.random.default_rng(seed)
    delays = np.array([0.02, 0.05, 0.08]) + generator.normal(0, 0.002, (rows, 3))
    channels = paths(
        delays, random(rows, 3, seed=seed) * [1, 0.5, 0.3], directions=generator.uniform(0, 0.5, (rows, 3))
    )
    return channels + noise * random(*channels.shape, seed=seed + 1)


def median_snr(method, channels: np.ndarray, truth: np.ndarray | None = None, known: int = 40) -> float:
    """Of the rows that are not known."""
    truth = channels if truth is None else truth
    method.fit(taught_links(channels[:known, :, :S], channels[:known, :, S:]))
    return float(np.median(snr_db(method.predict(None, channels[known:, :, :S]).value, truth[known:, :, S:])))


def test_the_ramp_of_one_path_is_exact():
    delays = np.random.default_rng(0).uniform(-0.5, 0.5, (30, 1))
    channels = paths(delays, random(30, 1), directions=delays[::-1])
    assert median_snr(Ramp(), channels, known=5) > 150
    steps = strongest_ramp(channels)
    np.testing.assert_allclose(np.exp(1j * steps), np.exp(-2j * np.pi * delays[:, 0]), atol=1e-9)
    np.testing.assert_allclose(without_ramp(channels, steps), channels[..., :1] * np.ones(52), atol=1e-7)


def test_the_ramp_of_an_antenna_is_its_own():
    channels = paths(np.array([[0.1], [0.2]]), np.ones((2, 1)), antennas=1)
    both = channels.transpose(1, 0, 2)  # one row, two antennas
    assert snr_db(Ramp().predict(None, both[..., :S]).value, both[..., S:])[0] > 150


def test_nearest_takes_the_row_that_is_alike_with_its_factor():
    channels = random(6, 3, 2 * S)
    method = Nearest()
    method.fit(taught_links(channels[..., :S], channels[..., S:]))
    factor = np.array([2j, -0.1])[:, None, None]
    given = factor * channels[[4, 1]]
    np.testing.assert_allclose(method.predict(None, given[..., :S]).value, given[..., S:])


@pytest.mark.parametrize("method", [Delays, HelmholtzChannels])
def test_delays_that_known_rows_share_continue_the_uplink(method):
    delays = np.array([[3, 11]]) / (8 * 52) * np.ones((30, 1))  # two paths of the profile's own delays
    channels = paths(delays, random(30, 2), directions=np.random.default_rng(1).uniform(0, 1, (30, 2)))
    assert median_snr(method(), channels, known=20) > 40
    assert median_snr(Ramp(), channels, known=20) < 25


def test_delays_of_each_row_are_found_in_its_uplink():
    channels = rooms()
    assert median_snr(Copy(), channels) < 3
    assert median_snr(Delays(), channels) > median_snr(Ramp(), channels) + 15


def test_one_delay_profile_has_its_power_and_noise():
    channels = paths(np.full((500, 1), 10 / (8 * 12)), random(500, 1), 12, antennas=1)
    covariance, _ = fit_profile(channels + 0.3 * random(500, 1, 12, seed=3))
    expected = 2 * np.exp(-2j * np.pi * 10 / 96 * np.subtract.outer(np.arange(12), np.arange(12))) + 0.18 * np.eye(12)
    np.testing.assert_allclose(covariance, expected, atol=0.15)


def test_rows_that_start_at_different_times_are_aligned():
    generator = np.random.default_rng(5)
    gains = random(60, 3) * [0, 0.3, 0.2] + [1, 0, 0]  # the first path is the strongest
    delays = np.array([0.02, 0.05, 0.08]) + generator.normal(0, 0.002, (60, 3))
    still = paths(delays, gains, directions=generator.uniform(0, 0.5, (60, 3))) + 0.03 * random(60, 4, 52, seed=1)
    moved = without_ramp(still, generator.uniform(-2.5, 2.5, 60))
    method = Delays()
    found = median_snr(method, moved)
    assert method.aligned and found > median_snr(Delays(), still) - 5
    unaligned, _ = fit_profile(moved[:40])
    up, down = np.split(moved[40:], 2, axis=2)
    guessed = regression(unaligned, up.reshape(-1, S)).reshape(up.shape)
    assert found > np.median(snr_db(guessed, down)) + 5


def test_antennas_together_tell_more_than_each_alone():
    """Each of two delays has its own direction, so eight antennas tell the two apart where a narrow band does not."""
    generator = np.random.default_rng(0)
    delays = np.array([0.01, 0.018]) + generator.normal(0, 2e-4, (300, 2))
    channels = paths(delays, random(300, 2), directions=np.array([[0.0, 0.25]]) * np.ones((300, 1)), antennas=8)
    noisy = channels + 0.2 * random(*channels.shape, seed=2)
    joint = HelmholtzChannels()
    assert median_snr(joint, noisy, channels, known=250) > median_snr(Delays(), noisy, channels, known=250) + 2
    assert joint.share > 0


@pytest.mark.parametrize("method", [Copy, Ramp, Nearest, Delays, HelmholtzChannels])
@pytest.mark.parametrize("rows", [1, 2, 7])
def test_few_known_rows_and_links_of_zeros_do(method, rows):
    channels = random(rows, 2, 8)
    channels[:1] = 0
    made = method()
    made.fit(taught_links(channels[..., :4], channels[..., 4:]))
    given = np.concatenate([random(3, 2, 4), np.zeros((1, 2, 4))])
    assert np.isfinite(made.predict(None, given).value).all()
    one = method()
    one.fit(taught_links(channels[..., :1], channels[..., 1:2]))
    assert one.predict(None, given[..., :1]).value.shape == (4, 2, 1)


@pytest.mark.parametrize("method", [Ramp, Nearest, Delays, HelmholtzChannels])
def test_a_row_s_level_and_phase_change_its_prediction_alone(method):
    channels, made = rooms(20)[..., 20:32], method()
    up, down = np.split(channels, 2, axis=2)
    made.fit(taught_links(up, down))
    np.testing.assert_allclose(made.predict(None, 3j * up).value, 3j * made.predict(None, up).value, rtol=1e-6)


def test_rows_of_too_many_numbers_are_predicted_antenna_by_antenna(monkeypatch, capsys):
    channels = rooms(20)
    known = taught_links(channels[:15, :, :S], channels[:15, :, S:])
    monkeypatch.setattr("learn.channels.linear_channels.MOST_NUMBERS", channels.shape[1] * S - 1)
    joint, alone = HelmholtzChannels(), Delays()
    for method in (joint, alone):
        method.fit(known)
    found, expected = (method.predict(None, channels[15:, :, :S]) for method in (joint, alone))
    np.testing.assert_array_equal(found.value, expected.value)
    assert "each antenna is predicted by itself" in capsys.readouterr().err
