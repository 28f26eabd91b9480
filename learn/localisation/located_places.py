"""Places where a transmitter may be, their CSV, and whether true positions lie in the regions that they state."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from io import StringIO
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.stats import chi2

from learn.planning.candidates import extended_axes
from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError, shown
from scenes.files.input_file import MEGABYTE, parse_number, read_text

LEAST_PROBABILITY = 0.01  # Places with a smaller probability are left out

LARGEST = 100 * MEGABYTE  # Largest size of the CSV, bytes

HEADER = ("name", "place", "probability", "x", "y", "z", "xx", "xy", "xz", "yy", "yz", "zz", "misfit", "part")
"""Name of the picture, number of the place (1 is the most probable), its probability, position (metres), covariance
(square metres), squared distance of the fingerprints there, and the part of the run's split that the picture is of:
train, validation, test, or new."""

NEW = "new"  # Part of a picture that is not of the run's dataset


class Place(NamedTuple):
    """A place where a transmitter may be.

    Attributes:
        position: [3] metres, world frame.
        covariance: [3, 3] covariance of the position, m². It grows with the part of the spectrum that the run does not
            explain. It is 0 along an axis along which the training positions have no extent.
        probability: probability of this place among all places of the transmitter, 0…1.
        misfit: squared distance of measured and predicted fingerprint: about the share of the spectrum that the run
            does not explain. For received powers and channels, what ``locate_powers`` and ``locate_channels`` say.
    """

    position: Float[np.ndarray, " 3"]
    covariance: Float[np.ndarray, "3 3"]
    probability: float
    misfit: float


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
    if tuple(rows.fieldnames or ()) != HEADER:
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


REGION = 0.9  # Probability of the stated region

LEAST_VARIANCE = 1e-12
"""Square metres: along an axis where a covariance is 0, a micrometre off is outside."""


def share_in_region(
    places: Sequence[Place], truth: Float[np.ndarray, "K 3"], known: Float[np.ndarray, "n 3"]
) -> float | None:
    """Share of the true positions in the covariance's ellipsoid of ``REGION``, along the known positions' axes.

    >>> place = Place(np.zeros(3), np.eye(3), 1.0, 0.0)
    >>> flat, solid = np.vstack([np.eye(3)[:2], np.zeros(3)]), np.vstack([np.eye(3), -np.eye(3)])
    >>> truth = np.array([[2.3, 0, 0]])  # beyond the ellipse's 2.1, within the ellipsoid's 2.5
    >>> share_in_region([place], truth, flat), share_in_region([place], truth, solid)
    (0.0, 1.0)
    """
    axes = extended_axes(known)[1]
    if not len(axes) or not len(places):
        return None
    away = (np.stack([place.position for place in places]) - truth) @ axes.T
    covariances = axes @ np.stack([place.covariance for place in places]) @ axes.T + LEAST_VARIANCE * np.eye(len(axes))
    squared = np.einsum("ki,ki->k", away, np.linalg.solve(covariances, away[..., None])[..., 0])
    return float(np.mean(squared <= chi2.ppf(REGION, len(axes))))
