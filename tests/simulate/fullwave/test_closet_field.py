"""The closet's full-wave field, which is kept in tests/data so that neither tests nor users wait for it."""

from pathlib import Path

import numpy as np

from scenes.places.built_in import closet
from simulate.fullwave.stored_field import read_stored_field

CLOSET = Path(__file__).parents[2] / "data" / "closet"


def test_field_is_small_and_settled_and_says_its_error():
    assert sum(file.stat().st_size for file in CLOSET.iterdir()) < 1e6
    field = read_stored_field(CLOSET / "field.npz")
    assert field.values.shape[0] == 16 and (field.unsettled < 1e-3).all()
    assert field.interpolation_error_db < -40


def test_field_solves_the_wave_equation():
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
