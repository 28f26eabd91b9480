"""The CSV of located transmitters: a row for each place where one may be."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from io import StringIO
from pathlib import Path

import numpy as np

from learn.localisation.locate import Place
from scenes.atomic import write_atomically

HEADER = ("name", "place", "probability", "x", "y", "z", "xx", "xy", "xz", "yy", "yz", "zz", "misfit")
"""Name of the picture, number of the place (1 is the most probable), its probability, position (metres), covariance
(square metres), and squared distance of the fingerprints there."""


def write_places(path: Path, names: Sequence[str], places: Sequence[Sequence[Place]]) -> None:
    """Write the CSV.

    Args:
        path: the file.
        names: of the pictures.
        places: of each transmitter, as of ``locate``.
    """
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(HEADER)
    for name, of_one in zip(names, places, strict=True):
        for number, place in enumerate(of_one, start=1):
            covariance = place.covariance[np.triu_indices(3)]
            figures = [f"{place.probability:.4f}", *(f"{value:.4f}" for value in place.position)]
            writer.writerow([name, number, *figures, *(f"{value:.3e}" for value in covariance), f"{place.misfit:.5f}"])
    write_atomically(path, text.getvalue().encode())
