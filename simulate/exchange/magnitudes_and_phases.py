"""Responses that are recorded as magnitudes and phases, in arrays or columns whose names tell the unit."""

from __future__ import annotations

import re

import numpy as np

from scenes.files.errors import InputError
from simulate.exchange.array_files import Arrays

MAGNITUDES = (
    *("magnitude", "magnitudes", "amplitude", "amplitudes", "mag", "abs", "mag_db", "power_db", "gain_db"),
    *("power_dbm", "rssi_dbm", "rssi"),
)
PHASES = ("phase", "phases", "phase_rad", "phase_deg", "angle", "angles", "angle_rad", "angle_deg")
"""Usual names, without regard to case. Of several, the first is taken."""

OF_ELEMENT = re.compile(
    r"(?P<stem>[a-z_]*[a-z])[ _.\-]?[\[(]?(?P<number>\d+)[\])]?(?:[ _.\-]?(?P<unit>dbm?|rad|deg))?", re.IGNORECASE
)
"""The name of the column of one element: a usual name with its number, such as mag0, phase_deg_3 or rssi1_dbm."""

TURN = 2 * np.pi + 1e-6  # Radians


def has_phases(arrays: Arrays) -> bool:
    """Whether a recording has complex numbers, or an array that is named after phases."""
    named = any(name.lower() in PHASES or _of_element(name)[0] in PHASES for name in arrays)
    return named or any(np.iscomplexobj(each) for each in arrays.values())


def polar_responses(arrays: Arrays, said: list[str]) -> tuple[str, np.ndarray] | None:
    """Responses from an array of magnitudes and one of phases, or from columns of them; None if there are none."""
    columns = _columns_of_elements(arrays)
    arrays = {name: np.stack([arrays[each] for each in names], axis=1) for name, names in columns.items()} | arrays
    by_name = {each.lower(): each for each in arrays}
    sizes = [by_name[each] for each in MAGNITUDES if each in by_name]
    angles = [by_name[each] for each in PHASES if each in by_name]
    if not sizes or not angles or arrays[sizes[0]].shape != arrays[angles[0]].shape:
        return None
    numbers = [[_of_element(each)[1] for each in columns[name]] for name in (sizes[0], angles[0]) if name in columns]
    if len(numbers) == 2 and numbers[0] != numbers[1]:
        return None
    for taken, *others in (sizes, angles):
        if others:
            said.append(f"took {taken} and left out {', '.join(others)}")
    listed = {name: f"{names[0]} to {names[-1]}" for name, names in columns.items()}
    called = " and ".join(listed.get(each, each) for each in (sizes[0], angles[0]))
    return called, _magnitudes(sizes[0], arrays, said) * np.exp(1j * _radians(angles[0], arrays, said))


def _of_element(name: str) -> tuple[str, int]:
    """The usual name and the number in the name of an element's column; an empty one if it is none."""
    match = OF_ELEMENT.fullmatch(name.strip())
    if match is None:
        return "", 0
    unit = f"_{match['unit']}" if match["unit"] else ""
    return (match["stem"] + unit).lower(), int(match["number"])


def _columns_of_elements(arrays: Arrays) -> dict[str, list[str]]:
    """The columns with numbers by their usual name, in the order of the numbers, unless an array has this name."""
    found: dict[str, dict[int, str]] = {}
    taken = {each.lower() for each in arrays}
    for each, values in arrays.items():
        name, number = _of_element(each)
        if values.ndim == 1 and not np.iscomplexobj(values) and name in MAGNITUDES + PHASES and name not in taken:
            found.setdefault(name, {})[number] = each
    names = {name: [columns[number] for number in sorted(columns)] for name, columns in found.items()}
    return {name: each for name, each in names.items() if len({len(arrays[column]) for column in each}) == 1}


def _magnitudes(name: str, arrays: Arrays, said: list[str]) -> np.ndarray:
    size = arrays[name].astype(float)
    if name.lower().startswith("rssi") or name.lower().endswith(("_db", "_dbm")):
        said.append(f"took {name} for decibels, as its name says")
        return 10 ** (size / 20)
    if (size < 0).any():
        raise InputError(f"{name}: expected magnitudes, found negative numbers; if they are decibels, name it mag_db")
    return size


def _radians(name: str, arrays: Arrays, said: list[str]) -> np.ndarray:
    angle = arrays[name].astype(float)
    if name.lower().endswith("_deg"):
        said.append(f"took {name} for degrees, as its name says")
        return np.radians(angle)
    if not name.lower().endswith("_rad") and np.nanmax(np.abs(angle)) > TURN:
        raise InputError(f"{name}: expected radians within a turn, found others; name it phase_deg or phase_rad")
    return angle
