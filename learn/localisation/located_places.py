"""Places where transmitters may be, their CSV, and their errors where the true positions are known."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int
from scipy.stats import chi2

from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError, shown
from scenes.files.input_file import MEGABYTE, parse_number, read_text

LEAST_PROBABILITY = 0.01  # Places with a smaller probability are left out

REGION = 0.9  # Probability of the stated region

NEAREST = (1, 4, 16)  # Numbers of most similar known rows whose positions are averaged for comparison

LARGEST = 100 * MEGABYTE  # Largest size of the CSV, bytes

HEADER = ("name", "place", "probability", "x", "y", "z", "xx", "xy", "xz", "yy", "yz", "zz", "misfit", "part")
"""Name of the transmitter, number of the place (1 is the most probable), its probability, position (metres), covariance
(square metres), misfit, and the part of the split that the transmitter is of: train, validation, test, or new."""

NEW = "new"  # Part of a transmitter that is in no split


class Place(NamedTuple):
    """A place where a transmitter may be.

    Attributes:
        position: [3] metres, world frame.
        covariance: [3, 3] covariance of the position, m². It grows with the part of what was heard that stays
            unexplained. It is 0 along an axis along which the known positions have no extent.
        probability: probability of this place among all places of the transmitter, 0…1.
        misfit: how badly the place explains what was heard. Of spectra, the squared distance of measured and predicted
            fingerprint: about the share of the spectrum that the run does not explain. Of received powers, the mean
            square of the errors in stated standard deviations. Of channels, 1 − ``|ρ|²`` for the correlation ρ with the
            most similar known row. Along a track, the share of the power that the direct path does not explain.
    """

    position: Float[np.ndarray, " 3"]
    covariance: Float[np.ndarray, "3 3"]
    probability: float
    misfit: float


@dataclass(frozen=True, eq=False)
class Located(Sequence[list[Place]]):
    """Where K transmitters may be: a sequence of K lists of places, the most probable one first.

    The list of a transmitter of which nothing was heard is empty.

    Attributes:
        places: the K lists.
        names: K names, of pictures or tags, or the numbers of rows.
        parts: the part of the split that each transmitter is of: train, validation, test, or new.
        truth: [K, 3] true positions, metres; None where they are not known.
        copied: [K, 3] positions by copying those of the most similar known rows, metres, by the name of the method.

    Example:
        >>> place = Place(np.array([1.0, 2, 1]), 0.04 * np.eye(3), 1.0, 0.0)
        >>> found = Located([[place], []], ["00001", "00002"], [NEW, NEW], np.array([[1, 2, 1.3], [0, 0, 0]]))
        >>> len(found), found[0][0].probability, found.errors["locate"].round(2).tolist(), found.share_in_region
        (2, 1.0, [0.3], 1.0)
    """

    places: list[list[Place]]
    names: Sequence[str]
    parts: Sequence[str]
    truth: Float[np.ndarray, "K 3"] | None = None
    copied: dict[str, Float[np.ndarray, "K 3"]] | None = None

    def __len__(self) -> int:
        return len(self.places)

    def __getitem__(self, number: Any) -> Any:
        return self.places[number]

    @property
    def errors(self) -> dict[str, Float[np.ndarray, " k"]]:
        """Distances of located transmitters to the truth, metres, by the name of the method, "locate" first."""
        told = np.array([bool(each) for each in self.places])
        if self.truth is None or not told.any():
            return {}
        first = np.array([each[0].position for each in self.places if each])
        found = {"locate": first} | {name: each[told] for name, each in (self.copied or {}).items()}
        return {name: np.linalg.norm(positions - self.truth[told], axis=1) for name, positions in found.items()}

    @property
    def share_in_region(self) -> float | None:
        """Share of the true positions in the ellipsoid of 90 % probability of the most probable place's covariance."""
        if self.truth is None:
            return None
        both = [(each[0], truth) for each, truth in zip(self.places, self.truth, strict=True) if each]
        inside = [_in_region(place, truth) for place, truth in both if place.covariance.any()]
        return float(np.mean(inside)) if inside else None

    def metrics(self) -> dict[str, float | int]:
        """Medians and 90th percentiles of the errors (cm), and how often stated 90 % regions hold the true position."""
        errors = self.errors
        metrics: dict[str, float | int] = {"located": len(errors["locate"])}
        for name, each in errors.items():
            key = {"locate": "", "fingerprint": "_fingerprint"}.get(name, f"_fingerprint_{name.split()[-1]}")
            metrics[f"location_error_median_cm{key}"] = 100 * float(np.median(each))
            metrics[f"location_error_p90_cm{key}"] = 100 * float(np.percentile(each, 90))
        if (within := self.share_in_region) is not None:
            metrics["within_90_percent_region"] = within
        return metrics | {"of_several_places": float(np.mean([len(each) > 1 for each in self.places if each]))}

    def rows(self) -> list[dict[str, Any]]:
        """A row for each method: median and 90th percentile of the errors, metres. Empty without true positions."""
        within = self.share_in_region
        columns = {"within 90 % region": None if within is None else round(within, 3)}
        rows = []
        for name, errors in self.errors.items():
            median, most = (round(float(np.quantile(errors, share)), 3) for share in (0.5, 0.9))
            rows.append({"method": name, "median, m": median, "90 %, m": most} | columns)
            columns = dict.fromkeys(columns)
        return rows

    def write(self, path: Path) -> None:
        """Write the CSV."""
        text = StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(HEADER)
        for name, of_one, part in zip(self.names, self.places, self.parts, strict=True):
            for number, place in enumerate(of_one, start=1):
                covariance = place.covariance[np.triu_indices(3)]
                figures = [f"{place.probability:.4f}", *(f"{value:.4f}" for value in place.position)]
                figures += [*(f"{value:.3e}" for value in covariance), f"{place.misfit:.5f}"]
                writer.writerow([name, number, *figures, part])
        write_atomically(path, text.getvalue().encode())


def copied_positions(
    unlike: Float[np.ndarray, "K n"], known: Float[np.ndarray, "n 3"]
) -> dict[str, Float[np.ndarray, "K 3"]]:
    """Mean position of the most similar known rows, for each of ``NEAREST``."""
    order: Int[np.ndarray, "K n"] = unlike.argsort(axis=1)
    names = {count: "fingerprint" if count == 1 else f"fingerprint, mean of {count}" for count in NEAREST}
    return {name: known[order[:, :count]].mean(axis=1) for count, name in names.items()}


def _in_region(place: Place, truth: Float[np.ndarray, " 3"]) -> bool:
    """Whether a position is in the place's ellipsoid, along the axes along which it extends.

    >>> flat, solid = (Place(np.zeros(3), np.diag(each), 1.0, 0.0) for each in ([1.0, 1, 0], [1.0, 1, 1]))
    >>> truth = np.array([2.3, 0, 0])  # beyond the ellipse's 2.1, within the ellipsoid's 2.5
    >>> _in_region(flat, truth), _in_region(solid, truth)
    (False, True)
    """
    variances, axes = np.linalg.eigh(place.covariance)
    wide = variances > 1e-9 * variances[-1]
    squared = np.square((truth - place.position) @ axes[:, wide]) / variances[wide]
    return bool(squared.sum() <= chi2.ppf(REGION, wide.sum()))


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
