"""Networks over a band: y_m(f) = Σ_p c_pm e^(−i 2π (f − f₀) τ_p), and how they are trained and loaded."""

import numpy as np
import pytest
import torch

from learn.fitted.runs import train
from learn.models.networks.aperture import BiSplatAperture
from learn.models.networks.mlp import PATHS, ResponseMLP
from learn.models.networks.response_network import PathDelays, first_delays
from scenes.files.errors import InputError
from simulate.dataset.written_dataset import write_dataset
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer

SUBCARRIERS = 6
REGION = np.array([[0.0, 0, 0], [1, 1, 1]])
ARRAY = PlanarArray(1, 3)
NAMES = pytest.mark.parametrize("name", ["mlp-responses", "bisplat-aperture"])


def responses(subcarriers: int = SUBCARRIERS, places: int = 20) -> np.ndarray:
    """One path with a delay of a tenth of a turn, whose gain is that of the place."""
    gains = np.random.default_rng(1).normal(size=(places, 3, 1)) + 0.5j
    return gains * np.exp(-0.2j * np.pi * np.arange(subcarriers))


def network(name: str, turned: bool = False, band: bool = True):
    torch.manual_seed(0)
    given = REGION, Beamformer(ARRAY), 0.1
    small = {"primitives": 5, "width": 4}
    model = BiSplatAperture(*given, **small) if name == "bisplat-aperture" else ResponseMLP(*given)
    if turned:
        model.sample_one_field(torch.eye(3))
    if band:
        model.learn_band(responses())
    return model


def test_a_gain_of_one_delay_turns_its_phase_over_the_band():
    model = network("mlp-responses")
    gains = torch.zeros(3, PATHS, 2)
    gains[2, 5, 1] = 3.0  # 3i at one element
    with torch.no_grad():
        model.network.outward.weight.zero_()
        model.network.outward.bias.copy_(gains.flatten())
        model.band.delays[5] = 0.2
        found = torch.view_as_complex(model.band_responses(torch.rand(2, 3)).contiguous()).numpy()
    turns = np.arange(SUBCARRIERS) - SUBCARRIERS // 2
    np.testing.assert_allclose(found[:, 2], 3j * np.exp(-0.4j * np.pi * turns) * np.ones((2, 1)), rtol=1e-4)
    assert np.abs(found[:, :2]).max() == 0


def test_each_primitive_has_a_delay_of_its_own():
    model = network("bisplat-aperture")
    place = torch.rand(2, 3)
    with torch.no_grad():
        gains = torch.view_as_complex(model._coefficients(place).contiguous()).numpy()
        received = torch.view_as_complex(model._received().contiguous()).numpy()
        found = torch.view_as_complex(model.band_responses(place).contiguous()).numpy()
        delays = model.band.delays.numpy()
    turns = np.arange(SUBCARRIERS) - SUBCARRIERS // 2
    expected = np.einsum("bi,im,is->bms", gains, received, np.exp(-2j * np.pi * np.outer(delays, turns)))
    np.testing.assert_allclose(found, expected, atol=1e-4 * np.abs(expected).max())
    assert len(delays) == 5 and np.ptp(delays) > 0


@NAMES
@pytest.mark.parametrize("turned", [False, True])
def test_responses_at_the_carrier_are_those_of_its_subcarrier(name, turned):
    model, place = network(name, turned), torch.rand(2, 3)
    for mode in (torch.no_grad(), torch.inference_mode()):
        with mode:
            over_band, at_carrier = model.band_responses(place), model.responses(place)
        assert over_band.shape == (2, 3, SUBCARRIERS, 2)
        torch.testing.assert_close(over_band[:, :, SUBCARRIERS // 2], at_carrier, rtol=1e-3, atol=1e-5)
    assert network(name, band=False).band_responses(place) is None


@NAMES
@pytest.mark.parametrize("turned", [False, True])
def test_the_loss_is_that_of_all_subcarriers_and_moves_the_delays(name, turned):
    model, place = network(name, turned), torch.rand(2, 3)
    with torch.no_grad():
        truth = model.band_responses(place)
    assert model.responses_loss(place, truth).item() == pytest.approx(0, abs=1e-6)
    other = truth.clone()
    other[:, :, 0] = 0
    model.responses_loss(place, other).backward()
    assert model.band.delays.grad.abs().max() > 0
    assert any(model.band.delays is each for each in model.groups(1.0)[1]["params"])


def test_training_begins_with_the_delays_that_hold_the_power():
    spread = first_delays(responses(subcarriers=40), 8)
    assert len(spread) == 8 and spread[0] < 0.1 < spread[-1] and np.ptp(spread) < 0.2
    assert PathDelays(4, spread).delays.shape == (8,)


@NAMES
def test_a_run_learns_the_band_and_predicts_it(name, tmp_path):
    places = np.random.default_rng(0).uniform(0, 1, (20, 3))

    def written(folder: str, given: np.ndarray, **band):
        return write_dataset(tmp_path / folder, places, given, ARRAY, "2.4 GHz", **band)

    wide = written("wide", responses(), bandwidth="6 MHz")
    run = train(wide, tmp_path / "run", model=name, split="random", steps=2)
    found = run.predict(places[:2])
    assert found.band_responses.shape == (2, 3, SUBCARRIERS)
    np.testing.assert_allclose(found.band_responses[:, :, 3], found.responses, rtol=1e-3, atol=1e-5)
    few = {"model": name, "split": "random", "steps": 1, "init": tmp_path / "run"}
    assert train(wide, tmp_path / "next", **few).predict(places[:1]).band_responses is not None
    narrow = written("narrow", responses()[..., 0])
    with pytest.raises(InputError, match="expected a run of the same model and size"):
        train(narrow, tmp_path / "other", **few)
    fresh = train(narrow, tmp_path / "carrier", model=name, split="random", steps=1)
    assert fresh.predict(places[:1]).band_responses is None
