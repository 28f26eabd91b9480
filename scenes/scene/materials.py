"""Radio materials: the power law of ITU-R P.2040 and the slab that a surface stands for."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from scenes.files.errors import InputError, did_you_mean, named, shown

RGB = tuple[float, float, float]

EXTRAPOLATION = 0.10
"""How far outside its stated range the power law may be used, as a fraction of the range's end. 915 MHz (RFID, LoRa) is
8.5 % below the 1 GHz where most rows begin."""


HIGHEST_PERMITTIVITY = 1e5
"""Ferroelectrics reach 10,000."""

HIGHEST_CONDUCTIVITY = 1e9
"""S/m; silver has 6.3e7."""

THICKEST = 1000.0
"""Metres of a slab; the ground is 1 m."""


@dataclass(frozen=True)
class RadioMaterial:
    """Radio properties of a surface.

    A triangle stands for a homogeneous slab of this material.

    Attributes:
        name: name of the material.
        relative_permittivity: real part ε_r, at least 1.
        conductivity: σ, S/m.
        thickness: of the slab, metres: of a wall drawn as a single sheet the wall's, of furniture drawn as a closed
            shell that of its boards or plates.
        scattering_coefficient: fraction S of the reflected amplitude that is diffuse, 0…1.
        xpd_coefficient: share K_x of the diffuse energy that changes polarisation, 0…1.
        color: red, green and blue for drawings, each 0…1.

    Raises:
        InputError: a value out of its range.

    >>> RadioMaterial("tile", relative_permittivity=6.5, conductivity=0.02, thickness=0.01).color
    (0.6, 0.6, 0.6)
    """

    name: str
    relative_permittivity: float
    conductivity: float
    thickness: float
    scattering_coefficient: float = 0.0
    xpd_coefficient: float = 0.0
    color: RGB = (0.6, 0.6, 0.6)

    def __post_init__(self) -> None:
        checks = (
            ("relative_permittivity", 1.0, HIGHEST_PERMITTIVITY, f"at least 1 and at most {HIGHEST_PERMITTIVITY:g}"),
            ("conductivity", 0.0, HIGHEST_CONDUCTIVITY, f"at least 0 S/m and at most {HIGHEST_CONDUCTIVITY:g} S/m"),
            ("thickness", 1e-6, THICKEST, f"more than 0 m and at most {THICKEST:g} m"),
            ("scattering_coefficient", 0.0, 1.0, "between 0 and 1"),
            ("xpd_coefficient", 0.0, 1.0, "between 0 and 1"),
        )
        for key, low, high, words in checks:
            value = getattr(self, key)
            if not low <= value <= high:
                raise InputError(f"material {named(self.name)}: {key} must be {words}, found {shown(value)}")
        if len(self.color) != 3 or not all(0 <= c <= 1 for c in self.color):
            raise InputError(f"material {named(self.name)}: color must be three numbers in 0..1")


@dataclass(frozen=True)
class P2040Row:
    """One row of ITU-R P.2040-3, Table 3, with a default thickness and a colour.

    Attributes:
        a: factor of ε_r = a f^b, f in GHz.
        b: exponent of ε_r.
        c: factor of σ = c f^d in S/m, f in GHz.
        d: exponent of σ.
        range_ghz: lowest and highest frequency of the row, GHz.
        thickness: default thickness of a slab, metres.
        color: red, green and blue for drawings, each 0…1.
    """

    a: float
    b: float
    c: float
    d: float
    range_ghz: tuple[float, float]
    thickness: float
    color: RGB


# The ranges that hold or come nearest to 1 GHz. The recommendation also has rows above 100 GHz.
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


def material_names() -> tuple[str, ...]:
    """Names that ``p2040_material`` knows, in the order of the recommendation's table.

    >>> material_names()[:6]
    ('concrete', 'brick', 'plasterboard', 'wood', 'glass', 'ceiling_board')
    """
    return tuple(P2040)


def p2040_material(
    name: str, frequency: float, thickness: float | None = None, scattering_coefficient: float = 0.0
) -> RadioMaterial:
    """A material by the power law of ITU-R P.2040-3 [itu2023], section 2.1.4:

        ε_r = a f^b,    σ = c f^d  [S/m],    f in GHz.

    Args:
        name: of ``material_names``.
        frequency: hertz.
        thickness: slab thickness, metres; the material's default if None.
        scattering_coefficient: fraction S of the reflected amplitude that is scattered diffusely.

    Returns:
        The material.

    Raises:
        InputError: unknown name, or a frequency more than 10 % outside the row's stated range.

    >>> brick = p2040_material("brick", 2.4e9, thickness=0.24)
    >>> brick.relative_permittivity, round(brick.conductivity, 4), brick.thickness
    (3.91, 0.0274, 0.24)
    """
    if name not in P2040:
        raise InputError(f"unknown material {named(name)}; {did_you_mean(name, P2040)}")
    row = P2040[name]
    f = frequency / 1e9
    low, high = row.range_ghz
    if not low * (1 - EXTRAPOLATION) <= f <= high * (1 + EXTRAPOLATION):
        raise InputError(
            f"material {named(name)} at {f:g} GHz: ITU-R P.2040 gives it for {low:g} to {high:g} GHz, which is "
            f"extrapolated by {EXTRAPOLATION:.0%} at most; "
            "give its relative_permittivity and conductivity yourself"
        )
    return RadioMaterial(
        name=name,
        relative_permittivity=row.a * f**row.b,
        conductivity=row.c * f**row.d,
        thickness=row.thickness if thickness is None else thickness,
        scattering_coefficient=scattering_coefficient,
        color=row.color,
    )


def p2040_materials(names: Iterable[str], frequency: float) -> dict[str, RadioMaterial]:
    """Several materials of ITU-R P.2040 at one frequency.

    Args:
        names: of ``material_names``; repeated names are allowed.
        frequency: hertz.

    Returns:
        Each material, by its name.

    Raises:
        InputError: as ``p2040_material``.

    >>> list(p2040_materials(["wood", "concrete", "wood"], 915e6))
    ['concrete', 'wood']
    """
    return {name: p2040_material(name, frequency) for name in sorted(set(names))}
