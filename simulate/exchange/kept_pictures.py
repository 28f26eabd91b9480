"""Which pictures of another program's folder are kept: those of one frequency, and one of each position."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from scenes.files.errors import InputError, ParameterError, shown
from scenes.scene.frequency import read_frequency
from simulate.dataset.dataset_frequency import SAME, Frequency, named, read_frequencies
from simulate.exchange.conversion import Conversion


@dataclass(frozen=True)
class Kept:
    """The pictures that are kept."""

    indices: Int[np.ndarray, " n"]  # their indices, ascending
    frequency: Frequency | None  # their frequency; None if nothing states it
    said: list[str]  # sentences on what was left out, and on where the frequency was read


def kept_pictures(
    folder: Path,
    positions: Float[np.ndarray, "K 3"],
    rows: Int[np.ndarray, " K"],
    conversion: Conversion,
    metadata: dict[str, Any],
) -> Kept:
    """Choose the pictures to keep."""
    path, kept, said = folder / "freq.txt", np.arange(len(positions)), list[str]()
    given = conversion.frequency if conversion.frequency is not None else metadata.get("frequency_hz")
    frequency = None if given is None else Frequency(read_frequency(given), "metadata")
    hertz = read_frequencies(path, rows) if os.path.lexists(path) else None
    if hertz is not None and frequency is not None:
        kept = np.flatnonzero(np.abs(hertz / frequency.hertz - 1) <= SAME)
        listed = named(hertz)
        if not len(kept) and conversion.frequency is None:
            raise InputError(f"{path}: expected the {frequency} of metadata.json, found {listed}")
        if not len(kept):
            raise ParameterError("frequency", f"expected one that freq.txt lists, {listed}, found {frequency}")
        if len(kept) < len(hertz):
            said.append(f"kept the pictures of {frequency}: {len(kept)} of {len(hertz)} (freq.txt lists {listed})")
    if conversion.one_per_position is not None:
        before = len(kept)
        kept = kept[_one_of_each(positions[kept], conversion.one_per_position)]
        said.append(f"kept picture {conversion.one_per_position} of each position: {len(kept)} of {before}")
    if hertz is not None and frequency is None:
        frequency = Frequency(float(hertz[kept[0]]), "freq.txt")
        if np.ptp(hertz[kept]) > SAME * frequency.hertz:
            raise InputError(
                f"{path}: expected one frequency for all pictures, found {named(hertz[kept])}; one dataset has one: "
                f'--frequency "{frequency}" keeps its pictures'
            )
        said.append(f"read the frequency from freq.txt: {frequency}")
    return Kept(kept, frequency, said)


def _one_of_each(positions: Float[np.ndarray, "K 3"], number: int) -> Int[np.ndarray, " n"]:
    """Indices of the N-th picture of each position, ascending."""
    _, places, counts = np.unique(positions, axis=0, return_inverse=True, return_counts=True)
    groups = np.split(np.argsort(places.ravel(), kind="stable"), np.cumsum(counts)[:-1])
    fewest = min(len(group) for group in groups)
    if not 1 <= number <= fewest:
        raise ParameterError("one_per_position", f"expected a number from 1 to {fewest}, found {shown(number)}")
    return np.sort([group[number - 1] for group in groups])
