"""The coefficients of a conducting wedge against the exact field of a line source beside it.

In the open angle nπ around the edge, the line source's wave H₀⁽²⁾(kR) becomes (Harrington 1961, section 5-10; ν = m/n)

    Σ_{m≥1} (4/n) J_ν(kρ<) H_ν⁽²⁾(kρ>) sin νφ sin νφ′                 for the electric field along the edge (soft),
    Σ_{m≥0} (2ε_m/n) J_ν(kρ<) H_ν⁽²⁾(kρ>) cos νφ cos νφ′, ε₀ = 1, ε_m = 2,  for the field across it (hard).
"""

import numpy as np
import pytest
from scipy.special import hankel2, jv

from simulate.rays.core.ray_tracer import mi
from simulate.rays.diffraction.edge_fields import common_factor, transition_pairs

K = 2 * np.pi / 0.3276
SOURCE, RECEIVER = 5.0, 3.0  # metres from the edge


def exact(n: float, phi: np.ndarray, source: float, soft: bool) -> np.ndarray:
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
