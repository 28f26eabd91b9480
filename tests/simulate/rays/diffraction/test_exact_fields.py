"""Exact fields: coefficients of a conducting wedge, the edge of a large metal sheet, and a cylinder of flat sides."""

import numpy as np
import pytest
import trimesh
from scipy.special import hankel2, jv

from benchmarks.ledger.exact_fields import half_plane_response
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.orientation import facing
from scenes.scene.shapes import sheet
from simulate.rays.core.propagation import Propagation
from simulate.rays.core.ray_tracer import mi
from simulate.rays.diffraction import edges
from simulate.rays.diffraction.edge_fields import common_factor, transition_pairs
from simulate.rays.tracer import Tracer

K = 2 * np.pi / 0.3276
SOURCE, RECEIVER = 5.0, 3.0  # metres from the edge


def exact(n: float, phi: np.ndarray, source: float, soft: bool) -> np.ndarray:
    """In the open angle nπ around the edge, a line source's H₀⁽²⁾(kR) becomes (Harrington 1961, 5-10; ν = m/n)

    Σ_{m≥1} (4/n) J_ν(kρ<) H_ν⁽²⁾(kρ>) sin νφ sin νφ′                 for the electric field along the edge (soft),
    Σ_{m≥0} (2ε_m/n) J_ν(kρ<) H_ν⁽²⁾(kρ>) cos νφ cos νφ′, ε₀ = 1, ε_m = 2,  for the field across it (hard).
    """
    terms = np.arange(int(n * K * SOURCE) + 60)
    nu = terms / n
    radial = jv(nu, K * RECEIVER) * hankel2(nu, K * SOURCE)
    if soft:
        return (4 / n * radial * np.sin(nu * source) * np.sin(np.outer(phi, nu))).sum(axis=1)
    return (2 / n * np.where(terms > 0, 2, 1) * radial * np.cos(nu * source) * np.cos(np.outer(phi, nu))).sum(axis=1)


def uniform_theory(n: float, phi: np.ndarray, source: float, soft: bool) -> np.ndarray:
    """Direct wave, waves reflected at the two faces, and the diffracted wave."""

    def wave(angle: np.ndarray) -> np.ndarray:
        distance = np.sqrt(SOURCE**2 + RECEIVER**2 - 2 * SOURCE * RECEIVER * np.cos(angle))
        return np.where(np.abs(angle) < np.pi, hankel2(0, K * distance), 0)

    reflection = -1 if soft else 1
    geometric = wave(phi - source) + reflection * (wave(phi + source) + wave(2 * n * np.pi - phi - source))
    length = SOURCE * RECEIVER / (SOURCE + RECEIVER)
    at, opening, reach, sine = (mi.Float(np.full(len(phi), value, np.float32)) for value in (source, n, length, 1.0))
    direct, reflected = transition_pairs(mi.Float(phi.astype(np.float32)), at, opening, reach, K)
    d = common_factor(opening, sine, K) * (direct - reflected if soft else direct + reflected)
    coefficient = d.real.numpy() + 1j * d.imag.numpy()
    return geometric + hankel2(0, K * SOURCE) * coefficient * np.exp(-1j * K * RECEIVER) / np.sqrt(RECEIVER)


@pytest.mark.parametrize("soft", [True, False])
@pytest.mark.parametrize(("n", "degrees"), [(1.5, 40), (1.5, 100), (1.5, 230), (2.0, 30), (2.0, 150), (1.8, 80)])
def test_field_around_a_wedge_is_the_exact_one(n, degrees, soft):
    phi = np.radians(np.arange(1.3, 180 * n - 1, 1.7))
    expected = exact(n, phi, np.radians(degrees), soft)
    error = np.abs(uniform_theory(n, phi, np.radians(degrees), soft) - expected)
    assert error.max() < 0.012 * np.sqrt(np.mean(np.abs(expected) ** 2))


def around_edge(radius: float, degrees: np.ndarray | float, height: float = 0.0) -> np.ndarray:
    """Points around the z axis at angles from the half-plane x = 0, y < 0."""
    angle = np.radians(degrees)
    return np.stack([radius * np.sin(angle), -radius * np.cos(angle), np.full_like(angle, height)], axis=-1)


@pytest.mark.parametrize(
    ("distances", "degrees", "height", "bound"),
    [((8, 5), 60, 0.0, 0.02), ((8, 5), 20, 0.0, 0.02), ((3, 2), 60, 2.0, 0.05), ((2, 1), 110, 0.5, 0.04)],
)
def test_field_around_a_sheet_is_the_exact_one(distances, degrees, height, bound, make_scene):
    """A sheet so large that its other edges play no role, and short dipoles along its edge."""
    source = around_edge(distances[0], degrees)
    positions = around_edge(distances[1], np.linspace(3.1, 357.2, 100), height)
    exact = half_plane_response(source, positions, 915e6)
    scene = make_scene(
        ("sheet", sheet((0, -60, -60), (0, 60, 0), (0, 0, 120)), "metal"),
        gateway=Gateway(tuple(source), facing((0, -1, 0)), rows=1, columns=1, pattern="dipole"),
        transmitter=Transmitter(tuple(positions.min(axis=0)), tuple(positions.max(axis=0) + 0.01), pattern="dipole"),
    )
    error = {}
    for diffraction in (False, True):
        followed = Propagation(max_depth=1, diffraction=diffraction, rays=100_000)
        found = Tracer(scene, followed).responses(positions)[:, 0]
        error[diffraction] = np.linalg.norm(found - exact) / np.linalg.norm(exact)
    assert error[True] < bound and error[False] > 3 * error[True]


RADIUS, FROM, TO = 0.3, 2.0, 1.5
ANGLES = np.radians(np.linspace(5, 90, 120))  # between source and receiver, seen from the cylinder's axis


def scattered(wavenumber: float) -> np.ndarray:
    """The exact field of the round cylinder, but for a constant factor (Harrington 1961, section 5-9).

    The wave H₀⁽²⁾(kR) of a line source at ρ′ is scattered as −Σ ε_n J_n(ka)/H_n⁽²⁾(ka) H_n⁽²⁾(kρ′) H_n⁽²⁾(kρ) cos nφ.
    The wave of a point source falls as 1/√L faster, L being the length of the way.
    """
    n = np.arange(80)
    radius = RADIUS * np.sqrt(np.sin(np.pi / 8) * 8 / np.pi)  # of a circle of equal area
    weights = np.where(n > 0, 2, 1) * jv(n, wavenumber * radius) / hankel2(n, wavenumber * radius)
    weights = weights * hankel2(n, wavenumber * FROM) * hankel2(n, wavenumber * TO)
    half = ANGLES / 2  # the wave is reflected about there
    length = sum(np.hypot(d - RADIUS * np.cos(half), RADIUS * np.sin(half)) for d in (FROM, TO))
    return (weights * np.cos(np.outer(ANGLES, n))).sum(axis=1) / np.sqrt(length)


def correlation(found: np.ndarray, expected: np.ndarray) -> float:
    return float(abs(np.vdot(found, expected)) / np.linalg.norm(found) / np.linalg.norm(expected))


@pytest.mark.parametrize(("smooth", "least", "most"), [(20, 0.99, 1.0), (30, 0.0, 0.9)])
def test_wave_reflected_by_the_sides_and_diffracted_between_them_is_that_of_a_round_cylinder(
    smooth, least, most, monkeypatch, make_scene
):
    """Without the edges between the sides, there are only the flat sides' reflections, which is far off."""
    monkeypatch.setattr(edges, "SMOOTH", np.radians(smooth))
    place = make_scene(
        ("cylinder", trimesh.creation.cylinder(RADIUS, 12, sections=16), "metal"),
        ("far", sheet((60, 60, 60), (0.1, 0, 0), (0, 0.1, 0)), "metal"),
        gateway=Gateway((-FROM, 0, 0), facing((1, 0, 0)), rows=1, columns=1, pattern="dipole"),
        transmitter=Transmitter((-2, -2, -0.1), (2, 2, 0.1), pattern="dipole"),
    )
    around = np.pi - ANGLES
    positions = TO * np.stack([np.cos(around), np.sin(around), 0 * around], axis=1)
    tracer = Tracer(place, Propagation(max_depth=1, los=False, rays=200_000))
    found = tracer.responses(positions).ravel()
    assert least < correlation(found, scattered(2 * np.pi / place.wavelength)) < most
