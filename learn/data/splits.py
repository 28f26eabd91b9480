"""Splits: the spectra on which a model is trained, validated and tested."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from math import floor
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from jaxtyping import Bool, Float, Int
from msgspec import Struct

from scenes.files.errors import (
    InputError,
    ParameterError,
    require_instance,
    require_seed,
    require_whole,
    require_within,
    require_word,
    shown,
)
from scenes.files.input_file import MEGABYTE, read_text
from scenes.files.json_yaml_xml import parse_json
from scenes.files.schema import conform
from simulate.dataset.dataset_kinds import QUANTITIES
from simulate.positions.positions import MOST_POSITIONS

if TYPE_CHECKING:  # importing it is slow, and the command line's help only needs SplitKind
    from simulate.dataset.dataset import Dataset

SplitKind = Literal["files", "random", "blocked", "area"]
SPLITS: tuple[str, ...] = get_args(SplitKind)

TEST_FRACTION = 0.2
"""Share of the spectra that ``random`` and ``area`` hold out for testing; the published loaders also split 80/20."""

BLOCK, EVERY = 10, 4  # ``blocked`` holds out every fourth block of ten consecutive spectra for testing

AREAS = 10  # ``area`` divides the region into so many areas

NUDGE = 1e-6
"""``area`` moves each position by this share of the region's size, so that none is as near to one centre as to another.
Rounding, which differs between machines, would decide about such a position."""

VALIDATION_FRACTION = 0.1
"""Share of the training part that is set aside to choose the best checkpoint. The test part chooses nothing."""

GUARD_MOST = 100.0  # Largest guard, wavelengths

PARTS = ("train", "validation", "test")

LARGEST_SPLIT = 40 * MEGABYTE  # Largest size of a split.json, bytes; a million names of six digits take 11 MB


@dataclass(frozen=True)
class Split:
    """Disjoint parts of a dataset, as sorted indices of its spectra.

    Attributes:
        train: spectra that a model is trained on.
        validation: spectra that choose the best checkpoint.
        test: spectra that a model is scored on.
    """

    train: Int[np.ndarray, " n_train"]
    validation: Int[np.ndarray, " n_validation"]
    test: Int[np.ndarray, " n_test"]

    @property
    def known(self) -> Int[np.ndarray, " n_known"]:
        """Training and validation part together, sorted: the spectra that a baseline may interpolate."""
        return np.sort(np.concatenate([self.train, self.validation]))


def split(dataset: Dataset, kind: SplitKind, seed: int, train_size: int | None = None, guard: float = 0.0) -> Split:
    """Split a dataset into a training, a validation and a test part.

    There are four kinds of split:

    - ``files`` reads the folder's own train_index.txt and test_index.txt.
    - ``random`` draws 20 % of the spectra for testing.
    - ``blocked`` holds out every fourth block of ten consecutive spectra.
    - ``area`` divides the positions into ten areas by k-means, each the positions nearest to a centre, and holds out
      areas with about a fifth of the spectra, whatever the order of measurement.

    Measured positions follow a path. With ``random``, and with the index files of most folders, the spectra recorded
    just before and after a test spectrum are therefore in the training part. With ``blocked`` this happens only at the
    ends of a block, and with ``area`` at the borders of an area, unless the path comes back.

    The validation part is 10 % of the training part; with ``blocked`` it consists of whole blocks, with ``area`` of
    whole areas.

    Args:
        dataset: the spectra, or received powers or channels, whose rows are then split by the same rules.
        kind: how the test part is chosen.
        seed: seed of the test part of ``random`` and ``area``, and of the validation part.
        train_size: number of training spectra to keep. A smaller part is contained in every larger one. The validation
            part shrinks in proportion, since baselines use it too; the test part stays the same. None: keep all.
        guard: known positions nearer than this to a test position are left out, wavelengths.

    Returns:
        Disjoint parts, each sorted.

    Raises:
        InputError: the dataset has too few spectra for three parts, has fewer training spectra than ``train_size``, or
            lacks the index files that ``files`` needs, or the positions for ``area``; ``guard`` leaves no training or
            no validation spectrum; or both ends of the link move.
        ParameterError: no split has this name, the seed or ``train_size`` is not a whole number in its range, or
            ``guard`` is not from 0 to ``GUARD_MOST``, or not 0 for channels without positions or frequency.

    Example:
        >>> import bisplat
        >>> parts = split(bisplat.read_dataset("data/lab"), "blocked", seed=0)
        >>> parts.test.tolist()
        [10, 11, 12, 13, 14, 15, 16, 17, 18, 19]
    """
    from simulate.dataset.dataset import Dataset  # these are slow to import
    from simulate.dataset.dataset_folder import require_fixed_end

    require_instance(Dataset, dataset=dataset)
    require_word(SPLITS, kind=kind)
    require_seed(seed=seed)
    if train_size is not None:
        require_whole(1, MOST_POSITIONS, train_size=train_size)
    require_within(0, GUARD_MOST, "wavelengths", guard=guard)
    require_fixed_end(dataset)  # here, since all that learns or scores splits its dataset first
    count = len(dataset)
    things = QUANTITIES[dataset.quantities[0]].rows
    generator = np.random.default_rng(seed)
    block = np.arange(count) // BLOCK
    if kind == "files":
        known, test = dataset.train, dataset.test
        if not (len(known) or len(test)):
            raise InputError(
                f"{dataset.folder}: expected train_index.txt and test_index.txt for the split files, found neither; "
                f"use the split random (or blocked, from 21 {things} on)"
            )
    elif kind == "random":
        order = generator.permutation(count)
        tested = round(TEST_FRACTION * count)
        known, test = np.sort(order[tested:]), np.sort(order[:tested])
    else:
        block = _areas(dataset.positions, dataset.folder, generator) if kind == "area" else block
        held_out = _about(TEST_FRACTION, block, generator) if kind == "area" else block % EVERY == 1
        known, test = np.flatnonzero(~held_out), np.flatnonzero(held_out)

    unit = block[known] if kind in ("blocked", "area") else known
    if kind == "area":
        in_validation = _about(VALIDATION_FRACTION, unit, generator)
    else:
        units = np.unique(unit)
        chosen = generator.permutation(units)[: max(1, round(VALIDATION_FRACTION * len(units)))]
        in_validation = np.isin(unit, chosen)
    train, validation = known[~in_validation], known[in_validation]
    if guard:
        if not distances_known(dataset):
            raise ParameterError("guard", f"expected 0 for channels without positions or frequency, found {guard:g}")
        train, validation = _guarded(dataset, train, validation, test, guard, kind, things)
    if train_size is not None:
        if train_size > len(train):
            raise InputError(f"{dataset.folder}: expected {train_size} {things} to train on, found {len(train)}")
        share = train_size / len(train)
        train = np.sort(generator.permutation(train)[:train_size])
        validation = np.sort(generator.permutation(validation)[: max(1, round(share * len(validation)))])
    result = Split(train=train, validation=validation, test=test)
    if not (len(result.train) and len(result.test)):
        raise InputError(
            f"{dataset.folder}: expected enough {things} for a {kind} split into training, validation and test part, "
            f"found {count}, which give {len(result.train)}, {len(result.validation)} and {len(result.test)}"
        )
    return result


def distances_known(dataset: Dataset) -> bool:
    """Whether positions are known, and how many wavelengths apart they are."""
    stated = dataset.frequency.source != "assumed" or "channel" not in dataset.values
    return dataset.places is not None and stated


def _guarded(
    dataset: Dataset,
    train: Int[np.ndarray, " n_train"],
    validation: Int[np.ndarray, " n_validation"],
    test: Int[np.ndarray, " n_test"],
    guard: float,
    kind: SplitKind,
    things: str,
) -> list[Int[np.ndarray, " n"]]:
    """The training and the validation spectra that are at least ``guard`` wavelengths from every test position."""
    from scipy.spatial import cKDTree

    if not (len(train) and len(validation) and len(test)):
        return [train, validation]  # too few spectra, which the caller says
    tested = cKDTree(dataset.positions[test])
    away = [tested.query(dataset.positions[part])[0] / dataset.wavelength for part in (train, validation)]
    kept = [part[distance >= guard] for part, distance in zip((train, validation), away, strict=True)]
    if not (len(kept[0]) and len(kept[1])):
        most = floor(1000 * min(distance.max() for distance in away)) / 1000
        possible = f"{most:g} wavelengths is the largest that does" if most else "none does"
        hint = "" if kind == "area" else "; the split area often allows a larger one"
        raise InputError(
            f"{dataset.folder}: expected a guard that leaves training and validation {things}, found {guard:g} "
            f"wavelengths, which leaves {len(kept[0])} of {len(train)} and {len(kept[1])} of {len(validation)} of "
            f"them; {possible}{hint}"
        )
    return kept


def _areas(
    positions: Float[np.ndarray, "n 3"] | None, folder: Path, generator: np.random.Generator
) -> Int[np.ndarray, " n"]:
    """Number of the area in which each position lies. Spectra at the same position lie in the same area."""
    from sklearn.cluster import KMeans  # slow to import

    if positions is None:
        raise InputError(f"{folder}: expected positions (tx_pos.csv) for the split area, found none")
    places, place, spectra = np.unique(positions, axis=0, return_inverse=True, return_counts=True)
    if len(places) < 2 * AREAS:
        raise InputError(f"{folder}: expected at least {2 * AREAS} positions for the split area, found {len(places)}")
    moved = places + NUDGE * np.ptp(places) * generator.uniform(-1, 1, places.shape)
    means = KMeans(AREAS, n_init=4, random_state=int(generator.integers(2**31)))
    return means.fit_predict(moved, sample_weight=spectra)[place.ravel()]


def _about(share: float, area: Int[np.ndarray, " n"], generator: np.random.Generator) -> Bool[np.ndarray, " n"]:
    """Choose whole areas, in an order that is drawn, that together have about a share of the spectra."""
    numbers, sizes = np.unique(area, return_counts=True)
    wanted, chosen, total = share * len(area), [], 0
    for index in generator.permutation(len(numbers)):
        if abs(total + sizes[index] - wanted) < abs(total - wanted):
            chosen.append(numbers[index])
            total += sizes[index]
    return np.isin(area, chosen or numbers[sizes.argmin()])


class SplitFile(Struct, frozen=True, forbid_unknown_fields=True):
    """The content of split.json: names of spectra."""

    train: list[str]
    validation: list[str]
    test: list[str]


def read_split(path: Path, names: Sequence[str], folder: Path) -> Split:
    """Read a split.json, which holds the names of the spectra of each part."""
    expected = "the names of the spectra of each part"
    content = parse_json(read_text(path, expected, LARGEST_SPLIT), str(path), expected)
    conform(content, SplitFile, str(path))
    index_of = {name: index for index, name in enumerate(names)}
    every = [name for listed in content.values() for name in listed]
    missing = next((name for name in every if name not in index_of), None)
    if missing is not None:
        raise InputError(
            f"{folder}: expected the dataset that {path.parent} was trained on, found one without the spectrum "
            f"{shown(missing)}"
        )
    if len(set(every)) < len(every):
        twice = next(name for name, count in Counter(every).items() if count > 1)
        raise InputError(f"{path}: expected each name only once, found {shown(twice)} twice")
    if not (content["train"] and content["test"]):
        raise InputError(f"{path}: expected names in train and in test, found none in one of them")
    return Split(**{part: np.array([index_of[name] for name in content[part]], dtype=int) for part in PARTS})
