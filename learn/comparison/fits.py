"""Fits of methods that predict powers, channels or responses over a band, with several seeds and training parts."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Complex, Float

from learn.comparison.doubts import average_name
from learn.comparison.kept_fits import KeptFits
from learn.comparison.makers import checked_sizes, trained_by_steps
from learn.comparison.own_method import built, is_own, named, source_of
from learn.data.split_distances import SplitDistances, say_distances
from learn.data.splits import Split, SplitKind
from learn.data.splits import split as split_dataset
from scenes.files.errors import InputError, require_whole
from scenes.files.plain_text import say
from simulate.positions.positions import MOST_POSITIONS

if TYPE_CHECKING:
    from simulate.csi.csi_dataset import CsiDataset
    from simulate.dataset.dataset import Dataset
    from simulate.rssi.rssi_dataset import RssiDataset


@dataclass(frozen=True)
class Parts:
    """The splits of a comparison: one test part, and a training and a validation part for each size."""

    of_size: Mapping[int | None, Split]  # the split of each size, smaller parts first; None is the whole training part
    # from the test positions to the nearest known ones of the largest part. None: positions or frequency are not
    # known.
    distances: SplitDistances | None

    @classmethod
    def of(
        cls,
        dataset: Dataset | RssiDataset | CsiDataset,
        split: SplitKind,
        seed: int,
        sizes: Collection[int | None],
        guard: float,
    ) -> Parts:
        """Split a dataset, and say how far test positions are from known ones."""
        rising = sorted(sizes, key=lambda size: (size is None, size))
        of_size = {size: split_dataset(dataset, split, seed, size, guard) for size in rising}
        parts = of_size[rising[-1]]
        if dataset.positions is None or dataset.wavelength is None:
            return cls(of_size, None)
        known, tested = dataset.positions[parts.known], dataset.positions[parts.test]
        distances = SplitDistances.between(known, tested, dataset.wavelength)
        say_distances(distances)
        return cls(of_size, distances)

    def only(self, sizes: Collection[int | None]) -> dict[int | None, Split]:
        """The splits of some of the sizes."""
        return {size: split for size, split in self.of_size.items() if size in sizes}

    @property
    def largest(self) -> Split:
        """The split of the largest size."""
        return list(self.of_size.values())[-1]


def asked_sizes(train_size: Any, things: str) -> list[int | None]:
    """Numbers of training positions that are given as ``train_size``: one or several. None: all of them."""
    if isinstance(train_size, Iterable) and not isinstance(train_size, str):
        return [*checked_sizes(things, train_size=train_size)]
    if train_size is not None:
        require_whole(1, MOST_POSITIONS, train_size=train_size)
    return [train_size]


def measure_fits(
    methods: Mapping[str, Callable[[], Any]],
    usual: Mapping[str, Callable[[], Any]],
    seeds: int,
    of_size: Mapping[int | None, Split],
    known: Callable[[Split, int], Any],
    predict: Callable[[str, Any], Any],
    score: Callable[[Any], tuple[dict[str, Any], dict[str, np.ndarray]]],
    kept: KeptFits,
) -> None:
    """Fit and score methods where the row is missing: all with the first seed, then all with the next one.

    A row has "label", "seed", "train_size" and "known", the scores, "steps" of training (None: the method has none),
    "seconds" of the fit and the predictions, and, where the label does not say what the method is, "source", a hash
    that tells when it has to be measured again.
    """
    kept.require_file_names(methods)
    for seed in range(seeds):
        for size, split in of_size.items():
            taught = known(split, seed)
            for label, make in methods.items():
                key = {"label": label, "seed": seed, "train_size": size}
                name, method = f"{average_name(key)}, seed {seed}", built(label, make, "methods")
                source = source_of(label, method, usual)
                if kept.is_measured(key, name, is_own(method), source, usual):
                    continue
                if trained_by_steps(make):
                    say(name)
                began = time.perf_counter()
                with named(label, method, "fit to learn from what is known"):
                    method.fit(taught)
                with named(label, method, "predict to return predictions"):
                    predicted = predict(label, method)
                cost = {"steps": getattr(method, "steps", None), "seconds": round(time.perf_counter() - began, 3)}
                scores, arrays = score(predicted)
                row = {"known": len(split.known), **scores, **cost}
                kept.keep_fit(key, row if source is None else {**row, "source": source}, arrays)


def checked_array(label: str, what: str, given: Any, shape: tuple[int, ...], kind: str) -> Float[np.ndarray, "..."]:
    """What a method predicts, if it is finite numbers of the right shape."""
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
    """What a method predicts, if it is an array, or an object with an array and perhaps a ``deviation``."""
    found = checked_array(label, what, getattr(given, name, given), shape, "cf")
    deviation = getattr(given, "deviation", None)
    if deviation is not None:
        deviation = checked_array(label, f"a deviation of each {each}", deviation, shape[:1], "f")
    return found, deviation
