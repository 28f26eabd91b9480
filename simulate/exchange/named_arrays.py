"""Find positions and element responses among the arrays of a recording: by usual names, or by shapes that fit one way.

What is found is put into sentences. What neither names nor shapes tell is asked for.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Complex, Float

from scenes.files.errors import InputError, ParameterError, shown
from scenes.files.lengths import METRES
from simulate.exchange.array_files import Arrays
from simulate.exchange.magnitudes_and_phases import has_phases, polar_responses
from simulate.exchange.reading_options import Recording

POSITIONS = (
    *("positions", "position", "pos", "tx_pos", "txpos", "tx"),
    *("xyz", "locations", "location", "positions_m", "p"),
)
RESPONSES = ("responses", "response", "channels", "channel", "csi", "h", "y", "iq", "phasors", "phasor", "snapshots")
"""Usual names of arrays, without regard to case."""

RECEIVERS = ("receivers", "receiver", "rx_pos", "rxpos", "rx", "receivers_m", "receiver_positions", "rx_positions")
"""Usual names of the array with the receivers' positions, if both ends move."""

AXIS_AND_UNIT = r"[ _.\-]*(?P<axis>[xyz])[ _.\-]*[\[(]?(?P<unit>m|cm|mm|in|ft)?[\])]?"
COLUMN = re.compile("(?:tx|pos|position|p)?" + AXIS_AND_UNIT, re.IGNORECASE)
RECEIVER_COLUMN = re.compile("(?:rx|receiver)" + AXIS_AND_UNIT, re.IGNORECASE)
"""The name of a column with a coordinate, such as x, tx_y or ``z [mm]``, and of one of the receiver, such as rx_y."""

LISTED = 8  # Arrays that a message names

NO_PHASES = (
    "there are neither complex numbers nor phases, and powers alone (RSSI) are no responses: bisplat.write_dataset "
    "makes a folder of them"
)

FAR = 1000.0  # Metres. Positions that spread over more need a stated unit.


class Found(NamedTuple):
    """Positions, responses, and the receivers' positions if both ends move."""

    positions: Float[np.ndarray, "K 3"]  # metres
    responses: Complex[np.ndarray, "K elements *band"]  # with the elements in the order of the file
    receivers: Float[np.ndarray, "K 3"] | None  # metres

    def rows(self, kept: Bool[np.ndarray, " K"]) -> Found:
        receivers = None if self.receivers is None else self.receivers[kept]
        return Found(self.positions[kept], self.responses[kept], receivers)


def find_arrays(arrays: Arrays, recording: Recording, elements: int, said: list[str]) -> Found:
    arrays = {name: np.squeeze(each) if each.ndim > 2 else each for name, each in arrays.items()}
    positions, receivers = _places(arrays, recording, said)
    find = _responses if recording.bandwidth is None else _over_band
    return Found(positions, find(arrays, recording, len(positions), elements, said), receivers)


def _places(
    arrays: Arrays, recording: Recording, said: list[str]
) -> tuple[Float[np.ndarray, "K 3"], Float[np.ndarray, "K 3"] | None]:
    """The positions, and those of the receivers if both ends move, metres."""
    if recording.moving != "both":
        if recording.receivers is not None:
            raise ParameterError(
                "receivers", f"expected none unless both ends move, found some beside moving {recording.moving}"
            )
        return _positions(arrays, recording, recording.positions, said), None
    columns = [each for each in arrays if arrays[each].ndim == 1 and RECEIVER_COLUMN.fullmatch(each.strip())]
    usual = [each for each in arrays if _is_named(each, RECEIVERS) and each != recording.positions]
    name = recording.receivers or next(iter(usual), None)
    if name is None and not columns:
        raise InputError(
            f"expected an array of the receivers' positions, or --receivers NAME, beside --moving both, found "
            f"{_listed(arrays)}"
        )
    ours = {each: arrays[each] for each in (columns if name is None else arrays)}
    others = {each: values for each, values in arrays.items() if each not in (name, *columns)}
    receivers = _positions(ours, recording, name, said, "receivers", RECEIVER_COLUMN)
    positions = _positions(others, recording, recording.positions, said)
    if len(receivers) != len(positions):
        raise InputError(
            f"{name or ', '.join(columns)}: expected a row for each of the {len(positions)} positions, found "
            f"{len(receivers)}"
        )
    return positions, receivers


def _positions(
    arrays: Arrays,
    recording: Recording,
    name: str | None,
    said: list[str],
    what: str = "positions",
    column: re.Pattern[str] = COLUMN,
) -> Float[np.ndarray, "K 3"]:
    """Positions, metres: the array of a name, columns x, y, z, or the array of a usual name or the only fitting one."""
    stated = None
    if name is None:
        columns = {
            match["axis"].lower(): (each, (match["unit"] or "").lower())
            for each in arrays
            if arrays[each].ndim == 1 and (match := column.fullmatch(each.strip()))
        }
        axes = "xyz" if "z" in columns else "xy"  # positions in a plane
        flat = [each for each in arrays if _is_named(each, POSITIONS) and _is_flat(arrays[each])]
        if set(columns) == set(axes):
            names = [columns[axis][0] for axis in axes]
            units = {columns[axis][1] for axis in axes}
            name, found = ", ".join(names), np.stack([arrays[each] for each in names], axis=1)
            if len(units) > 1:
                raise InputError(f"{name}: expected one unit for all columns, found {len(units)} or columns without")
            stated = units.pop() or None
        else:
            wanted = "of K × 3 real numbers or columns x, y, z"
            name = flat[0] if len(flat) == 1 else _one_of(arrays, POSITIONS, _has_three, "positions", wanted)
            found = arrays[name]
    else:
        found = _named(arrays, name)
    if found.ndim == 2 and found.shape[0] == 3 and found.shape[1] != 3:
        said.append(f"transposed {name}, which has 3 rows")
        found = found.T
    if _is_flat(found):
        said.append(f"took the height 0 for all positions, since there are only x and y ({name})")
        found = np.column_stack([found, np.zeros(len(found))])
    if found.ndim != 2 or found.shape[1] != 3 or np.iscomplexobj(found):
        raise InputError(f"{name}: expected positions, K × 3 real numbers, found shape {found.shape}")
    if stated and recording.unit and stated != recording.unit:
        raise InputError(
            f"{name}: expected no other unit than that of the columns, {stated}, found --unit {recording.unit}"
        )
    known = recording.unit or stated
    metres = METRES[known or "m"]
    finite = found[np.isfinite(found).all(axis=1)]
    spread = float(np.ptp(finite, axis=0).max()) * metres if len(finite) else 0.0
    if known is None and spread > FAR:
        raise InputError(
            f"{name}: expected positions in metres, found a spread of {spread:,.0f}; state --unit mm or cm"
        )
    said.append(f"{what}: {name}, {len(found)} in {known or 'm'}{'' if known else ' (assumed; or state --unit)'}")
    return found.astype(float) * metres


def _responses(
    arrays: Arrays, recording: Recording, count: int, elements: int, said: list[str]
) -> Complex[np.ndarray, "K elements"]:
    if recording.responses is not None:
        name, found = recording.responses, _named(arrays, recording.responses)
    else:
        columns = [each for each, values in arrays.items() if values.ndim == 1 and np.iscomplexobj(values)]
        polar = polar_responses(arrays, said)
        if len(columns) == elements > 1:
            name, found = f"{columns[0]} to {columns[-1]}", np.stack([arrays[each] for each in columns], axis=1)
        elif polar is not None:
            name, found = polar
        else:
            what = f"of {count} positions × {elements} complex numbers"
            name = _one_of(arrays, RESPONSES, lambda each: np.iscomplexobj(each) and each.ndim > 1, "responses", what)
            found = arrays[name]
    if not np.iscomplexobj(found):
        raise InputError(f"{name}: expected complex responses, found real numbers")
    shape = found.shape
    if found.ndim == 1 and 1 in (count, elements):
        found = found.reshape(count, elements)
    if found.ndim == 3 and found.shape[0] == count and found.shape[1] * found.shape[2] == elements:
        said.append(f"took the axes of {name} for positions, rows and columns")
        found = found.reshape(count, elements)
    if found.shape == (elements, count) and count != elements:
        said.append(f"transposed {name}, which has {elements} rows")
        found = found.T
    if count == elements > 1:
        said.append(f"warning: {name} is square, so its shape does not tell its axes; took its rows for positions")
    if found.shape != (count, elements):
        band = "; --bandwidth says that one axis is that of subcarriers" if found.ndim == 3 else ""
        what = f"responses of {count} positions × {elements} elements"
        raise InputError(f"{name}: expected {what}, found shape {shape}{band}")
    said.append(f"responses: {name}, {count} × {elements}")
    return found


def _over_band(
    arrays: Arrays, recording: Recording, count: int, elements: int, said: list[str]
) -> Complex[np.ndarray, "K elements subcarriers"]:
    """Responses at subcarriers, with the array's axes in the order that fits."""
    what = f"of {count} positions × {elements} elements × subcarriers, complex"
    name = recording.responses
    if name is None:
        name = _one_of(arrays, RESPONSES, lambda each: np.iscomplexobj(each) and each.ndim == 3, "responses", what)
    found = _named(arrays, name)
    orders = [
        order
        for order in itertools.permutations(range(3))
        if found.ndim == 3 and (found.shape[order[0]], found.shape[order[1]]) == (count, elements)
    ]
    if not orders or not np.iscomplexobj(found) or (orders[0] != (0, 1, 2) and len(orders) > 1):
        raise InputError(f"{name}: expected responses {what}, found shape {found.shape}")
    if orders[0] != (0, 1, 2):
        names = np.array(["positions", "elements", "subcarriers"])
        said.append(f"took the axes of {name} for {', '.join(names[np.argsort(orders[0])])}")
    found = found.transpose(orders[0])
    said.append(f"responses: {name}, {count} × {elements} × {found.shape[2]} subcarriers over {recording.bandwidth}")
    return found


def _has_three(each: np.ndarray) -> bool:
    return not np.iscomplexobj(each) and each.ndim == 2 and 3 in each.shape


def _is_flat(each: np.ndarray) -> bool:
    """Whether these are positions in a plane, x and y."""
    return not np.iscomplexobj(each) and each.ndim == 2 and each.shape[1] == 2 and len(each) > 3


def _is_named(name: str, usual: tuple[str, ...]) -> bool:
    return name.lower().rpartition("/")[2] in usual


def _named(arrays: Arrays, name: str) -> np.ndarray:
    if name not in arrays:
        raise InputError(f"expected an array {shown(name)}, found {_listed(arrays)}")
    return arrays[name]


def _one_of(arrays: Arrays, usual: tuple[str, ...], fits: Callable[[np.ndarray], bool], what: str, shape: str) -> str:
    """The name of the array that has a usual name, or is the only one of its kind."""
    candidates = [name for name, each in arrays.items() if fits(each)]
    named = [name for name in candidates if _is_named(name, usual)]
    chosen = named if len(named) == 1 else candidates
    if len(chosen) == 1:
        return chosen[0]
    if not chosen:
        hint = "" if has_phases(arrays) else f"; {NO_PHASES}"
        raise InputError(f"expected {what}, an array {shape}, found {_listed(arrays)}{hint}")
    raise InputError(f"expected one array {shape}, or --{what} NAME, found {', '.join(chosen)}")


def _listed(arrays: Arrays) -> str:
    """The arrays with their shapes, for a message."""
    columns = [name for name, each in arrays.items() if each.ndim == 1]
    several = {name: each for name, each in arrays.items() if each.ndim != 1 or len(columns) == 1}
    some = [f"{name} {' × '.join(map(str, each.shape))}" for name, each in list(several.items())[:LISTED]]
    some += ["…"] * (len(several) > LISTED)
    if len(columns) > 1:
        lengths = sorted({len(arrays[name]) for name in columns})
        of = str(lengths[0]) if len(lengths) == 1 else f"{lengths[0]} to {lengths[-1]}"
        names = ", ".join(columns[:LISTED]) + (", …" if len(columns) > LISTED else "")
        some.append(f"{len(columns)} columns of {of} numbers ({names})")
    return ", ".join(some)
