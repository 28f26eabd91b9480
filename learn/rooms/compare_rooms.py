"""Comparison of methods in rooms that they were not trained in, given a few known spectra of each."""

from __future__ import annotations

import hashlib
import math
import time
from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Int

from learn.comparison.method_factories import (
    built,
    check_effort,
    checked_spectra,
    chosen_methods,
    is_own,
    named,
    source_of,
)
from learn.comparison.results_folder import ResultsFile, given_folder, results_in, row_name
from learn.data.metrics import ssim
from learn.data.same_receiver import other_array, other_frequency
from learn.rooms.room_comparison import RoomComparison, RoomProtocol, RoomRow
from learn.rooms.room_methods import ROOM_METHODS, USUAL, KnownInRoom, RoomMethod
from learn.training.run_files import device_name
from scenes.files.errors import (
    InputError,
    ParameterError,
    require_instance,
    require_seed,
    require_whole,
    shown,
)
from scenes.files.plain_text import say
from simulate.dataset.dataset import Dataset
from simulate.dataset.rooms_folder import Rooms, read_rooms
from simulate.positions.positions import MOST_POSITIONS
from simulate.spectra.spectrum import evenly

GIVEN = 5, 10, 25, 50, 100  # Numbers of known spectra of a test room

TESTED = 5  # One of so many spectra of a test room is a test spectrum, drawn at random

TEST_ROOMS = 4  # One of so many rooms is a test room, if none are asked for: the last ones


def compare_rooms(
    rooms: Rooms | Path | str,
    methods: Sequence[str] | Mapping[str, str | RoomMethod | Callable[[], RoomMethod]] | None = None,
    *,
    given: Sequence[int] | None = None,
    test_rooms: int | None = None,
    test_spectra: int | None = None,
    seed: int = 0,
    seeds: int = 1,
    budget: float = 5.0,
    output: Path | str | None = None,
) -> RoomComparison:
    """Score methods in rooms in which they were not trained.

    The last rooms of the folder are test rooms, the others training rooms. In each test room a random fifth of the
    spectra is tested, and L of the others, drawn at random, are known. All methods get the same L known spectra, the
    same for all test positions, and fewer ones are among more. So a score says what L measurements in a new room are
    worth. (GRaF [yang2026] takes for each test position the L nearest of many measured spectra, which are nearer.)

    A method is an object with two methods. ``fit(room)`` takes ``room.positions`` [L, 3] (metres) and ``room.spectra``
    [L, 90, 360]; ``room.known`` are their indices in ``room.dataset``. ``predict(positions)`` takes positions [K, 3],
    and returns spectra [K, 90, 360]. If it also has ``learn(rooms, minutes, seed)``, this is called once before, with
    the datasets of the training rooms.

    Args:
        rooms: rooms that ``simulate_rooms`` made, or their folder.
        methods: some of "mean" (of the known spectra: k nearest neighbours with k = L), "nearest", "inverse-distance"
            (of the four nearest), "helmholtz" (fitted to the known spectra and responses of the room alone),
            "helmholtz-pictures" (without the responses), "mirror-images" (waves of the gateway's mirror images in the
            walls, fitted to the known responses alone), "attention" (over the nearest known spectra, trained in the
            training rooms: the principle of GRaF), "twin" (with a description of the room that is 3 cm and 20 % wrong),
            or classes of your own ("module:Class"). Or a dictionary from the label of a row to one of these. None: all
            but "helmholtz-pictures" and the twin, which take minutes for each fit.
        given: numbers L of known spectra. None: those of 5, 10, 25, 50 and 100 that the rooms have.
        test_rooms: number of test rooms. None: a quarter of the rooms.
        test_spectra: largest number of test spectra in a room, evenly spread over them. None: all of them.
        seed: seed of the choice of test spectra.
        seeds: number of fits of each method, with seeds 0, 1, …; each knows other spectra.
        budget: training time of each method that learns in other rooms, minutes.
        output: folder that keeps each row as soon as it is measured, in results.jsonl. The same call again measures
            those that are missing. None: nothing is kept.

    Returns:
        The scores, with those that the output has from earlier calls.

    Raises:
        InputError: the folder cannot be read, rooms have different arrays or frequencies, or a room has too few
            spectra; or the output has a comparison with other settings, or other files; or something went wrong in a
            method of your own.
        ParameterError: a method is unknown, or learns in other rooms where there are none, or another argument is out
            of its range.

    Example:
        >>> import bisplat
        >>> coarse = bisplat.Propagation(max_depth=0, diffraction=False)
        >>> rooms = bisplat.simulate_rooms("data/two-rooms", 2, spectra=12, propagation=coarse)
        >>> comparison = bisplat.compare_rooms(rooms, ["mean", "nearest"], given=[5])
        >>> sorted(row["label"] for row in comparison), comparison.test
        (['mean', 'nearest'], ('room-001',))
    """
    check_effort(budget, seeds)
    require_seed(seed=seed)
    folder = given_folder(output)
    require_instance(Rooms, str, PathLike, rooms=rooms)
    rooms = rooms if isinstance(rooms, Rooms) else read_rooms(rooms)
    chosen = chosen_methods(USUAL if methods is None else methods, ROOM_METHODS)
    if test_rooms is None:
        test_rooms = max(1, len(rooms) // TEST_ROOMS)
    require_whole(1, len(rooms), test_rooms=test_rooms)
    if test_spectra is not None:
        require_whole(1, MOST_POSITIONS, test_spectra=test_spectra)
    training, test = rooms.names[: len(rooms) - test_rooms], rooms.names[len(rooms) - test_rooms :]
    learning = [label for label, make in chosen.items() if hasattr(built(label, make, "methods"), "learn")]
    if learning and not training:
        if methods is not None:
            found = f"found {len(rooms)}, of which {len(test)} are test rooms"
            raise ParameterError("methods", f"expected a training room for {learning[0]}, {found}")
        say(f"without {', '.join(learning)}: there is no training room to learn in")
        chosen = {label: make for label, make in chosen.items() if label not in learning}
    datasets = dict(zip(rooms.names, rooms, strict=True))
    _require_one_array(list(datasets.values()))
    # A room keeps its test spectra, however many rooms are test rooms.
    tested = [_parts(datasets[name], test_spectra, [seed, rooms.names.index(name)]) for name in test]
    sizes = _sizes(given, [(datasets[name], len(others)) for name, (_, others) in zip(test, tested, strict=True)])
    settings = {
        "rooms": str(rooms.folder.resolve()),
        "setting": rooms.setting,
        "test_rooms": test_rooms,
        "test_spectra": test_spectra,
        "seed": seed,
        "minutes": float(budget),
        "device": device_name(),
    }
    learned_in, tested_in = [datasets[name] for name in training], [datasets[name] for name in test]
    parts = list(zip(tested_in, tested, strict=True))

    def fingerprint() -> str:
        return hashlib.sha256("".join(room.fingerprint for room in datasets.values()).encode()).hexdigest()

    with results_in(folder, "comparison in rooms", settings, fingerprint, (RoomProtocol, RoomRow)) as kept:
        for number in range(seeds):
            for label, make in chosen.items():
                _measure(label, make, learned_in, parts, sizes, number, budget, kept)
        rows = kept.rows
    return RoomComparison(
        folder=rooms.folder, setting=rooms.setting, training=training, test=test, minutes=budget, rows=rows
    )


Parts = tuple[Int[np.ndarray, " K"], Int[np.ndarray, " n"]]
"""Indices of a room's test spectra, and of those that can be known."""


def _require_one_array(rooms: Sequence[Dataset]) -> None:
    """Refuse rooms of different arrays or frequencies, in which nothing can be learned for each other."""
    first = rooms[0]
    for room in rooms[1:]:
        if other_array(first.array, room.array):
            expected = f"the array of {first.folder.name}, {first.array.in_words}"
            raise InputError(f"{room.folder}: expected {expected}, found {room.array.in_words}")
        if other_frequency(first.wavelength, room.wavelength):
            expected = f"the frequency of {first.folder.name}, {first.frequency.hertz / 1e6:g} MHz"
            raise InputError(f"{room.folder}: expected {expected}, found {room.frequency.hertz / 1e6:g} MHz")


def _parts(dataset: Dataset, test_spectra: int | None, seed: Sequence[int]) -> Parts:
    """A random fifth of the spectra, at least one, and the others."""
    order = np.random.default_rng(seed).permutation(len(dataset))
    count = max(1, math.ceil(len(dataset) / TESTED))
    test = np.sort(order[:count])
    return (test if test_spectra is None else evenly(test, test_spectra)), np.sort(order[count:])


def _sizes(given: Sequence[int] | None, rooms: Sequence[tuple[Dataset, int]]) -> list[int]:
    """The numbers of known spectra, rising."""
    smallest, most = min(rooms, key=lambda each: each[1])
    if given is None:
        sizes = [size for size in GIVEN if size <= most]
        if sizes:
            return sizes
        given = GIVEN[:1]
    require_instance(list, tuple, given=given)
    for size in given:
        require_whole(1, MOST_POSITIONS, given=size)
    if not given or len(set(given)) < len(given):
        raise ParameterError("given", f"expected different numbers of known spectra, found {shown(list(given))}")
    if max(given) > most:
        found = f"found {len(smallest)}, of which {most} are not tested"
        raise InputError(f"{smallest.folder}: expected {max(given)} known spectra beside the test spectra, {found}")
    return sorted(given)


def _measure(
    label: str,
    make: Callable[[], Any],
    training: Sequence[Dataset],
    tested: Sequence[tuple[Dataset, Parts]],
    sizes: Sequence[int],
    seed: int,
    minutes: float,
    kept: ResultsFile,
) -> None:
    """Measure the missing rows of a method with one seed."""
    method = built(label, make, "methods")
    source = source_of(label, method, ROOM_METHODS)
    keys: list[dict[str, Any]] = [{"label": label, "seed": seed, "train_size": size} for size in sizes]
    own = is_own(method)
    missing = [key for key in keys if not kept.is_measured(key, row_name(key), own, source)]
    if not missing:
        return
    say(f"{label}, seed {seed}")
    if hasattr(method, "learn"):
        with named(label, method, "learn to learn from rooms"):
            method.learn(training, minutes, seed)
    for key in missing:
        scores, began = [], time.perf_counter()
        for dataset, (test, others) in tested:
            known = np.random.default_rng([seed, len(others)]).permutation(others)[: key["train_size"]]
            with named(label, method, "fit to learn from what is known"):
                method.fit(KnownInRoom(dataset, known, seed))
            with named(label, method, "predict to return predictions"):
                predicted = checked_spectra(label, method.predict(dataset.positions[test]), len(test))
            scores.append(ssim(predicted, dataset.spectra[test]))
        together = np.concatenate(scores)
        row = {
            "spectra": len(together),
            "ssim_mean": round(float(together.mean()), 4),
            "ssim_median": round(float(np.median(together)), 4),
            "rooms": [round(float(np.median(each)), 4) for each in scores],
            "steps": getattr(method, "steps", None),
            "seconds": round((time.perf_counter() - began) / len(tested), 3),
        }
        kept.keep(key, row if source is None else {**row, "source": source})
