"""Networks over a band: what they fit, what depends on the seed alone, and receivers that move."""

import numpy as np
import pytest
import torch

from learn.band.band_methods import ApertureBand, ResponseMLPBand
from learn.quantities.known import Known
from learn.quantities.responses import Responses
from simulate.dataset.written_dataset import write_dataset
from simulate.spectra.array import PlanarArray

SUBCARRIERS, BANDWIDTH = 16, 16e6
"""The subcarriers are 1 MHz apart, so that a delay of 1000 ns is a whole turn."""


def two_paths(folder, **given) -> Known:
    """Paths of 100 and 300 ns from two directions at 20 places, with gains of their own."""
    generator = np.random.default_rng(0)
    array, places = PlanarArray(2, 2), generator.uniform(0, 1, (20, 3))
    arrival = array.manifold(np.array([0.3, 2.0]), np.array([0.5, 0.2])).T  # [elements, paths]
    gains = arrival * (generator.normal(size=(20, 1, 2)) + 1j)
    phase = np.outer([100e-9, 300e-9], np.arange(SUBCARRIERS) * 1e6)
    responses = gains @ np.exp(-2j * np.pi * phase)
    dataset = write_dataset(folder, places, responses, array, "2.4 GHz", bandwidth=BANDWIDTH, **given)
    return Known.of(dataset, Responses(), np.arange(20))


@pytest.fixture(scope="module")
def known(tmp_path_factory) -> Known:
    return two_paths(tmp_path_factory.mktemp("band") / "two")


@pytest.fixture(scope="module")
def moving(tmp_path_factory) -> Known:
    return two_paths(tmp_path_factory.mktemp("band") / "moves", moving="receiver")


LEARNED = pytest.mark.parametrize("learned", [ResponseMLPBand, ApertureBand])


@LEARNED
def test_the_result_depends_on_the_seed_alone_and_says_its_delays(known, learned):
    found = []
    before = torch.random.get_rng_state()
    for _ in range(2):
        made = learned(2)
        made.fit(known)
        found.append(made.predict(known.positions).value)
    assert torch.equal(before, torch.random.get_rng_state())
    np.testing.assert_array_equal(*found)
    assert found[0].shape == known.values.shape and made.steps == 2
    assert made.found.startswith(f"{len(made.delays)} delays from ") and (np.diff(made.delays) >= 0).all()
    assert made.delays[0] < 110e-9 < 290e-9 < made.delays[-1] and np.ptp(made.delays) < 700e-9


@LEARNED
@pytest.mark.parametrize("moves", [False, True])
def test_training_fits_the_known_responses(known, moving, learned, moves):
    errors, given = [], moving if moves else known
    for steps in (1, 30):
        made = learned(steps)
        made.fit(given)
        errors.append(np.abs(made.predict(given.positions).value - given.values).mean())
    assert errors[1] < 0.6 * errors[0]
    assert (made.network.turn is not None) == moves
