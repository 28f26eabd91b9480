"""Responses recorded as magnitudes and phases. Their units are told by the arrays' names, or else by their values."""

from __future__ import annotations

import numpy as np

from simulate.exchange.array_files import Arrays

MAGNITUDES = (
    *("magnitude", "magnitudes", "amplitude", "amplitudes", "mag", "abs", "power_db", "gain_db", "power_dbm"),
    *("rssi_dbm", "rssi"),
)
PHASES = ("phase", "phases", "phase_rad", "phase_deg", "angle", "angles", "angle_rad", "angle_deg")
"""Usual names, without regard to case. Of several, the first is taken."""

ABOVE_A_TURN = 2 * np.pi + 1e-6
"""Radians."""


def has_phases(arrays: Arrays) -> bool:
    """Whether a recording has complex numbers, or an array that is named after phases.

    >>> has_phases({"mag1": np.ones(2), "phase1": np.ones(2)}), has_phases({"rssi1": np.ones(2)})
    (True, False)
    """
    return any(np.iscomplexobj(each) or name.lower().rstrip("0123456789_- ") in PHASES for name, each in arrays.items())


def polar_responses(arrays: Arrays, said: list[str]) -> tuple[str, np.ndarray] | None:
    """Responses from an array of magnitudes and one of phases of the same shape; None if there are none.

    Args:
        arrays: all arrays of the recording.
        said: sentences on what was taken for what are appended.

    Returns:
        What the arrays are called, and the complex responses.

    >>> said = []
    >>> found = {"RSSI": np.array([-6.0206, 0.0]), "phase_deg": np.array([0.5, 1.0])}
    >>> name, responses = polar_responses(found, said)
    >>> name, np.abs(responses).round(3).tolist(), np.degrees(np.angle(responses)).round(3).tolist()
    ('RSSI and phase_deg', [0.5, 1.0], [0.5, 1.0])
    >>> said
    ['took RSSI for decibels, as its name says', 'took phase_deg for degrees, as its name says']
    """
    by_name = {each.lower(): each for each in arrays}
    sizes = [by_name[each] for each in MAGNITUDES if each in by_name]
    angles = [by_name[each] for each in PHASES if each in by_name]
    if not sizes or not angles or arrays[sizes[0]].shape != arrays[angles[0]].shape:
        return None
    for taken, others in ((sizes[0], sizes[1:]), (angles[0], angles[1:])):
        if others:
            said.append(f"took {taken} and left out {', '.join(others)}")
    return f"{sizes[0]} and {angles[0]}", _magnitudes(sizes[0], arrays, said) * np.exp(
        1j * _radians(angles[0], arrays, said)
    )


def _magnitudes(name: str, arrays: Arrays, said: list[str]) -> np.ndarray:
    size = arrays[name].astype(float)
    named = name.lower().startswith("rssi") or name.lower().endswith(("_db", "_dbm"))
    if not named and not (size < 0).any():
        return size
    said.append(f"took {name} for decibels, {'as its name says' if named else 'since some are negative'}")
    return 10 ** (size / 20)


def _radians(name: str, arrays: Arrays, said: list[str]) -> np.ndarray:
    angle = arrays[name].astype(float)
    named = name.lower().endswith("_deg")
    if not named and (name.lower().endswith("_rad") or not np.nanmax(np.abs(angle)) > ABOVE_A_TURN):
        return angle
    said.append(f"took {name} for degrees, {'as its name says' if named else 'since some are above 2π'}")
    return np.radians(angle)
