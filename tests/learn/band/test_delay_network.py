"""mlp-responses over a band: delays that are known in closed form, and what depends on the seed alone."""

import numpy as np
import pytest
import torch

from learn.band.delay_network import PATHS, DelayNetwork, first_delays
from learn.band.known_band import KnownBand
from learn.comparison.makers import chosen
from simulate.exchange.given_responses import write_dataset
from simulate.spectra.array import PlanarArray

SUBCARRIERS, BANDWIDTH = 16, 16e6
"""The subcarriers are 1 MHz apart, so that a delay of 1000 ns is a whole turn."""


@pytest.fixture(scope="module")
def known(tmp_path_factory) -> KnownBand:
    """Two paths of 100 and 300 ns at 20 places."""
    generator = np.random.default_rng(0)
    places, gains = generator.uniform(0, 1, (20, 3)), generator.normal(size=(20, 4, 2)) + 1j
    phase = np.outer([100e-9, 300e-9], np.arange(SUBCARRIERS) * 1e6)
    folder = tmp_path_factory.mktemp("band") / "two"
    responses = gains @ np.exp(-2j * np.pi * phase)
    dataset = write_dataset(folder, places, responses, PlanarArray(2, 2), "2.4 GHz", bandwidth=BANDWIDTH)
    return KnownBand(dataset, np.arange(20))


def test_a_gain_of_one_delay_turns_its_phase_over_the_band(known):
    made = DelayNetwork(1)
    made.fit(known)
    with torch.no_grad():
        made._network.outward.weight.zero_()
        gains = torch.zeros(4, PATHS, 2)
        gains[2, 5, 1] = 3.0  # 3i at one element
        made._network.outward.bias.copy_(gains.flatten())
        made._delays[5] = 0.2
    found = made.predict(known.positions).responses
    turns = (known.frequencies - known.frequencies.mean()) / 1e6
    np.testing.assert_allclose(
        found[:, 2], made._scale * 3j * np.exp(-0.4j * np.pi * turns) * np.ones((20, 1)), rtol=1e-4
    )
    assert np.abs(found[:, [0, 1, 3]]).max() == 0


def test_training_begins_with_the_delays_that_hold_the_power(known):
    found = 1000 * first_delays(known.responses)
    assert found.min() < 110 < 290 < found.max() and found.max() - found.min() < 700


def test_the_result_depends_on_the_seed_alone_and_says_its_delays(known):
    found = []
    before = torch.random.get_rng_state()
    for _ in range(2):
        made = DelayNetwork(2)
        made.fit(known)
        found.append(made.predict(known.positions).responses)
    assert torch.equal(before, torch.random.get_rng_state())
    np.testing.assert_array_equal(*found)
    assert found[0].shape == known.responses.shape
    assert made.found.startswith("8 delays from ") and made.delays.shape == (PATHS,)


def test_training_fits_the_known_responses(known):
    errors = []
    for steps in (1, 30):
        made = DelayNetwork(steps)
        made.fit(known)
        errors.append(np.abs(made.predict(known.positions).responses - known.responses).mean())
    assert errors[1] < errors[0] / 2


def test_it_is_compared_only_if_it_is_named():
    from learn.band.band_methods import BAND_METHODS

    assert "mlp-responses" in BAND_METHODS and "mlp-responses" not in chosen(None, BAND_METHODS)
