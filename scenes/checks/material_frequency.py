"""Do the materials of a scene hold at its frequency?"""

from __future__ import annotations

import math

from scenes.files.errors import named
from scenes.scene.description import Scene
from scenes.scene.materials import P2040, RadioMaterial, p2040_source

NEAR = 0.10
"""How far from its own frequency a material may be used, as a fraction of it."""

ROUNDING = 1e-9
"""Relative error within which values are those of a power law."""


def outdated(scene: Scene) -> str | None:
    """Return a sentence if ITU-R P.2040 gave a material for another frequency than the scene's, else None.

    >>> from dataclasses import replace
    >>> from scenes.places.closet import closet
    >>> outdated(closet()) is None, outdated(replace(closet(), frequency=2.4e9))[:17]
    (True, 'material "brick":')
    """
    for name, material in scene.materials.items():
        if material.frequency is None or _near(scene.frequency, material.frequency):
            continue
        source = p2040_source(material, material.frequency)
        if source is None or p2040_source(material, scene.frequency) == source:  # metal is the same everywhere
            continue
        return (
            f"material {named(name)}: expected its values at the scene's {scene.frequency / 1e6:g} MHz, found those of "
            f"{source} of ITU-R P.2040 at {material.frequency / 1e6:g} MHz; take them from p2040_materials with the "
            f"scene's frequency, or write p2040: {source} in a scene YAML"
        )
    return None


def doubts(scene: Scene) -> list[str]:
    """Return a sentence for each material whose values, given by hand, seem to be for another frequency.

    Values without a frequency are doubted if they are those of a material of ITU-R P.2040 at another frequency. Scene
    files of earlier versions have them.

    >>> from dataclasses import replace
    >>> from scenes.places.closet import closet
    >>> foam = RadioMaterial("foam", 1.1, 1e-4, 0.1, frequency=915e6)
    >>> doubts(replace(closet(), frequency=2.4e9, materials={"foam": foam}))
    ['material "foam": its values are for 915 MHz, and the scene is at 2400 MHz; give those at 2400 MHz']
    """
    sentences = []
    for name, material in scene.materials.items():
        source, frequency = None, material.frequency
        if frequency is None and p2040_source(material, scene.frequency) is None:
            source, frequency = _p2040_of_any_frequency(material)
        if frequency is None or _near(scene.frequency, frequency):
            continue
        wanted = f"{scene.frequency / 1e6:g} MHz"
        found = f"those of {source} of ITU-R P.2040 at" if source else "for"
        advice = f"write p2040: {source} instead of them" if source else f"give those at {wanted}"
        sentences.append(
            f"material {named(name)}: its values are {found} {frequency / 1e6:g} MHz, and the scene is at {wanted}; "
            f"{advice}"
        )
    return sentences


def _near(frequency: float, of_values: float) -> bool:
    return abs(frequency / of_values - 1) <= NEAR


def _p2040_of_any_frequency(material: RadioMaterial) -> tuple[str | None, float | None]:
    """Find the row of P.2040 and the frequency (Hz) whose values a material has. σ tells the frequency."""
    for name, row in P2040.items():
        if row.d == 0 or material.conductivity == 0:
            continue
        frequency = 1e9 * (material.conductivity / row.c) ** (1 / row.d)
        if row.covers(frequency):
            permittivity, _ = row.values(frequency)
            if math.isclose(permittivity, material.relative_permittivity, rel_tol=ROUNDING):
                return name, frequency
    return None, None
