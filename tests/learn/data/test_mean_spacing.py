"""The mean spacing of known positions: of volumes, planes, lines and paths whose sizes are known."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from learn.data.expected_score import Spacing

WAVELENGTH = 0.5


def uniform(n, extents, seed=0):
    return np.random.default_rng(seed).random((n, 3)) * extents


@pytest.mark.parametrize(
    ("extents", "shape", "size"),
    [
        ((2.0, 3.0, 1.5), "volume", 9 / 0.5**3),
        ((2.0, 3.0, 0.0), "plane", 6 / 0.5**2),
        ((0.1, 2.0, 3.0), "plane", 6 / 0.5**2),  # a layer of a fifth of a wavelength
    ],
)
def test_size_is_that_of_the_region_in_which_positions_were_drawn(extents, shape, size):
    found = Spacing.between(uniform(400, extents), WAVELENGTH)
    assert (found.known, found.shape) == (400, shape)
    assert found.size == pytest.approx(size, rel=0.06)
    assert found.density == pytest.approx(400 / size, rel=0.06)


def test_few_positions_tell_the_size_without_bias():
    """The bare hull of 25 positions in a box holds about half of it."""
    sizes = [Spacing.between(uniform(25, (4, 3, 2), seed), 1.0).size / 24 for seed in range(30)]
    assert 0.8 < np.mean(sizes) < 1.05


def test_size_does_not_depend_on_the_frame_of_a_plane():
    flat = uniform(200, (4, 3, 0))
    turned = Rotation.from_euler("xyz", [0.3, 0.5, 0.2]).apply(flat)
    found = Spacing.between(turned, 1.0)
    assert found.shape == "plane"
    assert found.size == pytest.approx(12, rel=0.1)


def test_positions_on_the_border_do_not_enlarge_the_region():
    """All positions on a sphere are corners of their hull."""
    drawn = np.random.default_rng(0).normal(size=(60, 3))
    on_sphere = drawn / np.linalg.norm(drawn, axis=1, keepdims=True)
    assert Spacing.between(on_sphere, 0.5).size == pytest.approx((2 / 0.5) ** 3, rel=0.15)


def test_line_and_path_have_a_length():
    line = uniform(50, (3, 0, 0)) + 1
    found = Spacing.between(line, WAVELENGTH)
    assert found.shape == "path" and found.size == pytest.approx(6, rel=0.1)
    angle = np.linspace(0, 6 * np.pi, 1000)
    spiral = np.stack([np.cos(angle), np.sin(angle), angle / 6], axis=-1)
    turned = Spacing.between(spiral, WAVELENGTH)
    assert turned.shape == "path"
    assert turned.size == pytest.approx(6 * np.pi * np.hypot(1, 1 / 6) / WAVELENGTH, rel=1e-3)
    assert turned.sentence() == "mean spacing 0.038 wavelengths along a path"


def test_order_of_measurement_tells_a_path_from_a_region():
    angle = np.linspace(0, 40, 1000)
    spiral = np.stack([np.cos(angle), np.sin(angle), angle / 20], axis=-1)
    mixed = np.random.default_rng(0).permutation(spiral)
    assert (Spacing.between(spiral, 0.5).shape, Spacing.between(mixed, 0.5).shape) == ("path", "volume")


def test_several_recordings_at_a_position_count_once():
    places = uniform(100, (2, 3, 1.5))
    assert Spacing.between(places.repeat(5, axis=0), WAVELENGTH) == Spacing.between(places, WAVELENGTH)
    assert Spacing.between(uniform(4, (2, 3, 1)).repeat(5, axis=0), WAVELENGTH) is None


def test_grid_is_no_path():
    axes = [np.arange(size) * 0.4 for size in (6, 5, 4)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    assert Spacing.between(grid, WAVELENGTH).shape == "volume"


@pytest.mark.parametrize("positions", [uniform(9, (3, 3, 3)), uniform(40, (0.12, 0.12, 0.12)), np.ones((20, 3))])
def test_too_few_or_too_near_tell_nothing(positions):
    assert Spacing.between(positions, WAVELENGTH) is None
