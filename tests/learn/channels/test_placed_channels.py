"""The downlink from the uplink and the places of known rows."""

import numpy as np
import pytest

from learn.channels.linear_channels import HelmholtzChannels, HelmholtzPositions
from learn.quantities.complex_scores import coverage, snr_db
from tests.learn.taught import taught_links

WAVELENGTH, KNOWN, S = 0.3, 80, 6


@pytest.fixture(autouse=True, scope="module")
def quick():
    """A short search, which is enough for so few positions."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("learn.models.kriging.vecchia.FITTED_ON", 40)
        patch.setattr("learn.models.kriging.vecchia.ITERATIONS", 25)
        yield


def waves(noise: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Positions, and rows [K, 2, 2 S] of five plane waves."""
    generator = np.random.default_rng(0)
    positions = generator.uniform(0, 0.5, (110, 3))
    directions = generator.standard_normal((5, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    late = generator.uniform(0, 20, 5) - positions @ directions.T
    gains = generator.standard_normal((2, 5, 2)) @ [1, 1j]
    wavenumbers = 2 * np.pi / WAVELENGTH * (1 + 0.002 * np.arange(2 * S))
    rows = np.einsum("aw,kws->kas", gains, np.exp(-1j * wavenumbers * late[..., None]))
    return positions, rows + noise * generator.standard_normal((*rows.shape, 2)) @ [1, 1j]


def score(method, positions: np.ndarray | None, rows: np.ndarray, truth: np.ndarray) -> float:
    """Median SNR of the rows that are not known."""
    near = None if positions is None else positions[:KNOWN]
    method.fit(taught_links(rows[:KNOWN, :, :S], rows[:KNOWN, :, S:], near, wavelength=WAVELENGTH))
    found = method.predict(None if positions is None else positions[KNOWN:], rows[KNOWN:, :, :S]).value
    return float(np.median(snr_db(found, truth[KNOWN:, :, S:])))


def test_places_help_where_the_uplink_is_noisy():
    (positions, rows), truth = waves(0.7), waves()[1]
    placed = HelmholtzPositions()
    assert score(placed, positions, rows, truth) > score(HelmholtzChannels(), positions, rows, truth) + 3
    assert "of the power" in placed.found


def test_without_positions_it_is_helmholtz_and_says_so(capsys):
    _, rows = waves(0.3)
    assert score(HelmholtzPositions(), None, rows, rows) == score(HelmholtzChannels(), None, rows, rows)
    assert "the positions (tx_pos.csv) are not known" in capsys.readouterr().err


def test_rows_with_a_phase_of_their_own_do_not_use_places():
    positions, rows = waves()
    rows = rows * np.exp(2j * np.pi * np.random.default_rng(1).uniform(size=(len(rows), 1, 1)))
    placed = HelmholtzPositions()
    assert score(placed, positions, rows, rows) == pytest.approx(
        score(HelmholtzChannels(), positions, rows, rows), abs=0.5
    )


@pytest.mark.parametrize("count", [1, 2, 5])
def test_few_rows_do_not_use_places(count):
    positions, rows = waves()
    placed = HelmholtzPositions()
    placed.fit(taught_links(rows[:count, :, :S], rows[:count, :, S:], positions[:count], wavelength=WAVELENGTH))
    assert placed.field is None
    assert np.isfinite(placed.predict(positions[:3], rows[:3, :, :S]).value).all()


def test_stated_intervals_hold_near_known_places_and_far_from_them():
    """Half of the tested rows are at known places; those far away are predicted from their own uplink alone."""
    positions, rows = waves(0.3)
    known, tested = positions[:, 0] < 0.35, np.arange(len(rows)) % 3 == 0
    placed = HelmholtzPositions()
    taught = known & ~tested
    placed.fit(taught_links(rows[taught][..., :S], rows[taught][..., S:], positions[taught], wavelength=WAVELENGTH))
    for some in (known & tested, ~known):
        found = placed.predict(positions[some], rows[some][..., :S])
        assert 0.82 < coverage(found.value - rows[some][..., S:], found.deviation) < 0.97
