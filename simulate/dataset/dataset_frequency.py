"""The frequency of a folder's spectra: stated in metadata.json, listed in freq.txt, or assumed."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from jaxtyping import Float, Int

from scenes.files.errors import InputError, ParameterError, shown
from scenes.files.input_file import MEGABYTE, read_text
from scenes.scene.description import SPEED_OF_LIGHT
from scenes.scene.frequency import read_frequency

NERF2_FREQUENCY = 915e6
"""Hertz. NeRF²'s folders were measured in this RFID band, but do not state it."""

HIGHEST_GHZ = 300.0
"""Largest number of freq.txt without a unit that is read as GHz, as WideGS and XFreq-GS write it. Larger ones are MHz
below a million, such as 915, and otherwise hertz."""

SAME = 1e-4
"""Relative difference up to which two frequencies are the same."""

LARGEST_LIST = 20 * MEGABYTE
"""Most bytes of freq.txt."""


@dataclass(frozen=True)
class Frequency:
    """The frequency of a folder's spectra.

    Attributes:
        hertz: the frequency, Hz.
        source: how it is known: "metadata" (metadata.json states it), "freq.txt", or "assumed". Then it is the 915 MHz
            of NeRF²'s measurements.
    """

    hertz: float = NERF2_FREQUENCY
    source: Literal["metadata", "freq.txt", "assumed"] = "assumed"

    @property
    def wavelength(self) -> float:
        """Wavelength in air, metres."""
        return SPEED_OF_LIGHT / self.hertz

    def __str__(self) -> str:
        """The frequency with its unit.

        >>> str(Frequency(3.5e9)), str(Frequency())
        ('3.5 GHz', '915 MHz')
        """
        giga = self.hertz >= 1e9
        return f"{self.hertz / (1e9 if giga else 1e6):.6g} {'GHz' if giga else 'MHz'}"


def frequency_of(folder: Path, metadata: dict[str, Any], rows: Int[np.ndarray, " K"], problems: list[str]) -> Frequency:
    """The frequency of a dataset folder.

    Args:
        folder: the folder.
        metadata: content of its metadata.json, from ``read_metadata_file``.
        rows: row of each picture in freq.txt, from 0.
        problems: a sentence is appended if freq.txt is faulty, lists several frequencies, or contradicts metadata.json.
    """
    stated = Frequency(read_frequency(metadata["frequency_hz"]), "metadata") if "frequency_hz" in metadata else None
    path = folder / "freq.txt"
    if not os.path.lexists(path):
        return stated or Frequency()
    try:
        listed = read_frequencies(path, rows)
    except InputError as error:
        problems.append(str(error))
        return stated or Frequency()
    lowest, highest = Frequency(float(listed.min()), "freq.txt"), Frequency(float(listed.max()), "freq.txt")
    if highest.hertz > (1 + SAME) * lowest.hertz:
        problems.append(
            f"{path}: expected one frequency for all pictures, found {lowest} to {highest}; bisplat convert keeps the "
            f'pictures of one, such as --frequency "{lowest}"'
        )
    elif stated is not None and abs(stated.hertz / lowest.hertz - 1) > SAME:
        problems.append(f"{path}: expected the {stated} of metadata.json, found {lowest}")
    return stated or lowest


def read_frequencies(path: Path, rows: Int[np.ndarray, " K"]) -> Float[np.ndarray, " K"]:
    """Read freq.txt: a frequency for each picture, or one for all, with its unit or as WideGS and XFreq-GS write it.

    Args:
        path: the file.
        rows: row of each picture, from 0.

    Returns:
        Frequencies, Hz, one for each picture.

    Raises:
        InputError: the file cannot be read, lacks rows, or a row is not a frequency.
    """
    lines = read_text(path, "one frequency per line, in GHz", LARGEST_LIST).rstrip().split("\n")
    if len(lines) != 1 and len(lines) <= rows.max():
        raise InputError(
            f"{path}: expected a row for each picture, or one for all, found {len(lines)} rows for {len(rows)} pictures"
        )
    known: dict[str, float] = {}  # most lines are alike
    for row, line in enumerate(lines, start=1):
        if line not in known:
            known[line] = _hertz(line.strip(), path, row)
    listed = np.array([known[line] for line in lines])
    return np.repeat(listed, len(rows)) if len(lines) == 1 else listed[rows]


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
