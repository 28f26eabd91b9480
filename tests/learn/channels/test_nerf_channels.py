"""NeRF² for channels: what it learns, whatever the unit, and what depends on the seed alone."""

import numpy as np
import torch

from learn.channels.nerf_channels import NerfChannels
from learn.models.peers.nerf2 import RaySize
from learn.quantities.complex_scores import snr_db
from tests.folders import paths
from tests.learn.taught import taught_links

SMALL = RaySize(4, 2, 4, width=16, layers=4)
ANTENNAS = np.array([[0.0, 0.06 * number, 2] for number in range(4)])


def links(rows: int, seed: int = 0) -> np.ndarray:
    """One path of a delay that all share, with amplitudes of their own."""
    generator = np.random.default_rng(seed)
    return paths(np.full((rows, 1), 0.02), generator.uniform(0.5, 1, (rows, 1)) + 0j, subcarriers=12)


def fitted(channels: np.ndarray, steps: int, seed: int = 0) -> NerfChannels:
    made = NerfChannels(steps, SMALL)
    made.fit(taught_links(channels[..., :6], channels[..., 6:], seed=seed, antennas=ANTENNAS))
    return made


def test_it_learns_the_downlink_that_follows_from_the_uplink_in_any_unit():
    known, new = links(24), links(10, seed=1)
    first, found = (fitted(known, steps).predict(None, new[..., :6]).value for steps in (1, 60))
    before, after = (np.median(snr_db(each, new[..., 6:])) for each in (first, found))
    assert after > max(before, 0) + 3
    other = fitted(1e-8 * known, 1).predict(None, 1e-8 * new[..., :6]).value
    np.testing.assert_allclose(1e8 * other, first, rtol=0.01, atol=1e-3)


def test_the_result_depends_on_the_seed_alone():
    channels = links(6)
    before = torch.random.get_rng_state()
    first, again, other = (fitted(channels, 2, seed).predict(None, channels[..., :6]).value for seed in (0, 0, 1))
    assert torch.equal(before, torch.random.get_rng_state())
    np.testing.assert_array_equal(first, again)
    assert first.shape == (6, 4, 6) and np.abs(first - other).max() > 1e-3


def test_links_of_zeros_and_no_known_antennas():
    made = NerfChannels(2, SMALL)
    made.fit(taught_links(np.zeros((3, 4, 6), complex), np.zeros((3, 4, 6), complex)))
    assert np.isfinite(made.predict(None, np.zeros((2, 4, 6), complex)).value).all()
