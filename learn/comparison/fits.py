"""Fits of methods that predict powers or channels, with several seeds and on training parts of several sizes.

A comparison of spectra keeps its rows in a folder, since they take hours; these take seconds, and are kept in memory.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Complex, Float

from learn.comparison.doubts import average_name
from learn.comparison.makers import checked_sizes, trained_by_steps
from learn.comparison.own_method import built, named
from learn.data.split_distances import SplitDistances, say_distances
from learn.data.splits import Split, SplitKind
from learn.data.splits import split as split_dataset
from scenes.files.errors import InputError
from scenes.files.plain_text import say

if TYPE_CHECKING:
    from simulate.csi.csi_dataset import CsiDataset
    from simulate.dataset.dataset import Dataset
    from simulate.rssi.rssi_dataset import RssiDataset


@dataclass(frozen=True)
class Parts:
    """The splits of a comparison: one test part, and a training and a validation part for each size.

    Attributes:
        of_size: the split of each size, smaller parts first; None is the whole training part.
        distances: from the test positions to the nearest known ones of the largest part. None: positions or frequency
            are not known.
    """

    of_size: Mapping[int | None, Split]
    distances: SplitDistances | None

    @classmethod
    def of(
        cls,
        dataset: Dataset | RssiDataset | CsiDataset,
        split: SplitKind,
        seed: int,
        train_size: int | Sequence[int] | None,
        guard: float,
        things: str,
    ) -> Parts:
        """Split a dataset, and say how far test positions are from known ones.

        Args:
            dataset: spectra, received powers or channels.
            split: how the test part is chosen.
            seed: seed of the split.
            train_size: number of training positions to keep, or several numbers. None: all.
            guard: known positions nearer than this to a test position are left out, wavelengths.
            things: what the dataset has, in words: positions or rows.

        Raises:
            InputError: the dataset has too few positions for the split.
            ParameterError: an argument is out of its range.
        """
        sizes: Sequence[int | None]
        if isinstance(train_size, Iterable) and not isinstance(train_size, str):
            sizes = checked_sizes(things, train_size=train_size)
        else:
            sizes = [train_size]  # which the split checks
        of_size = {size: split_dataset(dataset, split, seed, size, guard) for size in sizes}
        parts = of_size[sizes[-1]]
        if dataset.positions is None or dataset.wavelength is None:
            return cls(of_size, None)
        known, tested = dataset.positions[parts.known], dataset.positions[parts.test]
        distances = SplitDistances.between(known, tested, dataset.wavelength)
        say_distances(distances)
        return cls(of_size, distances)

    @property
    def largest(self) -> Split:
        """The split of the largest size."""
        return list(self.of_size.values())[-1]


@dataclass(frozen=True)
class Fit:
    """A method after its fit and its predictions.

    Attributes:
        row: what the row of scores begins with: "label", "seed", "train_size" and "known".
        name: name of the row in the table.
        predicted: its predictions at the test part.
        cost: what the row ends with: "steps" of training, None of a method without them, and "seconds" of the fit and
            the predictions.
    """

    row: dict[str, Any]
    name: str
    predicted: Any
    cost: dict[str, Any]

    @property
    def is_first(self) -> bool:
        """Whether it is the one with the first seed, of which single predictions are kept."""
        return self.row["seed"] == 0


def fits(
    methods: Mapping[str, Callable[[], Any]],
    seeds: int,
    parts: Parts,
    known: Callable[[Split, int], Any],
    predict: Callable[[str, Any], Any],
) -> Iterator[Fit]:
    """Fit methods one by one, all with the first seed, then all with the next one.

    Args:
        methods: functions that make new, unfitted methods, by label.
        seeds: number of fits of each method, with seeds 0, 1, …
        parts: the splits.
        known: function from a split and a seed to what methods learn from.
        predict: function from a label and a fitted method to its predictions at the test part, which it checks.

    Raises:
        InputError: something went wrong in a method of the user's.
    """
    for seed in range(seeds):
        for size, split in parts.of_size.items():
            taught = known(split, seed)
            for label, make in methods.items():
                row = {"label": label, "seed": seed, "train_size": size, "known": len(split.known)}
                if trained_by_steps(make):
                    say(f"{average_name(row)}, seed {seed}")
                method = built(label, make, "methods")
                began = time.perf_counter()
                with named(label, method, "fit to learn from what is known"):
                    method.fit(taught)
                with named(label, method, "predict to return predictions"):
                    predicted = predict(label, method)
                cost = {
                    "steps": getattr(method, "steps", None),
                    "seconds": round(time.perf_counter() - began, 3),
                }
                yield Fit(row, average_name(row), predicted, cost)


def checked_array(label: str, what: str, given: Any, shape: tuple[int, ...], kind: str) -> Float[np.ndarray, "..."]:
    """What a method predicts, if it is finite numbers of the right shape.

    Args:
        label: name of the method.
        what: what is expected, in words.
        given: what its ``predict`` returned, or a part of it.
        shape: expected shape.
        kind: letters of NumPy's kinds of numbers that are allowed.

    Raises:
        InputError: it is something else.
    """
    found = np.asarray(given)
    if found.dtype.kind not in kind or found.shape != shape:
        seen = f"an array {list(found.shape)} of {found.dtype}"
    elif not np.isfinite(found).all():
        seen = f"{int((~np.isfinite(found)).sum())} values that are not finite"
    else:
        return found
    raise InputError(f"{label}: expected predict to return {what} {list(shape)}, found {seen}")


def checked_with_deviation(
    label: str, what: str, given: Any, name: str, shape: tuple[int, ...], each: str
) -> tuple[Complex[np.ndarray, "..."], Float[np.ndarray, " K"] | None]:
    """What a method predicts, if it is an array, or an object with an array and perhaps a ``deviation``.

    Args:
        label: as for ``checked_array``.
        what: as for ``checked_array``.
        given: what its ``predict`` returned.
        name: name of the array in the object.
        shape: expected shape, K first.
        each: what the K are, in words.

    Returns:
        The array, and the deviation of each of the K. None: none is stated.

    Raises:
        InputError: it is something else.
    """
    found = checked_array(label, what, getattr(given, name, given), shape, "cf")
    deviation = getattr(given, "deviation", None)
    if deviation is not None:
        deviation = checked_array(label, f"a deviation of each {each}", deviation, shape[:1], "f")
    return found, deviation
