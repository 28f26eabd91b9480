"""Which rows of a recording are kept: those of one frequency, with a response at every element."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Complex, Float

from scenes.files.errors import InputError
from simulate.dataset.dataset_frequency import SAME, Frequency, named
from simulate.exchange.array_files import Arrays

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
