"""Quick kriging gives the responses of ``KrigedField.interpolated``, which computes them in double precision here."""

import copy

import numpy as np
import pytest
import torch

from learn.models.kriging.kriged_field import DIRECTIONS, KrigedField
from tests.plane_wave_field import BEAMFORMER, WAVELENGTH

REGION = np.array([[0.0, 0, 0], [3, 2, 1]])


def field_of(known: int, drift: float = 30.0, nugget: float = 0.01, length: float = 1.5) -> KrigedField:
    """A field with random responses at known positions on a random walk, some of which are left out."""
    field, generator = KrigedField(np.zeros((2, 3)), BEAMFORMER, WAVELENGTH, "responses"), np.random.default_rng(known)
    field.places = torch.from_numpy(generator.uniform(*REGION, (known, 3))).float()
    field.times = torch.from_numpy(np.sort(generator.permutation(3 * known)[:known])).float()
    field.values = torch.from_numpy(generator.standard_normal((known, 32))).float()
    shares = generator.uniform(0, 1, DIRECTIONS) ** 4
    field.shares = torch.from_numpy(shares / shares.sum()).float()
    field.length, field.drift, field.nugget = (torch.tensor(each) for each in (length, drift, nugget))
    return field


def reference(field: KrigedField, positions: torch.Tensor) -> np.ndarray:
    with torch.inference_mode():
        values = copy.deepcopy(field).double().interpolated(positions.double())[0]
    return values.unflatten(-1, (-1, 2)).numpy()


def quick(field: KrigedField, positions: torch.Tensor) -> np.ndarray:
    with torch.inference_mode():
        return field.responses(positions).numpy()


def somewhere(count: int) -> torch.Tensor:
    return torch.from_numpy(np.random.default_rng(9).uniform(*REGION, (count, 3))).float()


@pytest.mark.parametrize("known", [1, 2, 5, 32, 33, 200])
@pytest.mark.parametrize("drift", [0.7, 30.0, 1e9])
def test_responses_are_those_of_the_reference(known, drift):
    field, positions = field_of(known, drift), somewhere(20)
    np.testing.assert_allclose(quick(field, positions), reference(field, positions), atol=2e-6)
    assert np.abs(quick(field, positions)).max() > 0.1


def test_known_and_distant_positions_are_those_of_the_reference():
    field = field_of(60, drift=1e9, nugget=1e-6)
    beside = field.places + 0.003
    for positions in (field.places, beside, 40 + field.places):
        np.testing.assert_allclose(quick(field, positions), reference(field, positions), atol=1e-4)
    np.testing.assert_allclose(quick(field, field.places).reshape(60, 32), field.values, atol=1e-3)


def test_outside_of_inference_mode_the_reference_is_used_and_has_a_gradient():
    field, positions = field_of(20), somewhere(3).requires_grad_()
    field.responses(positions).square().sum().backward()
    assert positions.grad.abs().max() > 0


@pytest.mark.parametrize("name", ["places", "values", "shares", "length", "drift", "nugget", "mean"])
def test_changed_buffers_are_noticed(name):
    field, positions = field_of(20), somewhere(3)
    before = quick(field, positions)
    changed = getattr(field, name)
    with torch.no_grad():
        changed.copy_(changed.flip(0) if name == "shares" else changed + 1.0 if name == "mean" else 0.5 * changed)
    after = quick(field, positions)
    assert np.abs(after - before).max() > 1e-4
    np.testing.assert_allclose(after, reference(field, positions), atol=1e-5)


@pytest.mark.parametrize("known", [2, 3, 60])
@pytest.mark.parametrize("drift", [0.7, 30.0])
def test_what_is_left_out_tells_neither_its_value_nor_its_time(known, drift):
    field, members = field_of(known, drift), [0, known // 2, known - 1]
    found = field.interpolated(field.places[members], torch.tensor(members))
    for row, member in enumerate(members):
        other, kept = copy.deepcopy(field), torch.arange(known) != member
        other.places, other.times, other.values = field.places[kept], field.times[kept], field.values[kept]
        for value, alone in zip(found, other.interpolated(field.places[[member]]), strict=True):
            torch.testing.assert_close(value[[row]], alone, atol=1e-5, rtol=1e-4)
