"""The CSV of located transmitters: a row for each place where one may be."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from io import StringIO
from pathlib import Path

import numpy as np

from learn.localisation.locate import Place
from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError, shown
from scenes.files.input_file import MEGABYTE, parse_number, read_text

LARGEST = 100 * MEGABYTE
"""Largest size of the CSV, bytes."""

WITHOUT_PART = ("name", "place", "probability", "x", "y", "z", "xx", "xy", "xz", "yy", "yz", "zz", "misfit")
"""The header of earlier versions."""

HEADER = (*WITHOUT_PART, "part")
"""Name of the picture, number of the place (1 is the most probable), its probability, position (metres), covariance
(square metres), squared distance of the fingerprints there, and the part of the run's split that the picture is of:
train, validation, test, or new."""

NEW = "new"
"""Part of a picture that is not of the run's dataset."""


def write_places(
    path: Path, names: Sequence[str], places: Sequence[Sequence[Place]], parts: Sequence[str] | None = None
) -> None:
    """Write the CSV."""
    parts = parts or [NEW] * len(names)
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(HEADER)
    for name, of_one, part in zip(names, places, parts, strict=True):
        for number, place in enumerate(of_one, start=1):
            covariance = place.covariance[np.triu_indices(3)]
            figures = [f"{place.probability:.4f}", *(f"{value:.4f}" for value in place.position)]
            figures += [*(f"{value:.3e}" for value in covariance), f"{place.misfit:.5f}"]
            writer.writerow([name, number, *figures, part])
    write_atomically(path, text.getvalue().encode())


def read_places(path: Path) -> dict[str, np.ndarray]:
    """Read the most probable place of each transmitter."""
    rows = csv.DictReader(StringIO(read_text(path, "a CSV of places", LARGEST)))
    if tuple(rows.fieldnames or ()) not in (HEADER, WITHOUT_PART):
        raise InputError(f"{path}, line 1: expected the header {','.join(HEADER)}, found {shown(rows.fieldnames)}")
    found: dict[str, np.ndarray] = {}
    for number, row in enumerate(rows, start=2):
        if row["place"] != "1":
            continue
        try:
            position = np.array([parse_number(row[axis]) for axis in "xyz"])
        except (AttributeError, ValueError):  # a row that is too short has None
            position = np.full(3, np.nan)
        if not np.isfinite(position).all():
            raise InputError(f"{path}, line {number}: expected a position in metres, found {shown(list(row.values()))}")
        found[str(row["name"])] = position
    return found
