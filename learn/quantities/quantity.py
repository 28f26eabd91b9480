"""A measured quantity: where a dataset has it, what a method predicts of it, and how that is scored."""

from __future__ import annotations

import hashlib
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np
from jaxtyping import Float, Int, Num

from scenes.files.errors import InputError
from scenes.files.npz_file import Expected
from scenes.files.plain_text import say


@dataclass(frozen=True)
class Prediction:
    """What a method predicts of K rows of a dataset, in the unit of what it learned from.

    Attributes:
        value: the predicted values, the median if a distribution is predicted, [K, …].
        low: lower end of the interval that holds the value with a probability of 90 %, [K, …]; None if the method
            states none.
        high: upper end of this interval.
        deviation: standard deviation of a value, of complex ones that of the real and of the imaginary part, [K]; None
            if the method states none.

    Example:
        >>> import bisplat, numpy as np
        >>> bisplat.Prediction(np.zeros((3, 2)), deviation=np.ones(3)).value.shape
        (3, 2)
    """

    value: Num[np.ndarray, "K ..."]
    low: Float[np.ndarray, "K ..."] | None = None
    high: Float[np.ndarray, "K ..."] | None = None
    deviation: Float[np.ndarray, " K"] | None = None


def joined(parts: Sequence[Prediction]) -> Prediction:
    """Several predictions as one; what one of them does not state, none does."""

    def together(name: str) -> np.ndarray | None:
        found = [getattr(each, name) for each in parts]
        return None if any(each is None for each in found) else np.concatenate(found)

    value = np.concatenate([each.value for each in parts])
    return Prediction(value, together("low"), together("high"), together("deviation"))


class Scored(NamedTuple):
    """The scores of a prediction."""

    row: dict[str, Any]  # the scores of all rows together
    each: dict[str, np.ndarray]  # what is kept of each row, by name; the first axis is that of the rows


class OfEach(NamedTuple):
    """The score of a single row, whose median ranks the methods."""

    key: str  # its name in ``Scored.each``, and in those of figures
    label: str  # for the axis of a figure, with the unit
    share: str  # what the shares of its distribution are of


class Quantity(ABC):
    """A quantity of a dataset. A new one is a subclass, and a line in ``learn.quantities.quantity_table``.

    Example:
        >>> import bisplat
        >>> comparison = bisplat.compare("data/lab", ["nearest"], tested=4)
        >>> comparison.quantity.name, comparison.quantity.things
        ('spectrum', 'spectra')
    """

    name: ClassVar[str]
    things: ClassVar[str]  # what the rows of a dataset are called
    in_words: ClassVar[str]  # the title of a table: "comparison of …"
    predicted: ClassVar[str]  # what ``predict`` returns, for messages
    kinds: ClassVar[str]  # kinds of its numbers, by NumPy's codes
    file: ClassVar[str]  # name of the file with the predictions of another program
    columns: ClassVar[Mapping[str, str]]  # headings of a table, by the keys of the scores; the first one ranks
    small_is_good: ClassVar[bool] = False  # whether the best method has the smallest of the first two scores
    of_each: ClassVar[OfEach]
    mean: ClassVar[str | None] = None  # name of a method that predicts the same everywhere; worse rows say little
    states_intervals: ClassVar[bool] = True  # whether stated intervals are scored
    most_known: ClassVar[int | None] = None  # of more known rows, so many are drawn. None: all are known.
    at_once: ClassVar[int | None] = None  # rows that are predicted at once. None: all of them.

    @property
    def ranked_by(self) -> str:
        """Key of the score that ranks the methods."""
        return next(iter(self.columns))

    def rank(self, row: Mapping[str, Any]) -> list[float]:
        """What sorts rows, the best first: the first score, and the second one where the first is equal."""
        sign = 1 if self.small_is_good else -1
        return [np.inf if row.get(key) is None else sign * row[key] for key in list(self.columns)[:2]]

    @abstractmethod
    def of(self, dataset: Any, rows: Int[np.ndarray, " n"]) -> Num[np.ndarray, "n ..."]:
        """The values of some rows of a dataset."""

    def given(self, dataset: Any, rows: Int[np.ndarray, " n"]) -> Num[np.ndarray, "n ..."] | None:
        """What a method is given of tested rows besides positions. None: nothing."""
        return None

    def whole(self, dataset: Any, rows: Int[np.ndarray, " n"]) -> Num[np.ndarray, "n ..."]:
        """The values of some rows without gaps, to be interpolated."""
        return self.of(dataset, rows)

    def trend(
        self, dataset: Any, rows: Int[np.ndarray, " n"]
    ) -> Callable[[Float[np.ndarray, "K 3"]], Num[np.ndarray, "K ..."]] | None:
        """What known rows say of the values at any positions, about which kriging interpolates. None: nothing."""
        return None

    def require(self, dataset: Any) -> None:  # noqa: B027
        """Refuse a dataset that lacks the quantity, or whose values cannot be scored."""

    def tested(self, dataset: Any, rows: Int[np.ndarray, " n"]) -> Int[np.ndarray, " K"]:
        """The rows of a test part that can be scored. How many cannot is said on stderr."""
        return rows

    def fingerprint(self, dataset: Any) -> str:
        """SHA-256 of what a comparison depends on: positions and values."""
        if self.name == dataset.quantities[0]:
            return dataset.fingerprint
        every, digest = np.arange(len(dataset)), hashlib.sha256()
        for array in (dataset.places, self.of(dataset, every), self.given(dataset, every)):
            if array is not None:
                digest.update(np.ascontiguousarray(array).data)
        return digest.hexdigest()

    @abstractmethod
    def score(self, prediction: Prediction, truth: Num[np.ndarray, "K ..."], dataset: Any) -> Scored:
        """Score a prediction."""

    @abstractmethod
    def arrays(self, shape: tuple[int, ...]) -> dict[str, Expected]:
        """The arrays in ``Scored.each`` of a truth of a shape, for who reads them from a file."""

    def bound(self, dataset: Any, test: Int[np.ndarray, " K"]) -> tuple[str, Prediction, Int[np.ndarray, " k"]] | None:
        """A bound of every score, fitted to the truth of some test rows: its label, prediction and rows. None: none."""
        return None

    def remark(self, rows: Sequence[Mapping[str, Any]]) -> str | None:
        """What a reader of the table has to know besides. None: nothing."""
        return None

    def stated(self, dataset: Any) -> str | None:
        """What is assumed of a dataset for this comparison, for the user. None: nothing."""
        return None

    def drawn(self, rows: Int[np.ndarray, " n"], seed: int) -> Int[np.ndarray, " m"]:
        """The known rows, or ``most_known`` of them, drawn at random. That some are left out is said on stderr."""
        if self.most_known is None or len(rows) <= self.most_known:
            return rows
        say(f"the methods learn from {self.most_known} of the {len(rows)} known {self.things}")
        return np.sort(np.random.default_rng(seed).permutation(rows)[: self.most_known])

    def predicted_by(
        self, label: str, method: Any, positions: Any, given: np.ndarray | None, shape: Sequence[int]
    ) -> Prediction:
        """What a method predicts of rows, in pieces if there are many."""
        at_once, parts = self.at_once or max(shape[0], 1), []
        for first in range(0, max(shape[0], 1), at_once):
            some = slice(first, first + at_once)
            where = None if positions is None else positions[some]
            found = method.predict(where) if given is None else method.predict(where, given[some])
            parts.append(self.checked(label, found, (min(at_once, shape[0] - first), *shape[1:])))
        return joined(parts)

    def checked(self, label: str, given: Any, shape: Sequence[int]) -> Prediction:
        """What a method returned, if it is a prediction: an array, or an object with ``value`` and perhaps more."""
        parts = {name: getattr(given, name, None) for name in ("low", "high", "deviation")}
        value = self._array(label, self.predicted, getattr(given, "value", given), shape, self.kinds)
        if parts["low"] is None or parts["high"] is None:
            parts["low"] = parts["high"] = None
        for name, each in parts.items():
            if each is not None:
                size = shape[:1] if name == "deviation" else shape
                parts[name] = self._array(label, f"{name} of {self.predicted}", each, size, "iuf")
        return Prediction(value, **parts)

    def _array(self, label: str, what: str, given: Any, shape: Sequence[int], kinds: str) -> np.ndarray:
        found = np.asarray(given)
        if found.dtype.kind not in kinds or found.shape != tuple(shape):
            seen = f"an array {list(found.shape)} of {found.dtype}"
        elif not np.isfinite(found).all():
            wrong = ~np.isfinite(found.reshape(len(found), -1)).all(axis=1)
            seen = f"values that are not finite in {int(wrong.sum())} of them"
        else:
            return found
        raise InputError(f"{label}: expected predict to return {what} {list(shape)}, found {seen}")
