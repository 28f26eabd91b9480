"""A receiver that moves: all elements at all places of the array sample one field."""

import copy
import dataclasses

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from learn.data.metrics import ssim
from learn.fitted.runs import train
from learn.models.kriging.helmholtz import HelmholtzField
from learn.models.kriging.interpolators import WAYS, MovingArrayField, kriging_ways
from learn.models.kriging.kriged_field import KrigedField
from learn.models.networks.aperture import BiSplatAperture
from learn.models.networks.mlp import ResponseMLP
from scenes.files.errors import InputError
from simulate.dataset.dataset import Dataset
from simulate.dataset.written_dataset import write_dataset
from simulate.spectra.spectrum import spectrum_of
from tests.plane_wave_field import BEAMFORMER, WAVELENGTH, dataset_of

TURNED = Rotation.from_euler("xyz", [30, -50, 110], degrees=True)
KNOWN, OTHERS = np.arange(20), np.arange(20, 40)


@pytest.fixture(scope="module")
def moving() -> Dataset:
    """Random plane waves at the elements of an array that is turned, at 40 places in a box of 1 m."""
    generator = np.random.default_rng(3)
    places = generator.uniform(0, 1, (40, 3))
    directions = generator.standard_normal((300, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    amplitudes = generator.standard_normal((300, 2)) @ [1, 1j]
    elements = places[:, None] + TURNED.apply(WAVELENGTH * BEAMFORMER.array.positions)
    responses = np.exp(2j * np.pi / WAVELENGTH * elements @ directions.T) @ amplitudes
    found = dataset_of(places, responses)
    receiver = dataclasses.replace(found.receiver, orientation=TURNED.as_quat())
    return dataclasses.replace(found, receiver=receiver, metadata={**found.metadata, "moving": "receiver"})


def fitted(field: KrigedField, dataset: Dataset) -> KrigedField:
    field.fit(dataset, KNOWN)
    return field


def of_one_field(dataset: Dataset) -> KrigedField:
    return fitted(MovingArrayField(np.zeros((2, 3)), BEAMFORMER, WAVELENGTH), dataset)


@pytest.fixture(scope="module")
def one_field(moving) -> KrigedField:
    return of_one_field(moving)


def median_ssim(model: torch.nn.Module, dataset: Dataset, numbers: np.ndarray) -> float:
    with torch.inference_mode():
        predicted = model(torch.from_numpy(dataset.positions[numbers]).float()).numpy()
    return float(np.median(ssim(predicted, spectrum_of(dataset.pictures[numbers]))))


def test_samples_of_all_elements_tell_more_than_each_element_by_itself(moving, one_field):
    each = fitted(KrigedField(np.zeros((2, 3)), BEAMFORMER, WAVELENGTH, "responses"), moving)
    assert median_ssim(one_field, moving, OTHERS) > median_ssim(each, moving, OTHERS) + 0.1


def test_elements_taken_for_turned_otherwise_tell_less(moving, one_field):
    straight = dataclasses.replace(
        moving, receiver=dataclasses.replace(moving.receiver, orientation=np.array([0, 0, 0, 1.0]))
    )
    assert median_ssim(one_field, moving, OTHERS) > median_ssim(of_one_field(straight), straight, OTHERS) + 0.1


def test_known_places_are_kept_and_the_variance_grows_away_from_them(moving, one_field):
    assert median_ssim(one_field, moving, KNOWN) > 0.99
    places = torch.from_numpy(np.vstack([moving.positions[:1], [[300.0, 300.0, 300.0]]])).float()
    with torch.inference_mode():
        near, far = one_field.uncertainty(places).tolist()
    assert near < 0.01 and far == pytest.approx(1, abs=0.01)


def test_all_elements_together_are_each_kriged_from_all_samples(one_field):
    field, alone = copy.deepcopy(one_field), one_field._of_samples()
    assert len(alone.places) == 16 * len(KNOWN) and len(alone.offsets) == 1
    alone.shares, alone.length, alone.drift, alone.nugget = field.shares, field.length, field.drift, field.nugget
    field.neighbours, alone.neighbours = len(KNOWN), len(alone.places)
    place = torch.tensor([[0.5, 0.5, 0.5]])
    with torch.inference_mode():
        together = field.responses(place)[0]
        one_by_one = torch.cat([alone.responses(place + offset)[0] for offset in field.offsets])
    torch.testing.assert_close(together, one_by_one, rtol=1e-2, atol=1e-2)


def test_the_model_chooses_it_and_loads_it_again(moving):
    model = HelmholtzField(np.zeros((2, 3)), BEAMFORMER, WAVELENGTH)
    chosen = model.fit(moving, KNOWN).split("(")[0]
    assert WAYS["field"] in chosen and WAYS["responses"] not in chosen
    again = HelmholtzField(np.zeros((2, 3)), BEAMFORMER, WAVELENGTH)
    again.load_state_dict(model.state_dict())
    place = torch.tensor([[0.4, 0.6, 0.5]])
    with torch.inference_mode():
        torch.testing.assert_close(again.predict(place), model.predict(place))
    fixed = dataclasses.replace(moving, metadata={"frequency_hz": moving.metadata["frequency_hz"]})
    assert "field" in kriging_ways(moving, KNOWN) and "field" not in kriging_ways(fixed, KNOWN)


REGION = np.array([[0.0, 0, 0], [1, 1, 1]])


def test_the_network_of_responses_predicts_one_field_at_the_elements(moving):
    torch.manual_seed(0)
    model = ResponseMLP(REGION, BEAMFORMER, WAVELENGTH)
    model.sample_one_field(torch.from_numpy(TURNED.as_matrix()).float())
    at = torch.rand(3, 3)
    elements = torch.from_numpy(TURNED.apply(WAVELENGTH * BEAMFORMER.array.positions)).float()
    with torch.no_grad():
        expected = torch.stack(
            [model.network(model.encoding(at + offset, model.region, model.wavelength)) for offset in elements], dim=1
        )
        torch.testing.assert_close(model.responses(at), expected, rtol=1e-3, atol=1e-4)
        assert model.responses_loss(at, expected).item() == pytest.approx(0, abs=1e-6)
        assert model.responses_loss(at, 0 * expected).item() > 0.1


def test_a_primitive_of_a_moving_array_is_a_plane_wave():
    """One small primitive with a constant coefficient: what an element receives depends on its own place alone."""
    torch.manual_seed(0)
    model = BiSplatAperture(REGION, BEAMFORMER, WAVELENGTH, primitives=1, width=4)
    model.sample_one_field(torch.from_numpy(TURNED.as_matrix()).float())
    with torch.no_grad():
        model.transmitter.outward.weight.zero_()
        model.transmitter.outward.bias.zero_()
        model.primitives.scale_raw.fill_(-10)  # the smallest scale
        azimuth, elevation = (float(each.deg2rad()) for each in (model.primitives.azimuth, model.primitives.elevation))
        u = TURNED.apply([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])
        place, step = torch.rand(1, 3), 0.3 * WAVELENGTH * u
        here, there = (
            torch.view_as_complex(model.responses(each.float()).double())
            for each in (place, place + torch.from_numpy(step))
        )
    np.testing.assert_allclose((there / here).numpy(), np.exp(2j * np.pi * 0.3), atol=1e-3)


@pytest.mark.parametrize("name", ["mlp-responses", "bisplat-aperture"])
def test_runs_of_moving_arrays_are_loaded_as_such(moving, name, tmp_path):
    def written(folder: str, moves: str) -> Dataset:
        given = moving.positions, moving.responses, BEAMFORMER.array, "915 MHz"
        return write_dataset(tmp_path / folder, *given, gateway_orientation=TURNED.as_quat(), moving=moves)

    few = {"split": "random", "steps": 1, "init": tmp_path / "run"}
    run = train(written("moves", "receiver"), tmp_path / "run", model=name, split="random", steps=1)
    np.testing.assert_allclose(run.model.turn.cpu().numpy(), TURNED.as_matrix(), atol=1e-6)
    assert train(tmp_path / "moves", tmp_path / "next", model=name, **few).model.turn is not None
    with pytest.raises(InputError, match="expected a run of the same model and size"):
        train(written("stands", "transmitter"), tmp_path / "other", model=name, **few)
