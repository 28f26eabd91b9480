"""Which magnetic components are corrected beside edges of conductors, and the exact field beside a half-plane."""

import numpy as np
import pytest

from benchmarks.ledger.exact_fields import free_space_response, half_plane_green, half_plane_response
from simulate.fullwave.cells import BLOCK, SHEET, beside_edges

FREQUENCY = 915e6
UP = np.array([0.0, 0.0, 1.0])


def conducting_box(low: tuple, high: tuple) -> np.ndarray:
    """Edges of a grid of 8 cells along each axis that are on the faces of a box between two corners of cells."""
    conducting = np.zeros((3, 9, 9, 9), bool)
    for axis in range(3):
        for side in (low[axis], high[axis]):
            b, c = (axis + 1) % 3, (axis + 2) % 3
            for along, across in ((b, c), (c, b)):
                where = [slice(None)] * 3
                where[axis] = side
                where[along], where[across] = slice(low[along], high[along]), slice(low[across], high[across] + 1)
                conducting[(along, *where)] = True
    return conducting


@pytest.mark.parametrize(
    ("low", "expected"),
    [
        ((4, 0, 0), {(0, 4, 4): 1, (1, 4, 4): 1, (1, 3, 4): 1}),
        ((0, 0, 0), {(0, 4, 4): 2, (1, 4, 4): 2}),
    ],
    ids=["sheet", "block"],
)
def test_edge_of_a_sheet_has_three_components_beside_it_and_that_of_a_block_two(low, expected):
    found = beside_edges(conducting_box(low, (4, 4, 8)))[:, 1:8, 1:8, 1:7]
    marked = np.zeros((3, 9, 9, 9), int)
    for component, kind in expected.items():
        marked[component] = kind
    assert np.array_equal(found, marked[:, 1:8, 1:8, 1:7])


@pytest.mark.parametrize("wedge, permeability", [(2.0, SHEET), (1.5, BLOCK)], ids=["sheet", "block"])
def test_correction_makes_the_static_field_a_solution_of_the_differences(wedge, permeability):
    """r^(1/w) sin(φ/w) with w = outer angle / π, on the cells next to the edge; φ is 0 on the conductor's face."""
    place = np.exp(0.5j * np.pi)  # across the edge from the face that φ starts from

    def field(z: complex) -> float:
        return abs(z) ** (1 / wedge) * np.sin(np.angle(z) / wedge)

    neighbours = sum(field(place + step) for step in (1, 1j, -1) if abs(place + step) > 0.5)
    here = field(place)
    assert neighbours - 3 * here - here / permeability == pytest.approx(0, abs=1e-12)


def test_half_plane_far_from_its_edge_is_a_mirror_or_nothing():
    source, position = np.array([-1.0, -19.0, 0.1]), np.array([[-1.0, -20.0, 0.1]])
    mirrored = free_space_response(source, UP, position, UP, FREQUENCY)
    mirrored -= free_space_response(source * [-1, 1, 1], UP, position, UP, FREQUENCY)
    np.testing.assert_allclose(half_plane_response(source, position, FREQUENCY), mirrored, rtol=1e-4)
    source, position = source * [1, -1, 1], position * [1, -1, 1]
    direct = free_space_response(source, UP, position, UP, FREQUENCY)
    np.testing.assert_allclose(half_plane_response(source, position, FREQUENCY), direct, rtol=1e-3)


def test_hard_half_plane_lets_no_wave_through():
    """The derivative across the plane is zero on it."""
    source, wavenumber, step = np.array([-1.0, 0.3, 0.1]), 2 * np.pi / 0.3276, np.array([1e-4, 0, 0])
    on_plane = np.array([[-2e-4, -0.7, 0.4], [-2e-4, -2.0, 0.0]])
    near, nearer = (half_plane_green(source, on_plane + number * step, wavenumber, 1) for number in (0, 1))
    assert (np.abs(nearer - near) / 1e-4 < 0.01 * wavenumber * np.abs(near)).all()


def test_half_plane_conducts():
    source = np.array([-1.0, 0.3, 0.1])
    on_plane = np.array([[0.0, -0.7, 0.4], [0.0, -0.01, 0.0]])
    assert np.abs(half_plane_response(source, on_plane, FREQUENCY)).max() < 1e-9
