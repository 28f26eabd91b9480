"""The frequency of a folder's spectra: stated in metadata.json, listed in freq.txt, or assumed."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from jaxtyping import Float, Int

from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError, ParameterError, shown
from scenes.files.input_file import MEGABYTE, read_text
from scenes.scene.description import SPEED_OF_LIGHT
from scenes.scene.frequency import read_frequency

FREQUENCIES = "freq.txt"  # File that lists the frequency of each picture, or one for all

NERF2_FREQUENCY = 915e6  # Hertz. NeRF²'s folders were measured in this RFID band, but do not state it.

USUAL_FREQUENCY = 2.4e9  # Hertz; of received powers and channels that do not state it

HIGHEST_GHZ = 300.0
"""Largest number of freq.txt without a unit that is read as GHz, as WideGS and XFreq-GS write it. Larger ones are MHz
below a million, such as 915, and otherwise hertz."""

SAME = 1e-4  # Relative difference up to which two frequencies are the same

LISTED = 10  # Most frequencies that a sentence lists

LARGEST_LIST = 20 * MEGABYTE  # Most bytes of freq.txt


@dataclass(frozen=True)
class Frequency:
    """The frequency of a folder; an assumed one of spectra is that of NeRF²'s measurements, 915 MHz."""

    hertz: float = NERF2_FREQUENCY
    source: Literal["metadata", "freq.txt", "assumed"] = "assumed"

    @property
    def wavelength(self) -> float:
        """Wavelength in air, metres."""
        return SPEED_OF_LIGHT / self.hertz

    def __str__(self) -> str:
        """The frequency with its unit."""
        giga = self.hertz >= 1e9
        return f"{self.hertz / (1e9 if giga else 1e6):.6g} {'GHz' if giga else 'MHz'}"


def stated_frequency(folder: Path, metadata: dict[str, Any], wanted: float | None) -> Frequency:
    """The frequency of a folder of received powers or channels, which has only one."""
    hertz = metadata.get("frequency_hz")
    found = Frequency(USUAL_FREQUENCY) if hertz is None else Frequency(read_frequency(hertz), "metadata")
    if wanted is not None and abs(found.hertz / wanted - 1) > SAME:
        raise InputError(f"{folder}: expected data of {Frequency(wanted)}, found those of {found}")
    return found


def frequency_of(
    folder: Path, metadata: dict[str, Any], rows: Int[np.ndarray, " K"], wanted: float | None = None
) -> tuple[Frequency, Int[np.ndarray, " n"]]:
    """The frequency of a dataset folder, and the indices of its pictures."""
    simulated = metadata.get("frequencies_hz", [])
    hertz = simulated[0] if len(simulated) == 1 else metadata.get("frequency_hz")
    stated = None if hertz is None else Frequency(read_frequency(hertz), "metadata")
    path, every = folder / FREQUENCIES, np.arange(len(rows))
    several = f"{path}: expected {named(np.array(simulated))}, as metadata.json lists"
    if not os.path.lexists(path):
        found = stated or Frequency()
        if len(simulated) > 1:
            raise InputError(f"{several}, found no such file")
        if wanted is not None and abs(found.hertz / wanted - 1) > SAME:
            raise InputError(f"{folder}: expected pictures of {Frequency(wanted)}, found those of {found}")
        return found, every
    listed = read_frequencies(path, rows)
    if len(simulated) > 1 and (other := _differing(listed, np.array(simulated))):
        raise InputError(f"{several}, one after the other, found {other}")
    if wanted is not None:
        chosen = np.flatnonzero(np.abs(listed / wanted - 1) <= SAME)
        if not len(chosen):
            raise InputError(f"{path}: expected pictures of {Frequency(wanted)}, found those of {named(listed)}")
        return Frequency(wanted, "freq.txt"), chosen
    lowest, highest = Frequency(float(listed.min()), "freq.txt"), Frequency(float(listed.max()), "freq.txt")
    if highest.hertz > (1 + SAME) * lowest.hertz:
        raise InputError(
            f"{path}: expected one frequency for all pictures, found {lowest} to {highest}; bisplat dataset keeps the "
            f'pictures of one, such as --frequency "{lowest}"'
        )
    if stated is not None and abs(stated.hertz / lowest.hertz - 1) > SAME:
        raise InputError(f"{path}: expected the {stated} of metadata.json, found {lowest}")
    return stated or lowest, every


def _differing(listed: Float[np.ndarray, " K"], simulated: Float[np.ndarray, " F"]) -> str | None:
    """How the frequencies of the pictures differ from those that a simulation wrote; None if they do not."""
    nearest = np.abs(listed[:, None] / simulated - 1)
    if nearest.min(axis=1).max(initial=0.0) > SAME:
        return named(listed)
    return "another order" if (np.diff(nearest.argmin(axis=1)) < 0).any() else None


def named(hertz: Float[np.ndarray, " K"]) -> str:
    """The different frequencies, for a sentence."""
    different = np.unique(hertz)
    more = ", …" if len(different) > LISTED else ""
    return ", ".join(str(Frequency(float(each))) for each in different[:LISTED]) + more


def read_frequencies(path: Path, rows: Int[np.ndarray, " K"]) -> Float[np.ndarray, " K"]:
    """Read freq.txt: a frequency for each picture, or one for all, with its unit or as WideGS and XFreq-GS write it."""
    listed = _lines(path)
    if len(listed) != 1 and len(listed) <= rows.max():
        raise InputError(
            f"{path}: expected a row for each picture, or one for all, found {len(listed)} rows for {len(rows)} "
            "pictures"
        )
    return np.repeat(listed, len(rows)) if len(listed) == 1 else listed[rows]


def several_frequencies(folder: Path) -> list[float]:
    """The frequencies of a folder with pictures of several ones, rising, Hz; empty if it has only one."""
    if not os.path.lexists(folder / FREQUENCIES):
        return []
    try:
        listed = np.unique(_lines(folder / FREQUENCIES))
    except InputError:
        return []
    return listed.tolist() if listed[-1] > (1 + SAME) * listed[0] else []


def _lines(path: Path) -> Float[np.ndarray, " lines"]:
    """The frequency in each line of freq.txt, Hz."""
    lines = read_text(path, "one frequency per line, in GHz", LARGEST_LIST).rstrip().split("\n")
    known: dict[str, float] = {}  # most lines are alike
    for row, line in enumerate(lines, start=1):
        if line not in known:
            known[line] = _hertz(line.strip(), path, row)
    return np.array([known[line] for line in lines])


def _hertz(text: str, path: Path, row: int) -> float:
    try:
        number = float(text) if text.isascii() and "_" not in text else np.nan
    except ValueError:
        number = np.nan
    if 0 < number < 1e6:
        text = f"{text} {'GHz' if number <= HIGHEST_GHZ else 'MHz'}"
    try:
        return read_frequency(text)
    except ParameterError:
        raise InputError(f"{path}, row {row}: expected a frequency in GHz, such as 3.5, found {shown(text)}") from None


def write_frequencies(path: Path, hertz: Float[np.ndarray, " K"]) -> None:
    """Write freq.txt: the frequency of each picture in GHz, as XFreq-GS reads it."""
    write_atomically(path, "".join(f"{each / 1e9:.9g}\n" for each in hertz.tolist()).encode())
