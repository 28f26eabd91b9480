"""Fit and score methods for powers, channels or responses over a band, with several seeds and training parts."""

from __future__ import annotations

import hashlib
import io
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from jaxtyping import Complex, Float
from msgspec import Meta, Struct

from learn.comparison.averaged_table import average_name
from learn.comparison.method_factories import built, checked_sizes, is_own, named, source_of, trained_by_steps
from learn.comparison.results_folder import ResultRow, ResultsFile, results_in, row_name
from learn.data.split_distances import SplitDistances, say_distances
from learn.data.splits import GUARD_MOST, Split, SplitKind
from learn.data.splits import split as split_dataset
from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError, require_whole
from scenes.files.input_file import MEGABYTE
from scenes.files.long_work import doing
from scenes.files.npz_file import Expected, read_npz
from scenes.files.plain_text import say
from simulate.positions.positions import MOST_POSITIONS

if TYPE_CHECKING:
    from simulate.csi.csi_dataset import CsiDataset
    from simulate.dataset.dataset import Dataset
    from simulate.rssi.rssi_dataset import RssiDataset


LARGEST_ARRAYS = 4000 * MEGABYTE  # Largest size of the arrays of a fit, bytes


class FitsProtocol(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The content of protocol.json: the settings that all rows have in common."""

    dataset: str  # absolute path of the dataset's folder
    predicted: str  # what the methods predict
    split: SplitKind  # how the test part is chosen
    seed: Annotated[int, Meta(ge=0)]  # seed of the split
    # known positions nearer than this to a test position are left out, wavelengths
    guard: Annotated[float, Meta(ge=0, le=GUARD_MOST)]
    minutes: Annotated[float, Meta(gt=0)]  # training time of each method that is trained by steps
    data_sha256: str  # fingerprint of the dataset


class FitRow(ResultRow, frozen=True, kw_only=True):
    """The entries that every row has. The others are the scores."""

    known: Annotated[int, Meta(ge=1)]
    seconds: float


class FitResults(ResultsFile):
    """The rows in results.jsonl, and the arrays of those of the first seed in per_sample/."""

    def add_fit(self, key: dict[str, Any], row: dict[str, Any], arrays: Mapping[str, np.ndarray]) -> None:
        """Write a fit to the files, in place of an old one with this key."""
        if key["seed"] == 0:
            archive = io.BytesIO()
            np.savez(archive, **arrays)  # type: ignore[arg-type]
            write_atomically(self._path(key), archive.getvalue())
        self.keep(key, row)

    def arrays(self, expected: Mapping[str, Expected]) -> Iterator[tuple[dict[str, Any], dict[str, np.ndarray]]]:
        """The rows of the first seed, each with its arrays."""
        for row in self.rows:
            if row["seed"] == 0:
                yield row, read_npz(self._path(row), "arrays of a comparison", expected, LARGEST_ARRAYS)

    def _path(self, key: Mapping[str, Any]) -> Path:
        return self.path.parent / "per_sample" / f"{row_name(key)}.npz"


@contextmanager
def fit_results(
    output: Path | None,
    predicted: str,
    dataset: Path,
    settings: dict[str, Any],
    data: Iterable[np.ndarray | None],
    schema: type[FitRow],
) -> Iterator[FitResults]:
    """Begin a comparison in a new folder, or continue the one in a folder, and keep other processes from it."""

    def fingerprint() -> str:
        digest = hashlib.sha256()
        for each in data:
            array = np.asarray("nothing" if each is None else each)
            digest.update(f"{array.dtype} {array.shape}".encode())
            digest.update(np.ascontiguousarray(array).data)
        return digest.hexdigest()

    given = {"dataset": str(dataset.resolve()), "predicted": predicted, **settings}
    with results_in(output, f"comparison of {predicted}", given, fingerprint, (FitsProtocol, schema)) as kept:
        yield FitResults(kept.path.parent, schema)


def earlier_sizes(output: Path | None) -> set[int | None]:
    """The numbers of training positions of the rows that a folder has from earlier calls."""
    rows = [] if output is None else ResultsFile(output, FitRow).rows
    return {row["train_size"] for row in rows}


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


def score_fits(
    methods: Mapping[str, Callable[[], Any]],
    usual: Mapping[str, Callable[[], Any]],
    seeds: int,
    of_size: Mapping[int | None, Split],
    known: Callable[[Split, int], Any],
    predict: Callable[[str, Any], Any],
    score: Callable[[Any], tuple[dict[str, Any], dict[str, np.ndarray]]],
    kept: FitResults,
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
                if kept.is_measured(key, name, is_own(method), source):
                    continue
                if trained_by_steps(make):
                    say(name)
                doing(f"{name}: method {[*methods].index(label) + 1} of {len(methods)}, {len(split.known):,} known")
                began = time.perf_counter()
                with named(label, method, "fit to learn from what is known"):
                    method.fit(taught)
                with named(label, method, "predict to return predictions"):
                    predicted = predict(label, method)
                cost = {"steps": getattr(method, "steps", None), "seconds": round(time.perf_counter() - began, 3)}
                scores, arrays = score(predicted)
                row = {"known": len(split.known), **scores, **cost}
                kept.add_fit(key, row if source is None else {**row, "source": source}, arrays)


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
