"""Stored fields: positions between their points, what is refused, and the closet's field, which is in tests/data."""

from pathlib import Path

import numpy as np
import pytest

from scenes.files.errors import InputError
from scenes.places.built_in import closet
from simulate.fullwave.dipole import source_weights
from simulate.fullwave.stored_field import MARGIN, StoredField, read_stored_field, undo_mean_of_edges

K = 2 * np.pi / 0.3276
WAVE = K * np.array([0.6, -0.64, 0.48])
CELL = 0.02
CLOSET = Path(__file__).parents[2] / "data" / "closet"


def plane_wave(points: np.ndarray) -> np.ndarray:
    return np.exp(1j * points @ WAVE)


def lattice(shape: tuple) -> np.ndarray:
    return CELL * np.stack(np.meshgrid(*(np.arange(size) for size in shape), indexing="ij"), axis=-1)


@pytest.fixture
def field() -> StoredField:
    shape = (40, 36, 32)
    origin = np.array([1.0, 2.0, 0.5])
    return StoredField(origin, CELL, plane_wave(origin + lattice(shape))[None], np.array([1e-4]), 900)


def test_positions_between_points_are_interpolated(field):
    low = field.origin + MARGIN * CELL
    high = field.origin + CELL * (np.array(field.values.shape[1:]) - 1 - MARGIN)
    points = np.random.default_rng(0).uniform(low, high, (300, 3))
    error = np.abs(field.responses(points)[:, 0] - plane_wave(points)).max()
    assert error < 5e-4
    assert 20 * np.log10(error) < field.thinned(2).interpolation_error_db < -40


def test_few_points_are_enough():
    origin = np.array([1.0, 2.0, 0.5])
    field = StoredField(origin, CELL, plane_wave(origin + lattice((5, 4, 12)))[None], np.array([1e-4]), 900)
    point = origin + CELL * np.array([[2.4, 1.5, 5.3]])
    assert np.abs(field.responses(point)[:, 0] - plane_wave(point)).max() < 1e-3


def test_position_outside_is_refused(field):
    inside = field.origin + 0.2
    with pytest.raises(InputError, match=r"position 2: expected a place within \[1.0, 2.0, 0.5\]"):
        field.responses(np.stack([inside, field.origin - 0.01]))


def test_field_is_read_as_it_was_written(field, tmp_path):
    field.write(tmp_path / "field.npz")
    again = read_stored_field(tmp_path / "field.npz")
    assert np.allclose(again.values, field.values) and again.steps == 900
    (tmp_path / "field.npz").write_bytes(b"no archive")
    with pytest.raises(InputError, match=r"field.npz: expected the stored field"):
        read_stored_field(tmp_path / "field.npz")


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_mean_of_a_cells_edges_is_undone(axis):
    points = lattice((20, 20, 20))
    middle = plane_wave(points)
    for across in {0, 1, 2} - {axis}:
        middle = middle * np.cos(WAVE[across] * CELL / 2)  # the mean of the two edges half a cell away on each side
    inner = (slice(4, -4),) * 3
    assert np.abs(undo_mean_of_edges(middle, axis)[inner] - plane_wave(points)[inner]).max() < 2e-4
    assert np.abs(middle[inner] - plane_wave(points)[inner]).max() > 5e-3


def test_source_between_points_radiates_like_one_there():
    position = np.array([10.3, 11.8, 9.5])
    points, weights = source_weights(position)
    assert len(points) == 64 and weights.sum() == pytest.approx(1)
    assert (weights @ plane_wave(CELL * points)) == pytest.approx(plane_wave(CELL * position), abs=2e-3)


def test_field_of_the_closet_is_small_and_settled_and_says_its_error():
    assert sum(file.stat().st_size for file in CLOSET.iterdir()) < 1e6
    field = read_stored_field(CLOSET / "field.npz")
    assert field.values.shape[0] == 16 and (field.unsettled < 1e-3).all()
    assert field.interpolation_error_db < -40


def test_field_of_the_closet_solves_the_wave_equation():
    """∇²E + k²E = 0 where there is air, with the Laplacian by differences of the interpolated field."""
    scene, field = closet(), read_stored_field(CLOSET / "field.npz")
    points = np.random.default_rng(0).uniform(*scene.transmitter.region, (200, 3))
    step, k = 0.02, 2 * np.pi / scene.wavelength
    here = field.responses(points).astype(complex)
    laplacian = sum(
        (field.responses(points + side) + field.responses(points - side) - 2 * here) / step**2
        for side in step * np.eye(3)
    )
    assert np.linalg.norm(laplacian + k**2 * here) < 0.02 * np.linalg.norm(k**2 * here)
    assert np.linalg.norm(laplacian + (1.1 * k) ** 2 * here) > 0.15 * np.linalg.norm(k**2 * here)
