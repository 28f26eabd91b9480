"""Read a carrier frequency, in hertz or with its unit. Megahertz and gigahertz where hertz are meant are recognised."""

from __future__ import annotations

import re
from numbers import Real

from scenes.files.errors import ParameterError, shown

LOWEST_FREQUENCY, HIGHEST_FREQUENCY = 1e6, 1e12
"""Hertz. The wavelength is 300 m at the lower end. Above the upper end, most surfaces are rough."""

HERTZ = {"hz": 1.0, "khz": 1e3, "mhz": 1e6, "ghz": 1e9}  # Units of frequency, in hertz

LONGEST_TEXT = 50
"""Most characters of a frequency. The time of the regular expression grows with the square of the length."""

USUAL = 1e7, 3e11
"""Lowest and highest frequency that a number without its unit is taken for in a hint, hertz."""


def read_frequency(value: float | str) -> float:
    return _read(value, "frequency", LOWEST_FREQUENCY, 'from 1e6 to 1e12, or a number with its unit such as "915 MHz"')


def read_bandwidth(value: float | str) -> float:
    return _read(value, "bandwidth", 1.0, 'at least 1, or a number with its unit such as "20 MHz"')


def _read(value: float | str, parameter: str, lowest: float, expected: str) -> float:
    number, unit = _parts(value)
    hertz = number * HERTZ[unit or "hz"]
    if lowest <= hertz <= HIGHEST_FREQUENCY:
        return hertz
    hint = _hint(number) if parameter == "frequency" and not unit else ""
    raise ParameterError(parameter, f"expected hertz, {expected}, found {shown(value)}{hint}")


def _parts(value: object) -> tuple[float, str]:
    """Return the number and the unit in lower case, or (0, "") for what is not a frequency."""
    if isinstance(value, Real) and not isinstance(value, bool):
        try:
            return float(value), ""
        except OverflowError:  # a huge integer
            return 0.0, ""
    if not isinstance(value, str) or len(value) > LONGEST_TEXT:
        return 0.0, ""
    match = re.fullmatch(r"\s*([-+]?[0-9]*\.?[0-9]*(?:[eE][-+]?[0-9]+)?)\s*([kKmMgG]?[hH][zZ])?\s*", value)
    try:
        return (float(match[1]), (match[2] or "").lower()) if match else (0.0, "")
    except ValueError:
        return 0.0, ""


def _hint(number: float) -> str:
    """Say what to write if a number is a usual frequency in another unit."""
    exponents = {"kHz": 3, "MHz": 6, "GHz": 9}
    usual = {unit: power for unit, power in exponents.items() if USUAL[0] <= number * 10.0**power <= USUAL[1]}
    if not usual:
        return ""
    return "; " + ", ".join(f"{number:.10g} {unit} are {number:.10g}e{power}" for unit, power in usual.items())
