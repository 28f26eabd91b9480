"""The scores of methods that predict powers or channels: a row for each fit, printed, shown in a notebook, as JSON."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import numpy as np
from jaxtyping import Float

from learn.comparison.averaged_table import AveragedTable, average_name
from learn.data.split_distances import SplitDistances
from learn.data.splits import Split, SplitKind


class Measure(NamedTuple):
    """The score by which methods are ranked."""

    name: str  # its name in those of figures
    key: str  # its key in a row
    second: str  # key of the score that ranks methods with equal ones
    small_is_good: bool  # whether the best method has the smallest
    of_each: str  # what it is the median of, with the unit, for the axis of a figure
    share: str  # what the shares of a distribution are of


@dataclass(frozen=True, kw_only=True, repr=False)
class ScoreTable(AveragedTable):
    """Base of the comparisons of powers, of channels and of responses over a band."""

    MEASURE: ClassVar[Measure]  # Set by the subclass, as the next

    THINGS: ClassVar[str]  # What is known and tested: positions or rows

    folder: Path  # the dataset's folder
    split: SplitKind  # how the test part was chosen
    seed: int  # seed of the split
    guard: float  # known positions nearer than this to a test position were left out, wavelengths
    minutes: float  # training time of each method that is trained by steps
    parts: Split = field(repr=False)  # training, validation and test part; of several sizes, those of the largest
    rows: list[dict[str, Any]]  # a dictionary for each method, seed and size, in the order in which they were measured
    # how far the test positions are from the known ones. None: positions or frequency are not known.
    distances: SplitDistances | None

    @property
    def known(self) -> int:
        """Number of known positions or rows, those of the training and the validation part; the largest of several."""
        return len(self.parts.known)

    @property
    def test(self) -> int:
        """Number of test positions or rows."""
        return len(self.parts.test)

    def __repr__(self) -> str:
        methods = len({row["label"] for row in self.rows})
        return (
            f"{type(self).__name__}({str(self.folder)!r}: {methods} methods, {self.known} known and {self.test} test "
            f"{self.THINGS}, split {self.split})"
        )

    def of_each(self) -> dict[str, Float[np.ndarray, "..."]]:
        """The single scores of which ``MEASURE`` is the median, by the name of the row in the table; first seed."""
        raise NotImplementedError

    def table(self) -> list[dict[str, Any]]:
        """The averages, the best first; of several sizes, the smallest first."""
        sign = 1 if self.MEASURE.small_is_good else -1

        def rank(row: dict[str, Any]) -> list[float]:
            keys = (self.MEASURE.key, self.MEASURE.second)
            scores = [np.inf if row[key] is None else sign * row[key] for key in keys]
            return [row["train_size"] or 0, *scores]

        return sorted(self.averages(), key=rank)

    def facts(self) -> dict[str, Any]:
        """All scores and what they are of, for JSON; methods by name, of several sizes with the size."""
        facts: dict[str, Any] = {
            "dataset": str(self.folder),
            "split": self.split,
            "seed": self.seed,
            "guard": self.guard,
            "known": self.known,
            "test": self.test,
            **({} if self.distances is None else self.distances.facts()),
            "methods": by_name(self.table()),
        }
        if any(row["seed"] for row in self.rows):
            facts["fits"] = self.rows
        return facts


def by_name(rows: Sequence[Mapping[str, Any]], *others: str) -> dict[str, dict[str, Any]]:
    """Rows by ``average_name``, without the keys that say what they are of."""
    left_out = ("label", "train_size", *others)
    return {average_name(row): {key: value for key, value in row.items() if key not in left_out} for row in rows}
