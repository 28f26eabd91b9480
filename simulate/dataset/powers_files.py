"""Read the files of a folder of received powers (RSSI), with one function for each.

NeRF² takes the gateways in the order of ``gateway_position.yml``, and the powers in that of the columns; GSRF goes by
their names. Both number the positions from 0.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping, Sequence
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from scenes.files.errors import InputError, ParameterError, check_array, named, reason, shown
from scenes.files.input_file import MEGABYTE, parse_number, read_text
from scenes.files.json_yaml_xml import read_yaml
from scenes.files.schema import conform
from simulate.dataset.dataset_kinds import NOT_RECEIVED, STRONGEST
from simulate.dataset.inspection import Coordinate
from simulate.positions.positions import MOST_POSITIONS, check_points

MOST_GATEWAYS = 1000  # Most gateways of a dataset

LONGEST_GATEWAY_NAME = 100  # Most characters in the name of a gateway

LARGEST_POWERS = 400 * MEGABYTE
"""Most bytes of gateway_rssi.csv. A million positions and 60 gateways take 300 MB."""


def read_gateway_positions(path: Path) -> dict[str, Float[np.ndarray, " 3"]]:
    """Read gateway_position.yml: the position of each gateway, metres, by its name, in the order of the file."""
    return {
        name: np.array(conform(value, tuple[Coordinate, Coordinate, Coordinate], place, numbers_as_text=True), float)
        for name, value, place in gateway_entries(path, "the position [x, y, z] of each gateway by its name")
    }


def gateway_entries(path: Path, expected: str) -> Iterator[tuple[str, Any, str]]:
    """The gateways of a YAML file: name, value, and the beginning of a message on it, in the order of the file."""
    content = read_yaml(path, expected)
    if not isinstance(content, dict) or not content:
        raise InputError(f"{path}: expected {expected}, found {'nothing' if content is None else shown(content)}")
    if len(content) > MOST_GATEWAYS:
        raise InputError(f"{path}: expected at most {MOST_GATEWAYS} gateways, found {len(content)}")
    for key, value in content.items():
        name = gateway_name(str(key), str(path))
        yield name, value, f"{path}: {named(name)}"


def gateway_name(name: str, where: str) -> str:
    """Check the name of a gateway."""
    if not (name and name == name.strip() and name.isprintable() and len(name) <= LONGEST_GATEWAY_NAME):
        raise InputError(
            f"{where}: expected a gateway's name of 1 to {LONGEST_GATEWAY_NAME} printable characters, "
            f"found {shown(name)}"
        )
    return name


def read_power_table(path: Path) -> tuple[list[str], Float[np.ndarray, "K G"]]:
    """Read gateway_rssi.csv: the names of the gateways, and a row of powers for each position."""
    text = read_text(path, "a CSV of received powers", LARGEST_POWERS)
    try:
        rows = csv.reader(StringIO(text, newline=""))
        names = _names(path, next(rows, []))
        powers = np.array(list(_rows(path, rows, names)), dtype=float)
    except csv.Error as error:
        found = f"found a file that is not a CSV ({reason(error)})"
        raise InputError(f"{path}: expected a CSV of received powers, {found}") from error
    if not len(powers):
        raise InputError(f"{path}: expected at least one row of powers after the header, found none")
    return names, powers


def _names(path: Path, header: list[str]) -> list[str]:
    names = [name.strip() for name in header]
    found = shown(",".join(header)) if names else "an empty file or line"
    if len(names) == 1 and {";", "\t"} & set(header[0]):
        raise InputError(f"{path}, line 1: expected columns separated by commas, found others in {found}")
    if not names or all(_is_number(name) for name in names):
        raise InputError(f"{path}, line 1: expected a header with the name of each gateway, found {found}")
    if len(names) > MOST_GATEWAYS:
        raise InputError(f"{path}, line 1: expected at most {MOST_GATEWAYS} gateways, found {len(names)}")
    for name in names:
        gateway_name(name, f"{path}, line 1")
        if names.count(name) > 1:
            raise InputError(f"{path}, line 1: expected each gateway once, found {named(name)} more than once")
    return names


def _is_number(text: str) -> bool:
    try:
        parse_number(text)
    except ValueError:
        return False
    return "." in text or text.startswith("-")  # gateways may be numbered


def _rows(path: Path, rows: Iterator[list[str]], names: list[str]) -> Iterator[list[float]]:
    for number, row in enumerate(rows, start=1):
        if number > MOST_POSITIONS:
            raise InputError(f"{path}: expected at most {MOST_POSITIONS} rows of powers, found more")
        where = f"{path}, position {number} (line {number + 1})"
        if len(row) != len(names):
            found = f"{len(row)} numbers" if row else "an empty line"
            hint = "; decimals need a point, not a comma" if len(row) == 2 * len(names) else ""
            raise InputError(f"{where}: expected a power for each of the {len(names)} gateways, found {found}{hint}")
        powers = []
        for name, text in zip(names, row, strict=True):
            try:
                power = parse_number(text)
            except ValueError:
                power = np.nan
            if not np.isfinite(power):
                expected = f"a power in dBm, or {NOT_RECEIVED:g} where nothing was received"
                raise InputError(f"{where}, {named(name)}: expected {expected}, found {shown(text)}")
            powers.append(power)
        yield powers


def own_gateways(given: Mapping[str, Sequence[float]] | None) -> dict[str, list[float]]:
    """Check the positions of gateways from Python."""
    if not isinstance(given, Mapping) or not given:
        raise ParameterError("gateways", f"expected the position of each gateway by its name, found {shown(given)}")
    if len(given) > MOST_GATEWAYS:
        raise ParameterError("gateways", f"expected at most {MOST_GATEWAYS} gateways, found {len(given)}")
    at = {}
    for name, position in given.items():
        if not isinstance(name, str):
            raise ParameterError("gateways", f"expected texts as names, found {shown(name)}")
        try:
            gateway_name(name, "")
        except InputError as error:
            raise ParameterError("gateways", str(error).removeprefix(": ")) from None
        point = check_array("gateways", position, (3,), f"a position x, y, z of {named(name)}")
        at[name] = check_points([point], "gateways")[0].tolist()
    return at


def fault_of_powers(powers: Float[np.ndarray, "K G"], stated: bool = False) -> str | None:
    """A sentence on powers that cannot be in dBm; None if they can."""
    received = powers[~np.isnan(powers)]
    if not received.size:
        return None
    low, high = received.min(), received.max()
    if low >= 0 and high > 0 and not stated:
        found = f"expected powers in dBm, found {low:.4g} to {high:.4g}"
        if high <= 1:
            return f"{found}, which look like linear powers: take 10 log10 of milliwatts"
        return f"{found}, all positive: is the minus sign missing?"
    if high > STRONGEST:
        row, column = np.argwhere(powers == high)[0]
        found = f"expected powers of at most {STRONGEST:g} dBm, found {high:.4g} at position {row}, gateway {column}"
        # UJIIndoorLoc marks so that nothing was received.
        return f"{found}; if it means that nothing was received, put {NOT_RECEIVED:g} there" if high == 100 else found
    return None


def own_powers(given: Float[ArrayLike, "K G"], count: int, gateways: int) -> Float[np.ndarray, "K G"]:
    """Check powers from Python; the messages name what people most often mix up."""
    what = f"powers of {count} positions × {gateways} gateways"
    shape = np.shape(given) if isinstance(given, np.ndarray) else ()
    if shape == (gateways, count) and gateways != count:
        raise ParameterError("powers", f"expected {what}, found {gateways} × {count}: transpose them (.T)")
    powers = check_array("powers", given, (count, gateways), what, finite=False)
    if np.isinf(powers).any():
        row, column = np.argwhere(np.isinf(powers))[0]
        found = f"found {powers[row, column]} at position {row}, gateway {column}"
        raise ParameterError("powers", f"expected finite powers, or NaN where nothing was received, {found}")
    fault = fault_of_powers(powers)
    if fault is not None:
        raise ParameterError("powers", fault)
    return powers
