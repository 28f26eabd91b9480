"""A metal cylinder of 16 flat sides, against the exact series of a round one (Harrington 1961, section 5-9).

The wave H₀⁽²⁾(kR) of a line source at ρ′ is scattered as −Σ ε_n J_n(ka)/H_n⁽²⁾(ka) H_n⁽²⁾(kρ′) H_n⁽²⁾(kρ) cos nφ. The
wave of a point source falls as 1/√L faster, L being the length of the way.
"""

import numpy as np
import pytest
import trimesh
from scipy.special import hankel2, jv

from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.materials import p2040_materials
from scenes.scene.orientation import facing
from scenes.scene.shapes import sheet
from simulate.rays.core.propagation import Propagation
from simulate.rays.diffraction import edges
from simulate.rays.tracer import Tracer

RADIUS, SOURCE, RECEIVER = 0.3, 2.0, 1.5
ANGLES = np.radians(np.linspace(5, 90, 120))  # between source and receiver, seen from the cylinder's axis


def scene() -> Scene:
    """A tall cylinder about the z axis, and dipoles along z at its middle height."""
    cylinder = trimesh.creation.cylinder(RADIUS, 12, sections=16)
    far = sheet((60, 60, 60), (0.1, 0, 0), (0, 0.1, 0))
    return Scene(
        "cylinder",
        915e6,
        Gateway((-SOURCE, 0, 0), facing((1, 0, 0)), rows=1, columns=1, pattern="dipole"),
        Transmitter((-2, -2, -0.1), (2, 2, 0.1), pattern="dipole"),
        (SceneObject("cylinder", cylinder, "metal"), SceneObject("far", far, "metal")),
        p2040_materials(["metal"], 915e6),
    )


def scattered(wavenumber: float) -> np.ndarray:
    """The exact field of the round cylinder, but for a constant factor."""
    n = np.arange(80)
    radius = RADIUS * np.sqrt(np.sin(np.pi / 8) * 8 / np.pi)  # of a circle of equal area
    weights = np.where(n > 0, 2, 1) * jv(n, wavenumber * radius) / hankel2(n, wavenumber * radius)
    weights = weights * hankel2(n, wavenumber * SOURCE) * hankel2(n, wavenumber * RECEIVER)
    half = ANGLES / 2  # the wave is reflected about there
    length = sum(np.hypot(d - RADIUS * np.cos(half), RADIUS * np.sin(half)) for d in (SOURCE, RECEIVER))
    return (weights * np.cos(np.outer(ANGLES, n))).sum(axis=1) / np.sqrt(length)


def correlation(found: np.ndarray, expected: np.ndarray) -> float:
    return float(abs(np.vdot(found, expected)) / np.linalg.norm(found) / np.linalg.norm(expected))


@pytest.mark.parametrize(("smooth", "least", "most"), [(20, 0.99, 1.0), (30, 0.0, 0.9)])
def test_wave_reflected_by_the_sides_and_diffracted_between_them_is_that_of_a_round_cylinder(
    smooth, least, most, monkeypatch
):
    """Without the edges between the sides, there are only the flat sides' reflections, which is far off."""
    monkeypatch.setattr(edges, "SMOOTH", np.radians(smooth))
    place = scene()
    around = np.pi - ANGLES
    positions = RECEIVER * np.stack([np.cos(around), np.sin(around), 0 * around], axis=1)
    tracer = Tracer(place, Propagation(max_depth=1, los=False, rays=200_000))
    found = tracer.responses(positions).ravel()
    assert least < correlation(found, scattered(2 * np.pi / place.wavelength)) < most
