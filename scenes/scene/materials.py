"""Radio materials: the power law of ITU-R P.2040, the slab that a surface stands for, and its complex permittivity."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from decimal import Decimal

import numpy as np

from scenes.files.errors import InputError, ParameterError, did_you_mean, is_number, named, require_instance, shown
from scenes.scene.frequency import read_frequency

RGB = tuple[float, float, float]

EXTRAPOLATION = 0.10
"""How far outside its stated range the power law may be used, as a fraction of the range's end. The bands of RFID and
LoRa at 915 MHz are 8.5 % below 1 GHz, where most rows begin."""

HIGHEST_PERMITTIVITY = 1e5  # Largest relative permittivity. Ferroelectrics reach 10,000.

HIGHEST_CONDUCTIVITY = 1e9  # Largest conductivity, S/m. Silver has 6.3e7.

THICKEST = 1000.0  # Largest thickness of a slab, metres. The default for ground is 1 m.


@dataclass(frozen=True)
class RadioMaterial:
    """Radio properties of a surface at one frequency.

    A triangle stands for a homogeneous slab of the material with the complex relative permittivity::

        ε = ε_r − jσ / (ω ε₀)

    For a wall that is modelled as a single sheet, the thickness is that of the wall. For furniture that is modelled as
    a closed shell, it is the thickness of the boards or plates.

    Attributes:
        name: name of the material.
        relative_permittivity: real part ε_r, 1 to 100,000.
        conductivity: σ, S/m, 0 to 10⁹.
        thickness: thickness of the slab, metres, from 1 µm to 1 km.
        scattering_coefficient: fraction S of the reflected amplitude that is scattered diffusely, 0 to 1
            [degliesposti2007].
        xpd_coefficient: fraction K_x of the diffuse energy that changes its polarisation, 0 to 1.
        color: red, green and blue in drawings, each 0 to 1.
        frequency: Hz, at which permittivity and conductivity hold. None: unknown. It does not count when materials are
            compared.

    Raises:
        InputError: a value is out of its range.

    Example:
        >>> import bisplat
        >>> tile = bisplat.RadioMaterial("tile", relative_permittivity=6.5, conductivity=0.02, thickness=0.01)
        >>> tile.scattering_coefficient, tile.color
        (0.0, (0.6, 0.6, 0.6))
    """

    name: str
    relative_permittivity: float
    conductivity: float
    thickness: float
    scattering_coefficient: float = 0.0
    xpd_coefficient: float = 0.0
    color: RGB = (0.6, 0.6, 0.6)
    # Not in the text of a material, of which a scene's digest is made.
    frequency: float | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        checks = (
            ("relative_permittivity", 1.0, HIGHEST_PERMITTIVITY, f"at least 1 and at most {HIGHEST_PERMITTIVITY:g}"),
            ("conductivity", 0.0, HIGHEST_CONDUCTIVITY, f"at least 0 S/m and at most {HIGHEST_CONDUCTIVITY:g} S/m"),
            ("thickness", 1e-6, THICKEST, f"at least 1 µm and at most {THICKEST:g} m"),
            ("scattering_coefficient", 0.0, 1.0, "between 0 and 1"),
            ("xpd_coefficient", 0.0, 1.0, "between 0 and 1"),
        )
        for key, low, high, words in checks:
            value = getattr(self, key)
            if not (is_number(value) and low <= value <= high):
                raise InputError(f"material {named(self.name)}: {key}: expected {words}, found {shown(value)}")
        color = self.color if isinstance(self.color, Sequence | np.ndarray) else ()
        if len(color) != 3 or not all(is_number(c) and 0 <= c <= 1 for c in color):
            raise InputError(
                f"material {named(self.name)}: color: expected three numbers between 0 and 1, found {shown(self.color)}"
            )
        if self.frequency is not None and not (is_number(self.frequency) and 0 < self.frequency < math.inf):
            raise InputError(
                f"material {named(self.name)}: frequency: expected a positive number of hertz, found "
                f"{shown(self.frequency)}"
            )
        for key, *_ in checks:
            object.__setattr__(self, key, float(getattr(self, key)))
        object.__setattr__(self, "color", tuple(float(each) for each in color))


@dataclass(frozen=True)
class P2040Row:
    """A row of ITU-R P.2040-3 [itu2023], Table 3, with a default thickness and a colour."""

    a: float  # factor of ε_r = a f^b, with f in GHz
    b: float  # exponent of ε_r
    c: float  # factor of σ = c f^d in S/m, with f in GHz
    d: float  # exponent of σ
    range_ghz: tuple[float, float]  # lowest and highest frequency of the row, GHz
    thickness: float  # default thickness of the slab, metres
    color: RGB  # red, green and blue in drawings, each 0 to 1

    def values(self, frequency: float) -> tuple[float, float]:
        """ε_r and σ (S/m) at a frequency in Hz."""
        f = frequency / 1e9
        return self.a * _power(f, self.b), self.c * _power(f, self.d)

    def covers(self, frequency: float) -> bool:
        """Whether a frequency in Hz is in the row's range, or at most ``EXTRAPOLATION`` outside."""
        low, high = self.range_ghz
        return low * (1 - EXTRAPOLATION) <= frequency / 1e9 <= high * (1 + EXTRAPOLATION)


VALUES = "PERMITTIVITY,CONDUCTIVITY,THICKNESS"
"""What the option --own-material takes after the name and "=": ε_r, S/m and metres."""


def _power(base: float, exponent: float) -> float:
    """base^exponent, correctly rounded: the C library's last digit, and so a scene's digest, may differ elsewhere."""
    return float(Decimal(base) ** Decimal(exponent))


# Where the recommendation has several rows for a material, this is the one whose range is nearest to 1 GHz.
P2040 = {
    "concrete": P2040Row(5.24, 0, 0.0462, 0.7822, (1, 100), 0.20, (0.66, 0.66, 0.64)),
    "brick": P2040Row(3.91, 0, 0.0238, 0.16, (1, 40), 0.12, (0.72, 0.36, 0.28)),
    "plasterboard": P2040Row(2.73, 0, 0.0085, 0.9395, (1, 100), 0.025, (0.90, 0.86, 0.76)),
    "wood": P2040Row(1.99, 0, 0.0047, 1.0718, (0.001, 100), 0.03, (0.71, 0.50, 0.28)),
    "glass": P2040Row(6.31, 0, 0.0036, 1.3394, (0.1, 100), 0.006, (0.55, 0.80, 0.92)),
    "ceiling_board": P2040Row(1.48, 0, 0.0011, 1.0750, (1, 100), 0.015, (0.95, 0.95, 0.93)),
    "chipboard": P2040Row(2.58, 0, 0.0217, 0.78, (1, 100), 0.018, (0.85, 0.70, 0.45)),
    "plywood": P2040Row(2.71, 0, 0.33, 0, (1, 40), 0.018, (0.80, 0.62, 0.36)),
    "marble": P2040Row(7.074, 0, 0.0055, 0.9262, (1, 60), 0.02, (0.86, 0.84, 0.88)),
    "floorboard": P2040Row(3.66, 0, 0.0044, 1.3515, (50, 100), 0.015, (0.60, 0.42, 0.25)),
    "vinyl_tile": P2040Row(3.62, 0, 0.0051, 0.8422, (1, 40), 0.003, (0.58, 0.66, 0.60)),
    "carpet_tile": P2040Row(2.08, 0, 0.0009, 0.82, (1, 40), 0.006, (0.42, 0.45, 0.55)),
    "asphalt_concrete": P2040Row(4.83, 0, 0.0108, 1.3969, (1, 40), 0.10, (0.30, 0.30, 0.32)),
    "metal": P2040Row(1.0, 0, 1e7, 0, (1, 100), 0.002, (0.36, 0.44, 0.55)),
    "very_dry_ground": P2040Row(3.0, 0, 0.00015, 2.52, (1, 10), 1.0, (0.82, 0.72, 0.52)),
    "medium_dry_ground": P2040Row(15.0, -0.1, 0.035, 1.63, (1, 10), 1.0, (0.62, 0.50, 0.34)),
    "wet_ground": P2040Row(30.0, -0.4, 0.15, 1.30, (1, 10), 1.0, (0.42, 0.34, 0.24)),
}


def p2040_material(
    name: str, frequency: float, thickness: float | None = None, scattering_coefficient: float = 0.0
) -> RadioMaterial:
    """Return a material of ITU-R P.2040-3 at a frequency.

    Its properties follow the power law of the recommendation [itu2023], section 2.1.4, with f in GHz and σ in S/m::

        ε_r = a f^b,    σ = c f^d

    The recommendation has no thicknesses. The defaults are usual ones, such as 0.2 m for concrete.
    """
    if not isinstance(name, str) or name not in P2040:
        raise InputError(f"unknown material {named(name)}; {did_you_mean(name, P2040)}")
    row, frequency = P2040[name], read_frequency(frequency)
    if not row.covers(frequency):
        low, high = row.range_ghz
        raise InputError(
            f"material {named(name)}: expected a frequency within {EXTRAPOLATION:.0%} of the range of ITU-R P.2040, "
            f"{low:g} to {high:g} GHz, found {frequency / 1e9:g} GHz; for another one, give its values: as a "
            f"RadioMaterial, under materials in a scene YAML, or by --own-material {name}={VALUES}"
        )
    permittivity, conductivity = row.values(frequency)
    return RadioMaterial(
        name=name,
        relative_permittivity=permittivity,
        conductivity=conductivity,
        thickness=row.thickness if thickness is None else thickness,
        scattering_coefficient=scattering_coefficient,
        color=row.color,
        frequency=frequency,
    )


def p2040_materials(names: Iterable[str] | None, frequency: float) -> dict[str, RadioMaterial]:
    """Return materials of ITU-R P.2040-3 at one frequency, as ``Scene.materials`` needs them.

    Their properties follow the power law of the recommendation [itu2023], section 2.1.4. It has no thicknesses: the
    defaults are usual ones, such as 0.2 m for concrete. ``dataclasses.replace(material, thickness=…)`` changes one.

    Args:
        names: materials of the recommendation's Table 3, such as concrete, brick, plasterboard, wood, glass or metal;
            a name may occur several times. None: all that hold at the frequency.
        frequency: Hz.

    Returns:
        The materials, by name, in alphabetical order.

    Raises:
        InputError: a name is unknown, or the frequency is not in hertz or more than 10 % outside the range that the
            recommendation states for a material.

    Example:
        >>> import bisplat
        >>> list(bisplat.p2040_materials(["wood", "concrete", "wood"], 915e6))
        ['concrete', 'wood']
        >>> list(bisplat.p2040_materials(None, 915e6))[:4]
        ['asphalt_concrete', 'brick', 'carpet_tile', 'ceiling_board']
    """
    if names is None:
        names = [name for name, row in P2040.items() if row.covers(read_frequency(frequency))]
    if isinstance(names, str) or not isinstance(names, Iterable):
        raise ParameterError("names", f"expected a list of names of materials, found {shown(names)}")
    listed = list(names)
    for name in listed:
        require_instance(str, names=name)
    return {name: p2040_material(name, frequency) for name in sorted(set(listed))}


def p2040_source(material: RadioMaterial, frequency: float) -> str | None:
    """Return the row of ITU-R P.2040 whose power law gives exactly a material's permittivity and conductivity.

    A material whose values were changed, by hand or by calibration, has none.
    """
    values = (material.relative_permittivity, material.conductivity)
    for name in sorted(P2040, key=lambda name: name != material.name):
        if P2040[name].covers(frequency) and P2040[name].values(frequency) == values:
            return name
    return None


VACUUM_PERMITTIVITY = 8.8541878128e-12  # ε₀, farads per metre

VACUUM_PERMEABILITY = 1.25663706212e-6  # μ₀, henries per metre

LEAST_LOSS_OF_CONDUCTOR = 1000.0  # Materials with a larger loss σ/ωε₀ count as perfect conductors


def relative_permittivity(material: RadioMaterial, frequency: float) -> complex:
    """Return the complex relative permittivity ε_r − jσ/ωε₀."""
    return material.relative_permittivity - 1j * _loss(material, frequency)


def refractive_index(material: RadioMaterial, frequency: float) -> complex:
    """Return the complex refractive index √(ε_r − jσ/ωε₀)."""
    return complex(np.sqrt(relative_permittivity(material, frequency)))


def is_conductor(material: RadioMaterial, frequency: float) -> bool:
    """Whether a material counts as a perfect conductor."""
    return _loss(material, frequency) > LEAST_LOSS_OF_CONDUCTOR


def _loss(material: RadioMaterial, frequency: float) -> float:
    return material.conductivity / (2 * np.pi * frequency * VACUUM_PERMITTIVITY)
