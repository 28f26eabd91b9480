"""Complex permittivity of materials at a frequency, and which materials count as conductors."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool

from scenes.scene.description import Scene
from scenes.scene.materials import RadioMaterial

VACUUM_PERMITTIVITY = 8.8541878128e-12
"""ε₀, farads per metre."""

VACUUM_PERMEABILITY = 1.25663706212e-6
"""μ₀, henries per metre."""

LEAST_LOSS_OF_CONDUCTOR = 1000.0
"""Materials with a larger loss σ/ωε₀ count as perfect conductors."""


def relative_permittivity(material: RadioMaterial, frequency: float) -> complex:
    """Return the complex relative permittivity ε_r − jσ/ωε₀."""
    return material.relative_permittivity - 1j * _loss(material, frequency)


def refractive_index(material: RadioMaterial, frequency: float) -> complex:
    """Return the complex refractive index √(ε_r − jσ/ωε₀)."""
    return complex(np.sqrt(relative_permittivity(material, frequency)))


def is_conductor(material: RadioMaterial, frequency: float) -> bool:
    """Whether a material counts as a perfect conductor."""
    return _loss(material, frequency) > LEAST_LOSS_OF_CONDUCTOR


def conducting_objects(scene: Scene) -> Bool[np.ndarray, " objects"]:
    """Whether each object of a scene is a conductor."""
    return np.array([is_conductor(scene.materials[item.material], scene.frequency) for item in scene.objects])


def _loss(material: RadioMaterial, frequency: float) -> float:
    return material.conductivity / (2 * np.pi * frequency * VACUUM_PERMITTIVITY)
