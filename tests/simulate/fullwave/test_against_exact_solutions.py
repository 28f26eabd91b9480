"""The solver's responses against exact solutions of Maxwell's equations, in domains of a few wavelengths."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import quad_vec
from scipy.special import j0

from benchmarks.ledger.exact_fields import free_space_response, half_plane_response
from scenes.checks.occupancy import element_positions
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import SPEED_OF_LIGHT, Scene, SceneObject
from scenes.scene.materials import RadioMaterial, relative_permittivity
from scenes.scene.orientation import facing
from scenes.scene.shapes import sheet
from simulate.fullwave.all_elements import stored_field
from simulate.fullwave.dipole import element_direction, transmitter_direction
from simulate.fullwave.yee_grid import YeeGrid
from tests.simulate.fullwave.free_space_solver import planned_run

FREQUENCY = 915e6
CELL = 0.02
METAL = RadioMaterial("metal", 1.0, 1e7, 0.002)
STONE = RadioMaterial("stone", 4.0, 0.02, 0.05)
TILTED = (0.049, 0.67896, 0.049, 0.73089)
ID, ALONG_X = (0.0, 0.0, 0.0, 1.0), (0.0, np.sqrt(0.5), 0.0, np.sqrt(0.5))
"""Orientations of the transmitter, whose dipole is along its z axis."""


def far_sheet(x: float) -> SceneObject:
    """A sheet far beyond the cells: it tells on which sides of a wall the scene is."""
    return SceneObject(f"far {x}", sheet((x, 0, 0), (0, 1, 0), (0, 0, 1)), "metal")


def wall(material: RadioMaterial, thickness: float) -> SceneObject:
    """The plane x = 0, larger than the domain."""
    return SceneObject("wall", sheet((0, -5, -5), (0, 10, 0), (0, 0, 10)), material.name, thickness)


def place(gateway: Gateway, region: tuple, *objects: SceneObject, material: RadioMaterial = METAL) -> Scene:
    """A scene of dipoles; the transmitter's is along x if the gateway's is, and along z otherwise."""
    transmitter = Transmitter(*region, pattern="dipole", orientation=ALONG_X if gateway.polarization == "H" else ID)
    return Scene("exact", FREQUENCY, gateway, transmitter, objects, {"metal": METAL, material.name: material})


def traced(scene: Scene, origin: tuple, shape: tuple, steps: int, folder) -> tuple:
    """The stored field, places of the region drawn at random, and the responses there."""
    field = stored_field(planned_run(scene, YeeGrid(origin, CELL, shape), steps), folder)
    positions = np.random.default_rng(0).uniform(*scene.transmitter.region, (100, 3))
    return field, positions, field.responses(positions)[:, 0]


def direct(scene: Scene, positions: np.ndarray, mirror=(1, 1, 1), sign: float = 1.0) -> np.ndarray:
    """Response in free space to the source, or to its image by a mirror, of a dipole that is mirrored and signed."""
    source, along = (
        np.array(mirror) * element_positions(scene.gateway, scene.wavelength)[0],
        sign * np.array(mirror) * element_direction(scene),
    )
    return free_space_response(source, along, positions, transmitter_direction(scene), FREQUENCY)


def through_plane_waves(scene: Scene, positions: np.ndarray, height: np.ndarray, coefficient) -> np.ndarray:
    """Response of dipoles along x to plane waves that go a height along x and are multiplied by a coefficient.

    Sommerfeld's integral over the normal wave number κ: from k to 0, and on along the negative imaginary axis. It is
    scaled so that it is the response in free space where the coefficient is 1.
    """
    k = 2 * np.pi / scene.wavelength
    radius = np.linalg.norm((positions - element_positions(scene.gateway, scene.wavelength)[0])[:, 1:], axis=1)

    def integral(height: np.ndarray, radius: np.ndarray, coefficient) -> np.ndarray:
        def integrand(kappa: complex) -> np.ndarray:
            transverse = np.sqrt(k**2 - kappa**2)
            return transverse**2 * j0(transverse.real * radius) * coefficient(kappa) * np.exp(-1j * kappa * height)

        propagating = quad_vec(lambda x: integrand(x + 0j), 0, k, epsrel=1e-6)[0]
        return propagating + 1j * quad_vec(lambda x: integrand(-1j * x), 0, 12 * k, epsrel=1e-6)[0]

    known = free_space_response(
        np.zeros(3), np.array([1.0, 0, 0]), np.array([[0.7, 0.2, 0]]), np.array([1.0, 0, 0]), FREQUENCY
    )
    scale = known[0] / integral(np.array([0.7]), np.array([0.2]), lambda kappa: 1.0)[0]
    return scale * integral(height, radius, coefficient)


def interface(material: RadioMaterial, kappa: complex) -> tuple[complex, complex]:
    """Reflection coefficient of a half-space for the field along its normal, and the normal wave number in it."""
    k, permittivity = 2 * np.pi * FREQUENCY / SPEED_OF_LIGHT, relative_permittivity(material, FREQUENCY)
    inside = np.sqrt(permittivity * k**2 - (k**2 - kappa**2))
    inside = -inside if inside.imag > 0 else inside
    return (permittivity * kappa - inside) / (permittivity * kappa + inside), inside


def transmission(thickness: float) -> Callable[[complex], complex]:
    """Transmission coefficient of a slab of STONE, over that of the air that it takes the place of."""

    def coefficient(kappa: complex) -> complex:
        r, inside = interface(STONE, kappa)
        return (1 - r**2) * np.exp(1j * (kappa - inside) * thickness) / (1 - r**2 * np.exp(-2j * inside * thickness))

    return coefficient


def error(found: np.ndarray, expected: np.ndarray) -> float:
    return float(np.linalg.norm(found - expected) / np.linalg.norm(expected))


@pytest.mark.parametrize("orientation", [facing((1.0, 0.0, 0.0)), TILTED], ids=["along an axis", "tilted"])
def test_free_space(orientation, tmp_path):
    gateway = Gateway((-0.417, 0.013, 0.027), orientation, rows=1, columns=1, pattern="dipole")
    scene = place(gateway, ((-0.05, -0.25, -0.25), (0.5, 0.25, 0.25)), far_sheet(50))
    field, positions, found = traced(scene, (-0.8, -0.6, -0.6), (84, 60, 60), 620, tmp_path)
    expected = direct(scene, positions)
    ratio = found / expected
    assert np.median(np.abs(20 * np.log10(np.abs(ratio)))) < 0.1
    assert np.median(np.abs(np.angle(ratio, deg=True))) < 2
    assert error(found, expected) < 0.03
    assert field.unsettled[0] < 1e-3
    assert field.interpolation_error_db < -40


def test_absorbing_boundary_reflects_nothing(tmp_path):
    """The same field in two domains, one with the boundary twelve cells further away."""
    gateway = Gateway((-0.217, 0.013, 0.027), facing((1.0, 0.0, 0.0)), rows=1, columns=1, pattern="dipole")
    scene = place(gateway, ((-0.05, -0.1, -0.1), (0.2, 0.1, 0.1)), far_sheet(50))
    near = traced(scene, (-0.42, -0.3, -0.3), (46, 30, 30), 500, tmp_path / "near")[2]
    far = traced(scene, (-0.66, -0.54, -0.54), (70, 54, 54), 500, tmp_path / "far")[2]
    assert error(near, far) < 10 ** (-55 / 20)


def test_metal_plane_mirrors_the_source(tmp_path):
    gateway = Gateway((0.313, 0.013, 0.027), facing((1.0, 0.0, 0.0)), rows=1, columns=1, pattern="dipole")
    scene = place(gateway, ((0.08, -0.3, -0.3), (0.5, 0.3, 0.3)), wall(METAL, 0.002), far_sheet(50))
    _, positions, found = traced(scene, (-0.4, -0.6, -0.6), (70, 60, 60), 620, tmp_path)
    expected = direct(scene, positions) + direct(scene, positions, (-1, 1, 1), -1.0)
    assert error(found, direct(scene, positions)) > 0.3
    assert error(found, expected) < 0.03


def test_edge_of_a_half_plane_diffracts(tmp_path):
    """Source behind the plane x = 0, y < 0; half of the region is in its shadow."""
    gateway = Gateway((-0.417, -0.053, 0.027), facing((1.0, 0.0, 0.0)), rows=1, columns=1, pattern="dipole")
    plate = SceneObject("plate", sheet((0, -5, -5), (0, 5, 0), (0, 0, 10)), "metal")
    scene = place(gateway, ((0.1, -0.3, -0.1), (0.5, 0.4, 0.1)), plate, far_sheet(50))
    _, positions, found = traced(scene, (-0.7, -0.6, -0.4), (75, 62, 40), 620, tmp_path)
    expected = half_plane_response(element_positions(scene.gateway, scene.wavelength)[0], positions, FREQUENCY)
    shadow = positions[:, 1] < 0.053 / 0.417 * positions[:, 0]
    assert error(found, expected) < 0.03
    assert error(found[shadow], expected[shadow]) < 0.08


def test_dielectric_half_space_reflects_by_fresnel(tmp_path):
    gateway = Gateway((0.111, -0.333, 0.027), facing((0.0, 0.0, 1.0)), rows=1, columns=1, polarization="H")
    scene = place(gateway, ((0.08, 0.1, -0.1), (0.2, 0.4, 0.1)), wall(STONE, 9.0), far_sheet(50), material=STONE)
    _, positions, found = traced(scene, (-0.4, -0.7, -0.5), (50, 70, 50), 620, tmp_path)
    height = element_positions(scene.gateway, scene.wavelength)[0][0] + positions[:, 0]
    expected = direct(scene, positions)
    expected += through_plane_waves(scene, positions, height, lambda kappa: interface(STONE, kappa)[0])
    assert error(found, direct(scene, positions)) > 0.1
    assert error(found, expected) < 0.03


def test_element_and_transmitter_may_change_places(tmp_path):
    """Reciprocity, between a dielectric wall and a metal sheet that stands on it."""
    wall_of_stone = wall(STONE, 0.06)
    fin = SceneObject("fin", sheet((0, 0, -5), (0.22, 0, 0), (0, 0, 10)), "metal")
    ends = np.array([0.113, -0.181, 0.027]), np.array([0.177, 0.143, 0.059])
    responses = []
    for here, there in (ends, ends[::-1]):
        gateway = Gateway(tuple(here), facing((1.0, 0.0, 0.0)), rows=1, columns=1, pattern="dipole")
        around = (tuple(there - 0.03), tuple(there + 0.03))
        scene = place(gateway, around, wall_of_stone, fin, far_sheet(50), material=STONE)
        field, _, _ = traced(scene, (-0.4, -0.5, -0.4), (50, 52, 42), 620, tmp_path / f"{here[0]}")
        responses.append(field.responses(there[None])[0, 0])
    assert abs(responses[0] - direct(scene, ends[0][None])[0]) > 0.3 * abs(responses[0])
    assert abs(responses[0] - responses[1]) < 0.01 * abs(responses[0])


@pytest.mark.parametrize("thickness", [0.012, 0.053], ids=["thinner than a cell", "three cells"])
def test_slab_transmits_as_the_formula_says(thickness, tmp_path):
    gateway = Gateway((-0.32, 0.013, 0.027), facing((0.0, 0.0, 1.0)), rows=1, columns=1, polarization="H")
    board = wall(STONE, thickness)
    scene = place(
        gateway, ((0.1, -0.25, -0.25), (0.4, 0.25, 0.25)), board, far_sheet(50), far_sheet(-50), material=STONE
    )
    _, positions, found = traced(scene, (-0.7, -0.6, -0.6), (74, 60, 60), 620, tmp_path)

    height = positions[:, 0] - element_positions(scene.gateway, scene.wavelength)[0][0]
    assert error(found, direct(scene, positions)) > 0.1
    assert error(found, through_plane_waves(scene, positions, height, transmission(thickness))) < 0.03
