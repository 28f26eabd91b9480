"""What is known and what is tested: one dataset that is split, or rooms of which some are test rooms."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Sequence
from functools import cache, cached_property
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Int

from learn.data.same_receiver import other_array, other_frequency
from learn.data.split_distances import SplitDistances
from learn.data.splits import Split, SplitKind, distances_known, split
from learn.quantities.known import HowSplit
from learn.quantities.quantity import Quantity
from scenes.files.errors import InputError, require_whole
from simulate.dataset.rooms_folder import Rooms
from simulate.spectra.spectrum import evenly


class Case(NamedTuple):
    """Some rows of a dataset that are known, of one number of training rows."""

    dataset: Any
    parts: Split
    how: HowSplit | None  # how ``bisplat.split`` chose them. None: it did not.


class OneDataset:
    """One dataset, split into a training, a validation and a test part."""

    training: Sequence[Any] = ()  # datasets in which methods may learn before
    test_rooms: int | None = None

    def __init__(self, dataset: Any, quantity: Quantity, kind: SplitKind, seed: int, guard: float, tested: int | None):
        quantity.require(dataset)
        self.data, self.quantity, self.split, self.tested = dataset, quantity, kind, tested
        self.fingerprint, self.index_sha256 = quantity.fingerprint(dataset), ""
        self.parts = cache(lambda size: split(dataset, kind, seed, size, guard))
        self.how = lambda size: HowSplit(kind, seed, size, guard)
        if kind == "files":
            parts = [part.tolist() for part in (dataset.train, dataset.test)]
            self.index_sha256 = hashlib.sha256(json.dumps(parts).encode()).hexdigest()

    def sizes(self, asked: Sequence[int | None]) -> list[int | None]:
        """The numbers of training rows that are asked for, if there are so many."""
        for size in asked:
            self.parts(size)  # refuses one that is too large
        return list(asked)

    @cached_property
    def test(self) -> Int[np.ndarray, " K"]:
        """The rows on which every method is scored: those of the test part that can be scored."""
        rows = self.quantity.tested(self.data, self.parts(None).test)
        return rows if self.tested is None else evenly(rows, self.tested)

    @property
    def tests(self) -> Sequence[tuple[Any, Int[np.ndarray, " K"]]]:
        """Each dataset with its test rows."""
        return [(self.data, self.test)]

    def known(self, size: int | None, seed: int) -> list[Case]:
        """What is known in each dataset, for a number of training rows and a seed."""
        parts, how = self.parts(size), self.how(size)
        some = self.quantity.drawn(parts.known, how.seed)
        if len(some) < len(parts.known):
            parts = Split(train=some, validation=some[:0], test=parts.test)
        return [Case(self.data, parts, how)]

    def distances(self, size: int | None) -> SplitDistances | None:
        """From the test positions to the nearest known ones. None: positions or frequency are not known."""
        if not distances_known(self.data):
            return None
        positions = self.data.positions
        return SplitDistances.between(positions[self.parts(size).known], positions[self.test], self.data.wavelength)


GIVEN = 5, 10, 25, 50, 100  # Numbers of known spectra of a test room

TESTED = 5  # One of so many spectra of a test room is a test spectrum, drawn at random

TEST_ROOMS = 4  # One of so many rooms is a test room, if none are asked for: the last ones


class ManyRooms:
    """Rooms of which the last ones are test rooms, in each of which a random fifth of the spectra is tested.

    Of the others, L are known, drawn at random; fewer ones are among more.
    """

    split = "rooms"
    index_sha256 = ""

    def __init__(self, rooms: Rooms, test_rooms: int | None, tested: int | None, seed: int):
        if test_rooms is None:
            test_rooms = max(1, len(rooms) // TEST_ROOMS)
        require_whole(1, len(rooms), test_rooms=test_rooms)
        self.data, self.test_rooms, datasets = rooms, test_rooms, list(rooms)
        _require_one_array(datasets)
        first = len(rooms) - test_rooms
        self.training, self._tested = datasets[:first], datasets[first:]
        # A room keeps its test spectra, however many rooms are test rooms.
        drawn = [_drawn(each, [seed, first + number]) for number, each in enumerate(self._tested)]
        self._test = [test if tested is None else evenly(test, tested) for test, _ in drawn]
        self._others = [others for _, others in drawn]
        self.fingerprint = hashlib.sha256("".join(each.fingerprint for each in datasets).encode()).hexdigest()

    @property
    def tests(self) -> Sequence[tuple[Any, Int[np.ndarray, " K"]]]:
        return list(zip(self._tested, self._test, strict=True))

    def known(self, size: int | None, seed: int) -> list[Case]:
        cases = []
        for (dataset, test), others in zip(self.tests, self._others, strict=True):
            some = np.sort(np.random.default_rng([seed, len(others)]).permutation(others)[:size])
            cases.append(Case(dataset, Split(train=some, validation=some[:0], test=test), None))
        return cases

    def distances(self, size: int | None) -> None:
        """None: they differ by seed."""

    def sizes(self, asked: Sequence[int | None]) -> list[int | None]:
        """The numbers of known spectra that are asked for, or the usual ones that the rooms have."""
        rooms = zip(self._tested, map(len, self._others), strict=True)
        smallest, most = min(rooms, key=lambda each: each[1])
        if list(asked) == [None]:
            return [size for size in GIVEN if size <= most] or [most]
        largest = max(size for size in asked if size is not None)
        if largest > most:
            found = f"found {len(smallest)}, of which {most} are not tested"
            raise InputError(f"{smallest.folder}: expected {largest} known spectra beside the test spectra, {found}")
        return list(asked)


def _require_one_array(rooms: Sequence[Any]) -> None:
    """Refuse rooms of different arrays or frequencies, in which nothing can be learned for each other."""
    first = rooms[0]
    for room in rooms[1:]:
        if other_array(first.array, room.array):
            expected = f"the array of {first.folder.name}, {first.array.in_words}"
            raise InputError(f"{room.folder}: expected {expected}, found {room.array.in_words}")
        if other_frequency(first.wavelength, room.wavelength):
            expected = f"the frequency of {first.folder.name}, {first.frequency.hertz / 1e6:g} MHz"
            raise InputError(f"{room.folder}: expected {expected}, found {room.frequency.hertz / 1e6:g} MHz")


def _drawn(dataset: Any, seed: Sequence[int]) -> tuple[Int[np.ndarray, " K"], Int[np.ndarray, " n"]]:
    """A random fifth of the spectra, at least one, and the others."""
    order = np.random.default_rng(seed).permutation(len(dataset))
    count = max(1, math.ceil(len(dataset) / TESTED))
    return np.sort(order[:count]), np.sort(order[count:])


Cases = OneDataset | ManyRooms
"""What is known and tested in a comparison."""
