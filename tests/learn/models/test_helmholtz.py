"""Helmholtz kriging against fields whose law is known."""

import numpy as np
import pytest
import torch

from learn.data.metrics import ssim
from learn.data.neighbours import inverse_distance
from learn.models.kriging import vecchia
from learn.models.kriging.helmholtz import HelmholtzField
from learn.models.kriging.kriged_field import DIRECTIONS, KrigedField
from learn.models.kriging.stacking import best_weights
from learn.training.prediction import predict
from simulate.dataset.dataset import Dataset
from simulate.spectra.spectrum import spectrum_of
from tests.plane_wave_field import BEAMFORMER, WAVELENGTH, dataset_of, plane_waves

SIDE = 0.5  # Metres; of the cube of positions


def unfitted(of: str = "responses") -> KrigedField:
    return KrigedField(np.zeros((2, 3)), BEAMFORMER, WAVELENGTH, of)


def fitted(dataset: Dataset, known: np.ndarray) -> KrigedField:
    """Kriging of the responses, or of the spectra where there are none."""
    field = unfitted("spectra" if "response" not in dataset.values else "responses")
    field.fit(dataset, known)
    return field


@pytest.fixture(scope="module")
def waves() -> Dataset:
    positions = np.random.default_rng(0).uniform(0, SIDE, (500, 3))
    return dataset_of(positions, plane_waves(positions, 400, 1))


def law(shares: torch.Tensor, length: float = 1e9, drift: float = 1e9, responses: bool = True):
    """Its covariance as complex numbers, between points (x, y, z, time)."""
    field = unfitted("responses" if responses else "spectra")
    field.wavelength = torch.tensor(WAVELENGTH)

    def covariance(a, b):
        a, b = (torch.tensor(point, dtype=torch.float64)[None] for point in (a, b))
        faded = torch.exp(-(a[:, 3:] - b[:, 3:].T).abs() / drift)
        found = field.covariance(a[:, :3], b[:, :3], faded, shares.double(), torch.tensor(length))
        return complex(found[0, 0], found[1, 0]) if responses else float(found)

    return covariance


EVEN = torch.full((DIRECTIONS,), 1 / DIRECTIONS)


def test_covariance_of_waves_from_all_sides_is_cooks():
    covariance = law(EVEN)
    for distance in (0.02, 0.1, 0.25, 0.4):
        expected = np.sinc(2 * distance / WAVELENGTH)
        assert covariance([distance, 0, 0, 0], [0, 0, 0, 0]) == pytest.approx(expected, abs=0.01)


def test_covariance_is_that_of_waves_drawn_from_unequal_sides():
    shares = torch.rand(DIRECTIONS, generator=torch.Generator().manual_seed(5)) ** 8
    shares /= shares.sum()
    directions = unfitted().directions.numpy()
    generator = np.random.default_rng(6)
    a, b = np.array([0.1, 0.3, -0.2]), np.array([0.25, 0.2, -0.25])
    waves = (
        np.exp(2j * np.pi / WAVELENGTH * directions @ np.stack([a, b], axis=1)) * np.sqrt(shares.numpy() / 2)[:, None]
    )
    drawn = [generator.standard_normal((10_000, DIRECTIONS, 2)) @ [1, 1j] @ waves for _ in range(20)]
    at = np.concatenate(drawn).T
    expected = (at[0] * at[1].conj()).mean()
    assert abs(expected) > 0.1  # the case says something
    assert abs(law(shares)([*a, 0], [*b, 0]) - expected) < 0.01
    power = np.abs(at[0]) ** 2, np.abs(at[1]) ** 2
    assert law(shares, responses=False)([*a, 0], [*b, 0]) == pytest.approx(np.cov(power)[0, 1], abs=0.02)


def test_covariance_fades_with_distance_and_with_time():
    along = torch.zeros(DIRECTIONS)
    along[7] = 1  # a single wave is alike everywhere
    assert abs(law(along, length=0.5)([0.5, 0, 0, 0], [0, 0, 0, 0])) == pytest.approx(np.exp(-1))
    assert abs(law(along, drift=20)([0.5, 0, 0, 30], [0, 0, 0, 70])) == pytest.approx(np.exp(-2))


@pytest.mark.slow
def test_interpolates_a_solution_of_the_helmholtz_equation(waves):
    inner = np.flatnonzero((np.abs(waves.positions - SIDE / 2) < 0.15).all(axis=1))
    known = np.setdiff1d(np.arange(500), inner)
    field = fitted(waves, np.concatenate([known, inner[::2]]))
    asked = inner[1::2]
    with torch.no_grad():
        found = torch.view_as_complex(field.responses(torch.from_numpy(waves.positions[asked]).float())).numpy()
    truth = waves.responses[asked]
    alike = np.abs((found.conj() * truth).sum(1)) / np.linalg.norm(found, axis=1) / np.linalg.norm(truth, axis=1)
    assert np.median(alike) > 0.995
    assert float(field.nugget) < 0.01  # no noise
    assert float(field.length) > SIDE  # no shadows here
    assert float(field.drift) > 10 * len(waves.names)  # nor does anything change


def drawn(length: float, nugget: float, drift: float = np.inf, walk: bool = False) -> Dataset:
    """A field drawn from the very law that is fitted."""
    generator = np.random.default_rng(4)
    positions = generator.uniform(0, SIDE, (500, 3))
    if walk:  # a smooth way that comes back to places it has been at
        turns = np.linspace(0, 6 * np.pi, 500)[:, None] * np.array([1.0, 2.13, 3.37])
        positions = SIDE / 2 * (1 + np.sin(turns))
    distance = np.linalg.norm(positions[:, None] - positions, axis=-1)
    apart = np.abs(np.arange(500)[:, None] - np.arange(500))
    covariance = np.sinc(2 * distance / WAVELENGTH) * np.exp(-distance / length - apart / drift)
    white = generator.standard_normal((500, 16, 2)) @ [1, 1j]
    return dataset_of(positions, np.linalg.cholesky(covariance + nugget * np.eye(500)) @ white)


@pytest.mark.slow
@pytest.mark.parametrize(("length", "nugget"), [(0.1, 0.05), (0.6, 0.01)])
def test_finds_the_law_a_field_was_drawn_from(length, nugget):
    field = fitted(drawn(length, nugget), np.arange(500))
    assert float(field.length) == pytest.approx(length, rel=0.3)
    assert float(field.nugget) == pytest.approx(nugget, rel=0.5)
    assert float(field.shares.max()) < 5 / DIRECTIONS


@pytest.mark.slow
def test_finds_how_fast_a_place_changes_and_predicts_the_better_for_it():
    dataset = drawn(0.6, 0.01, drift=100, walk=True)
    known = np.flatnonzero(np.arange(500) % 5 != 2)
    field = fitted(dataset, known)
    assert float(field.drift) == pytest.approx(100, rel=0.3)
    asked = np.setdiff1d(np.arange(500), known)
    positions = torch.from_numpy(dataset.positions[asked]).float()
    truth = torch.view_as_real(torch.from_numpy(dataset.responses[asked])).flatten(1)

    def error() -> float:
        with torch.no_grad():
            found = field.interpolated(positions)[0]
        return float((found * np.sqrt(np.mean(np.abs(dataset.responses[known]) ** 2)) - truth).square().mean())

    drifting = error()
    field.drift = torch.tensor(1e9)
    assert drifting < 0.9 * error()


def test_a_position_is_taken_to_lie_on_the_leg_that_passes_nearest():
    field = unfitted()
    field.places = torch.tensor([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [5, 5, 0]])
    field.times = torch.tensor([3.0, 4, 8, 9])
    field.drift = torch.tensor(10.0)
    near = torch.arange(4).expand(3, 4)
    found = field.expected_fading(torch.tensor([[0.25, -0.01, 0], [1.01, 0.5, 0], [0.5, 0.5, 0]]), near)
    on_one = [torch.exp(-(field.times - time).abs() / 10) for time in (3.25, 6.0)]
    np.testing.assert_allclose(found[:2], torch.stack(on_one), atol=0.01)
    # As far from the second leg, which took four times as long.
    assert float(found[2, 0]) == pytest.approx((np.exp(-0.05) + 4 * np.exp(-0.3)) / 5, abs=0.01)


def test_a_tag_that_rests_and_spectra_named_twice_are_no_trouble(waves):
    positions = waves.positions.copy()
    positions[10:40] = positions[10]
    dataset = dataset_of(positions, waves.responses, keep_responses=False)
    field = fitted(dataset, np.array([*range(60), 59, 0]))
    assert len(field.places) == 60
    with torch.no_grad():
        assert torch.isfinite(field(torch.from_numpy(positions[5:15]).float())).all()


def test_pictures_that_are_all_the_same_are_predicted_everywhere(waves):
    dataset = dataset_of(waves.positions[:20], np.ones((20, 16)), keep_responses=False)
    field = fitted(dataset, np.arange(20))
    with torch.no_grad():
        found = field(torch.from_numpy(waves.positions[30:33]).float()).numpy()
    np.testing.assert_allclose(found, spectrum_of(dataset.pictures[:3]), atol=1e-3)


@pytest.mark.slow
def test_finds_where_the_waves_come_from():
    directions = unfitted().directions.numpy()
    generator = np.random.default_rng(8)
    positions = generator.uniform(0, SIDE, (150, 3))
    amplitudes = generator.standard_normal((2, BEAMFORMER.array.elements, 2)) @ [1, 1j]
    waves = np.exp(2j * np.pi / WAVELENGTH * positions @ directions[[20, 70]].T)
    dataset = dataset_of(positions, waves * [1.0, 0.5] @ amplitudes)
    field = fitted(dataset, np.arange(150))
    assert set(field.shares.topk(2).indices.tolist()) == {20, 70}
    assert float(field.shares[[20, 70]].sum()) > 0.8


def test_known_pictures_are_kept_and_far_away_the_mean_is_shown(waves):
    dataset = dataset_of(waves.positions, waves.responses, keep_responses=False)
    field = fitted(dataset, np.arange(100))
    assert not field.of_responses
    field.nugget = torch.tensor(1e-6)
    with torch.no_grad():
        known = field(torch.from_numpy(dataset.positions[:5]).float()).numpy()
        far, open_share = field.interpolated(torch.tensor([[100.0, 0, 0]]))
    assert ssim(known, spectrum_of(dataset.pictures[:5])).min() > 0.99
    np.testing.assert_allclose(far[0], dataset.pictures[:100].reshape(100, -1).mean(0), atol=1e-3)
    assert float(open_share[0]) == pytest.approx(1.0)


@pytest.mark.slow
def test_open_share_is_the_mean_squared_error():
    dataset = drawn(0.3, 0.01)
    field = fitted(dataset, np.arange(0, 500, 2))
    asked = np.arange(1, 500, 2)
    with torch.no_grad():
        found, open_share = field.interpolated(torch.from_numpy(dataset.positions[asked]).float())
    truth = torch.view_as_real(torch.from_numpy(dataset.responses[asked])).flatten(1)
    power = np.mean(np.abs(dataset.responses[::2]) ** 2)
    error = (found - truth / np.sqrt(power)).square().mean(dim=1) * 2  # of numbers of mean square 1
    order = open_share.argsort()
    for part in (order[:125], order[125:]):  # where it is sure, and where it is not
        assert float(error[part].mean() / open_share[part].mean()) == pytest.approx(1.0, abs=0.15)


@pytest.mark.slow
@pytest.mark.parametrize("keep_responses", [True, False])
def test_positions_many_wavelengths_apart_are_interpolated_no_worse_than_by_distance(keep_responses):
    """Forty positions in 6 m × 6 m × 2 m: kriging of responses then predicts noise."""
    positions = np.random.default_rng(3).uniform(0, (6, 6, 2), (60, 3))
    dataset = dataset_of(positions, plane_waves(positions, 30, 2), keep_responses)
    known, asked = np.arange(40), np.arange(40, 60)
    field = HelmholtzField(np.zeros((2, 3)), BEAMFORMER, WAVELENGTH)
    sentence = field.fit(dataset, known)
    truth = spectrum_of(dataset.pictures[asked])
    by_distance = inverse_distance(positions[known], spectrum_of(dataset.pictures[known]), positions[asked])
    found, expected = (np.median(ssim(each, truth)) for each in (predict(field, positions[asked]).spectra, by_distance))
    assert found > expected - 0.01
    assert sentence.startswith("interpolates by ") and "100% kriging of responses" not in sentence


@pytest.mark.slow
def test_positions_close_to_each_other_are_interpolated_by_kriging_of_responses(waves):
    field = HelmholtzField(np.zeros((2, 3)), BEAMFORMER, WAVELENGTH)
    assert field.fit(waves, np.arange(400)).startswith("interpolates by 100% kriging of responses")
    assert predict(field, waves.positions[:1]).responses is not None and list(field.fields) == ["responses"]


@pytest.mark.slow
def test_pictures_are_interpolated_by_the_responses_behind_them(monkeypatch):
    """Of 5 waves in 1.5 wavelengths, by 120 pictures: with their phases the others are predicted far better."""
    monkeypatch.setattr(vecchia, "ITERATIONS", 15)  # for the time it takes
    positions = np.random.default_rng(0).uniform(0, SIDE, (140, 3))
    dataset = dataset_of(positions, plane_waves(positions, 5, 3), keep_responses=False)
    known, asked = np.arange(120), np.arange(120, 140)
    field = HelmholtzField(np.zeros((2, 3)), BEAMFORMER, WAVELENGTH)
    sentence = field.fit(dataset, known)
    assert "kriging of responses found from pictures" in sentence
    assert predict(field, positions[:1]).responses is None
    truth = spectrum_of(dataset.pictures[asked])
    of_spectra = np.median(ssim(predict(fitted(dataset, known), positions[asked]).spectra, truth))
    found = np.median(ssim(predict(field, positions[asked]).spectra, truth))
    assert found > 0.97 and found > of_spectra + 0.02
    again = HelmholtzField(np.zeros((2, 3)), BEAMFORMER, WAVELENGTH)
    again.load_state_dict(field.state_dict())
    np.testing.assert_array_equal(predict(again, positions[asked]).spectra, predict(field, positions[asked]).spectra)


def test_prediction_is_the_weighted_mean(waves):
    responses, spectra = (fitted(data, np.arange(30)) for data in (waves, waves.with_values(response=None)))
    field = HelmholtzField(np.zeros((2, 3)), BEAMFORMER, WAVELENGTH)
    field._set(
        {"responses": 0.5, "spectra": 0.25, "inverse-distance": 0.25}, {"responses": responses, "spectra": spectra}
    )
    asked = torch.from_numpy(waves.positions[40:43]).float()
    known, places = spectrum_of(waves.pictures[:30]), waves.positions[:30]
    with torch.no_grad():
        expected = 0.5 * responses(asked) + 0.25 * spectra(asked)
        expected = expected.numpy() + 0.25 * inverse_distance(places, known, waves.positions[40:43])
        found, found_responses = field.predict(asked)
        np.testing.assert_allclose(found.numpy(), expected, atol=0.002)  # grey levels are rounded
        np.testing.assert_array_equal(found, field(asked))
        np.testing.assert_array_equal(found_responses, responses.responses(asked))


@pytest.mark.parametrize("keep_responses", [True, False])
def test_distance_alone_needs_no_covariance_at_prediction(waves, keep_responses):
    dataset = waves if keep_responses else waves.with_values(response=None)
    field = HelmholtzField(np.zeros((2, 3)), BEAMFORMER, WAVELENGTH)
    field._set({"inverse-distance": 1.0}, {"only": fitted(dataset, np.arange(30))})
    asked = waves.positions[40:43]
    expected = inverse_distance(waves.positions[:30], spectrum_of(waves.pictures[:30]), asked)
    np.testing.assert_allclose(predict(field, asked).spectra, expected, atol=0.003)
    assert predict(field, asked).responses is None and field.uncertainty(torch.from_numpy(asked).float()) is None


def test_gains_that_can_be_chance_count_for_nothing():
    truth = np.random.default_rng(0).random((4, 90, 360)).astype(np.float32)
    noise = np.random.default_rng(1).standard_normal((3, *truth.shape)).astype(np.float32)
    nearly_alike = {"spectra": truth + 0.100 * noise[0], "smooth-spectra": truth + 0.0999 * noise[0]}
    weights, score = best_weights(nearly_alike, truth)
    assert weights == {"spectra": 1.0} and score > 0.9
    independent = {"spectra": truth + 0.3 * noise[1], "smooth-spectra": truth + 0.3 * noise[2]}
    weights, _ = best_weights(independent, truth)
    assert weights == {"spectra": 0.5, "smooth-spectra": 0.5}


def test_second_fit_keeps_the_weights(waves):
    pictures = waves.with_values(response=None)
    model = HelmholtzField(np.zeros((2, 3)), waves.beamformer, WAVELENGTH)
    model.fit(pictures, np.arange(0, 8))
    weights = model.weights.clone()
    model.refit(pictures, np.arange(0, 12))
    assert torch.equal(model.weights, weights)
    assert all(len(field.places) == 12 for field in model.fields.values())
