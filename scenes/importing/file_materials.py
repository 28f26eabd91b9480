"""Which radio material the name of a material stands for, and its values at a frequency."""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping
from dataclasses import replace

from scenes.files.errors import InputError, did_you_mean, named
from scenes.importing.formats.mesh_part import short_name
from scenes.scene.materials import P2040, OutsideP2040, RadioMaterial, p2040_material

VALUES = "PERMITTIVITY,CONDUCTIVITY,THICKNESS"
"""What the option --own-material takes after the name and "=": ε_r, S/m and metres."""


def known_material(name: str, own: Mapping[str, RadioMaterial]) -> str | None:
    """The material that a name stands for; case, spaces, "mat-", "itu_" and Blender's number do not count."""
    table = {_plain(known): known for known in (*P2040, *own)}
    return name if name in own else table.get(_plain(name))


def _plain(name: str) -> str:
    bare = re.sub(r"^(mat-)?(itu[_-])?", "", short_name(name.strip()), flags=re.IGNORECASE)
    return re.sub(r"[ -]", "_", bare).casefold()


def require_known(name: str, own: Mapping[str, RadioMaterial]) -> None:
    """Refuse the name of a material that is neither the user's own nor one of ITU-R P.2040."""
    known = (*own, *P2040)
    if name in known:
        return
    hint = did_you_mean(name, known)
    if not hint.endswith("?"):
        hint += f" (or give its values: --own-material {shlex.quote(f'{name}={VALUES}')})"
    raise InputError(f"unknown material {named(name)}; {hint}")


def material_at(name: str, frequency: float, own: Mapping[str, RadioMaterial]) -> RadioMaterial:
    if name in own:
        return replace(own[name], name=name)
    try:
        return p2040_material(name, frequency)
    except OutsideP2040 as error:
        advice = f"for another one, give its values: --own-material {shlex.quote(f'{name}={VALUES}')}"
        raise OutsideP2040(error.name, error.frequency, advice) from None


def proposed_rule(name: str) -> str:
    """Write a rule for a name, without its material, that the user can copy into a shell. No option begins with "?"."""
    return shlex.quote(f"?{name[1:]}=MATERIAL" if name.startswith("-") else f"{name}=MATERIAL")
