"""Find positions and element responses among the arrays of a recording.

What is told by names and shapes is recognised, and every such conclusion is put into a sentence. What is not told is
asked for.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Complex, Float

from scenes.files.errors import InputError, ParameterError, shown
from scenes.importing.lengths import METRES
from simulate.dataset.dataset_frequency import SAME, Frequency, named
from simulate.exchange.array_files import Arrays
from simulate.exchange.polar import has_phases, polar_responses
from simulate.exchange.reading_options import Recording

POSITIONS = (
    "positions",
    "position",
    "pos",
    "tx_pos",
    "txpos",
    "tx",
    "xyz",
    "locations",
    "location",
    "positions_m",
    "p",
)
RESPONSES = ("responses", "response", "channels", "channel", "csi", "h", "y", "iq", "phasors", "phasor", "snapshots")
"""Usual names of arrays, without regard to case."""

RECEIVERS = ("receivers", "receiver", "rx_pos", "rxpos", "rx", "receivers_m", "receiver_positions", "rx_positions")
"""Usual names of the array with the receivers' positions, if both ends move."""

COLUMN = re.compile(
    r"(?:tx|pos|position|p)?[ _.\-]*(?P<axis>[xyz])[ _.\-]*[\[(]?(?P<unit>m|cm|mm|in|ft)?[\])]?", re.IGNORECASE
)
"""The name of a column with a coordinate, such as x, tx_y or ``z [mm]``."""

RECEIVER_COLUMN = re.compile(
    r"(?:rx|receiver)[ _.\-]*(?P<axis>[xyz])[ _.\-]*[\[(]?(?P<unit>m|cm|mm|in|ft)?[\])]?", re.IGNORECASE
)
"""The name of a column with a coordinate of the receiver, such as rx_y."""

LISTED = 8
"""Arrays that a message names."""

NO_PHASES = (
    "there are neither complex numbers nor phases, and powers alone (RSSI) are no responses: bisplat.write_rssi makes "
    "a folder of them"
)

FAR = 1000.0
"""Metres. Positions that spread over more are taken for another unit, unless it is stated."""


@dataclass
class Found:
    """What was recognised."""

    positions: Float[np.ndarray, "K 3"]  # metres
    responses: Complex[np.ndarray, "K elements *band"]  # with the elements in the order of the file
    unit_stated: bool  # whether the unit of the positions is stated; otherwise they were taken for metres
    receivers: Float[np.ndarray, "K 3"] | None = None  # metres, if both ends move; otherwise None
    said: list[str] = field(default_factory=list)  # sentences on what was recognised and assumed


def recognise(arrays: Arrays, recording: Recording, elements: int, hertz: float) -> Found:
    """Find the positions and the responses."""
    said: list[str] = []
    arrays = {name: np.squeeze(each) if each.ndim > 2 else each for name, each in arrays.items()}
    places, receivers, unit_stated = _places(arrays, recording, said)
    if recording.bandwidth is None:
        responses = _responses(arrays, recording, len(places), elements, said)
    else:
        responses = _over_band(arrays, recording, len(places), elements, said)
    kept = rows_of_frequency(arrays, len(places), hertz, said)
    places, responses = places[kept], responses[kept]
    receivers = None if receivers is None else receivers[kept]
    complete = complete_rows(places if receivers is None else np.hstack([places, receivers]), responses, said)
    places, responses = places[complete], responses[complete]
    receivers = None if receivers is None else receivers[complete]
    if recording.round_trip:
        responses = one_way(responses, said)
    return Found(places, responses, unit_stated, receivers, said)


def _places(
    arrays: Arrays, recording: Recording, said: list[str]
) -> tuple[Float[np.ndarray, "K 3"], Float[np.ndarray, "K 3"] | None, bool]:
    """The positions, those of the receivers if both ends move, metres, and whether their unit is stated."""
    if recording.moving != "both":
        if recording.receivers is not None:
            raise ParameterError(
                "receivers", f"expected none unless both ends move, found some beside moving {recording.moving}"
            )
        positions, unit_stated = _positions(arrays, recording, recording.positions, said)
        return positions, None, unit_stated
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
    receivers, _ = _positions(ours, recording, name, said, "receivers", RECEIVER_COLUMN)
    positions, unit_stated = _positions(others, recording, recording.positions, said)
    if len(receivers) != len(positions):
        raise InputError(
            f"{name or ', '.join(columns)}: expected a row for each of the {len(positions)} positions, found "
            f"{len(receivers)}"
        )
    return positions, receivers, unit_stated


def _positions(
    arrays: Arrays,
    recording: Recording,
    name: str | None,
    said: list[str],
    what: str = "positions",
    column: re.Pattern[str] = COLUMN,
) -> tuple[Float[np.ndarray, "K 3"], bool]:
    """Positions, metres, and whether their unit is stated: the array of a name, or what seems to hold them."""
    stated, unit = None, recording.unit
    if name is not None:
        found = _named(arrays, name)
    else:
        by_axis = {
            match["axis"].lower(): (each, (match["unit"] or "").lower())
            for each in arrays
            if arrays[each].ndim == 1 and (match := column.fullmatch(each.strip()))
        }
        axes = "xyz" if "z" in by_axis else "xy"  # positions in a plane
        if set(by_axis) == set(axes):
            names = [by_axis[axis][0] for axis in axes]
            units = {by_axis[axis][1] for axis in axes}
            name, found = ", ".join(names), np.stack([arrays[each] for each in names], axis=1)
            stated = units.pop() if len(units) == 1 else None
        else:
            flat = [each for each in arrays if _is_named(each, POSITIONS) and _is_flat(arrays[each])]
            name = flat[0] if len(flat) == 1 else ""
            name = name or _one_of(
                arrays, POSITIONS, _could_be_positions, "positions", "of K × 3 real numbers or columns x, y, z"
            )
            found = arrays[name]
    if found.ndim == 2 and found.shape[0] == 3 and found.shape[1] != 3:
        said.append(f"transposed {name}, which has 3 rows")
        found = found.T
    if _is_flat(found):
        said.append(f"took the height 0 for all positions, since there are only x and y ({name})")
        found = np.column_stack([found, np.zeros(len(found))])
    if found.ndim != 2 or found.shape[1] != 3 or np.iscomplexobj(found):
        raise InputError(f"{name}: expected positions, K × 3 real numbers, found shape {found.shape}")
    if stated and unit and stated != unit:
        raise InputError(f"{name}: expected no other unit than that of the columns, {stated}, found --unit {unit}")
    known = unit or stated
    metres = METRES[known or "m"]
    finite = found[np.isfinite(found).all(axis=1)]
    spread = float(np.ptp(finite, axis=0).max()) * metres if len(finite) else 0.0
    if known is None and spread > FAR:
        raise InputError(
            f"{name}: expected positions in metres, found a spread of {spread:,.0f}; state --unit mm or cm"
        )
    said.append(f"{what}: {name}, {len(found)} in {known or 'm'}{'' if known else ' (assumed; or state --unit)'}")
    return found.astype(float) * metres, known is not None


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
    """Responses at subcarriers, whatever the order of the array's axes."""
    what = f"of {count} positions × {elements} elements × subcarriers, complex"
    name = recording.responses
    if name is None:
        name = _one_of(arrays, RESPONSES, lambda each: np.iscomplexobj(each) and each.ndim == 3, "responses", what)
    found = _named(arrays, name)
    if found.ndim != 3 or not np.iscomplexobj(found):
        raise InputError(f"{name}: expected responses {what}, found shape {found.shape}")
    orders = [
        order
        for order in itertools.permutations(range(3))
        if (found.shape[order[0]], found.shape[order[1]]) == (count, elements)
    ]
    if not orders:
        raise InputError(f"{name}: expected responses {what}, found shape {found.shape}")
    if orders[0] != (0, 1, 2):
        names = np.array(["positions", "elements", "subcarriers"])
        order = ", ".join(names[np.argsort(orders[0])])
        said.append(f"took the axes of {name} for {order}")
    found = found.transpose(orders[0])
    said.append(f"responses: {name}, {count} × {elements} × {found.shape[2]} subcarriers over {recording.bandwidth}")
    return found


def _could_be_positions(each: np.ndarray) -> bool:
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
    option = f"--{what} NAME"
    if not chosen:
        hint = "" if has_phases(arrays) else f"; {NO_PHASES}"
        raise InputError(f"expected {what}, an array {shape}, found {_listed(arrays)}{hint}")
    raise InputError(f"expected one array {shape}, or {option}, found {', '.join(chosen)}")


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


FREQUENCIES = ("frequency", "frequencies", "freq", "frequency_hz", "freq_hz", "carrier", "carrier_hz")
"""Usual names of arrays with the frequency of each row, without regard to case."""

JUMP = 0.75 * np.pi
"""Radians. A phase that changes by more from element to element cannot be followed for certain."""


def rows_of_frequency(arrays: Arrays, count: int, hertz: float, said: list[str]) -> Bool[np.ndarray, " count"]:
    """Whether each row is of the stated frequency. A recording of one frequency states it for no row."""
    for name, each in arrays.items():
        if name.lower().rpartition("/")[2] in FREQUENCIES and each.shape == (count,) and not np.iscomplexobj(each):
            chosen = np.abs(each / hertz - 1) <= SAME
            if not chosen.any():
                raise InputError(f"{name}: expected rows of {Frequency(hertz)}, found those of {named(each)}")
            if not chosen.all():
                said.append(
                    f"kept the rows of {Frequency(hertz)}: {chosen.sum()} of {count} ({name} has {named(each)})"
                )
            return chosen
    return np.ones(count, bool)


def complete_rows(
    places: Float[np.ndarray, "K coordinates"], responses: Complex[np.ndarray, "K elements *band"], said: list[str]
) -> Bool[np.ndarray, " K"]:
    """Whether each row has finite positions, and a finite response at every element."""
    placed = np.isfinite(places).all(axis=1)
    complete = np.isfinite(responses).reshape(len(responses), -1).all(axis=1)
    if not (placed & complete).any():
        raise InputError(
            f"expected rows with a finite position, and a finite response at every element, found none among "
            f"{len(complete)}"
        )
    if not placed.all():
        said.append(f"left out {int((~placed).sum())} of {len(placed)} rows, which lack a finite position")
    if not complete.all():
        left = int((~complete).sum())
        said.append(f"left out {left} of {len(complete)} rows, which lack a finite response at some element")
    return placed & complete


def one_way(responses: Complex[np.ndarray, "K elements"], said: list[str]) -> Complex[np.ndarray, "K elements"]:
    """The one-way field of a tag that the same antenna reads, whose responses are the squares of it.

    The root of a complex number is known up to its sign. From element to element the sign follows from the phase,
    which must change by less than half a turn. From position to position it stays unknown.
    """
    angle = np.unwrap(np.angle(responses), axis=1)
    jumps = np.abs(np.diff(angle, axis=1)) > JUMP
    said.append("took the roots of the responses, whose phases are those of the way to the tag and back")
    if jumps.any():
        share = jumps.any(axis=1).mean()
        said.append(
            f"warning: in {share:.0%} of the rows the phase changes by more than {np.degrees(JUMP):.0f}° between two "
            "elements, so that the sign of the root may be wrong there"
        )
    return np.sqrt(np.abs(responses)) * np.exp(0.5j * angle)
