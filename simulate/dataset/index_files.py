"""Index files: those that name pictures, and those that number positions from 0."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Int

from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError, shown
from scenes.files.input_file import MEGABYTE, parse_whole, read_text
from simulate.dataset.inspection import Inspection
from simulate.dataset.picture_files import summary

TEST_FRACTION = 0.2  # Share of the rows in test_index.txt

LARGEST_INDEX = 20 * MEGABYTE  # Most bytes of an index file. A million names of six digits take 7 MB.


def read_names(path: Path, names: Sequence[str], problems: list[str]) -> list[int]:
    """Read an index file."""
    if not names:
        return []  # the pictures are the problem, not every row of this file
    try:
        listed = read_text(path, "one picture name per line", LARGEST_INDEX).split()
    except InputError as error:
        problems.append(str(error))
        return []
    index_of = {name: index for index, name in enumerate(names)}
    unknown = [(row, name) for row, name in enumerate(listed, start=1) if name not in index_of]
    if unknown:
        row, name = unknown[0]
        sentence = f"{path}, row {row}: expected the name of a picture, found {shown(name)}, which has no picture"
        numbers = {str(int(each)) for each in names}
        if len(unknown) == len(listed) and all(each in numbers | {"0"} for each in listed):
            sentence += "; the names lack leading zeros, as GSRF writes them: bisplat convert adds them"
        problems.append(summary([sentence] * len(unknown), "rows"))
    return [index_of[name] for name in listed if name in index_of]


def read_split(
    folder: Path, names: list[str], metadata: dict[str, Any], problems: list[str], warnings: list[str]
) -> tuple[list[int], list[int]]:
    """Read the folder's own split."""
    files = {label: folder / f"{label}_index.txt" for label in ("train", "test")}
    simulated = "scene_file" in metadata  # an unfinished simulation has no index files yet
    if not simulated and not any(path.exists() for path in files.values()):
        warnings.append("there are no index files: use the split random (or blocked, from 21 spectra on)")
        return [], []
    train, test = (read_names(path, names, problems) for path in files.values())
    for path, index in zip(files.values(), (train, test), strict=True):
        repeated = len(index) - len(set(index))
        if repeated:
            warnings.append(f"{path.name} names {repeated} spectra more than once; each counts once")
    train, test = list(dict.fromkeys(train)), list(dict.fromkeys(test))
    _compare(files["test"], train, test, names, ("names", "spectra"), problems, warnings)
    return train, test


def _compare(
    path: Path,
    train: Sequence[int] | Int[np.ndarray, " n"],
    test: Sequence[int] | Int[np.ndarray, " t"],
    names: Sequence[object],
    what: tuple[str, str],
    problems: list[str],
    warnings: list[str],
) -> None:
    """Note names in both parts, and warn of those in neither."""
    both = np.intersect1d(train, test)
    if len(both):
        problems.append(
            f"{path}: expected {what[0]} that are not in train_index.txt, found {names[both[0]]} in both "
            f"({len(both)} in all)"
        )
    unused = len(names) - len(np.union1d(train, test))
    if unused and not problems:
        warnings.append(f"{unused} {what[1]} are in neither train_index.txt nor test_index.txt")


def read_index(path: Path, names: Sequence[str]) -> Int[np.ndarray, " n"]:
    """Read an index file."""
    problems: list[str] = []
    index = read_names(path, names, problems)
    if not index and not problems:
        problems.append(f"{path}: expected one picture name per line, found an empty file")
    if len(set(index)) < len(index):
        repeated = next(name for name, count in Counter(index).items() if count > 1)
        problems.append(f"{path}: expected each name once, found {names[repeated]} more than once")
    if problems:
        raise InputError(problems[0])
    return np.array(index, dtype=int)


def numbered_split(found: Inspection, count: int) -> tuple[Int[np.ndarray, " n"], Int[np.ndarray, " t"]]:
    """Read a folder's own split of rows that are numbered from 0; empty if there are no rows or no index files."""
    files = [found.folder / f"{part}_index.txt" for part in ("train", "test")]
    nothing = np.zeros(0, dtype=int)
    if not count or not any(path.exists() for path in files):
        return nothing, nothing
    train, test = (found.noting(nothing, read_numbers, path, count) for path in files)
    _compare(files[1], train, test, range(count), ("numbers", "positions"), found.problems, found.warnings)
    return train, test


def write_index(path: Path, names: Iterable[object]) -> None:
    """Write train_index.txt or test_index.txt."""
    write_atomically(path, "".join(f"{name}\n" for name in names).encode())


def write_drawn_split(folder: Path, count: int, seed: int) -> None:
    """Draw an 80/20 split of rows that are numbered from 0, and write its index files; none for a single row."""
    if count < 2:
        return
    tested = max(1 if count < 4 else 2, round(TEST_FRACTION * count))
    test = np.sort(np.random.default_rng(seed).permutation(count)[:tested])
    write_index(folder / "train_index.txt", np.setdiff1d(np.arange(count), test))
    write_index(folder / "test_index.txt", test)


def read_numbers(path: Path, count: int) -> Int[np.ndarray, " n"]:
    """Read an index file: whole numbers from 0, one in each line."""
    lines = read_text(path, "the number of a position in each line", LARGEST_INDEX).split("\n")
    while lines and not lines[-1].strip():
        lines.pop()
    if not lines:
        raise InputError(f"{path}: expected the number of a position in each line, found an empty file")
    numbers = []
    for row, line in enumerate(lines, start=1):
        try:
            numbers.append(parse_whole(line))
        except ValueError:
            numbers.append(-1)
        if not 0 <= numbers[-1] < count:
            raise InputError(
                f"{path}, row {row}: expected a whole number from 0 to {count - 1}, found {shown(line.strip())}"
                + ("; the first position has the number 0" if numbers[-1] == count else "")
            )
    return np.array(list(dict.fromkeys(numbers)), dtype=int)
