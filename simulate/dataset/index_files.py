"""Index files, which list the rows of a part: by the names of their pictures, or by numbers from 0."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Int

from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError, shown
from scenes.files.input_file import MEGABYTE, read_text
from simulate.dataset.inspection import Inspection
from simulate.dataset.picture_files import summary

TEST_FRACTION = 0.2  # Share of the rows in test_index.txt

LARGEST_INDEX = 20 * MEGABYTE  # Most bytes of an index file. A million names of six digits take 7 MB.


def read_split(
    found: Inspection, names: Sequence[str], rows: str, needed: bool = False
) -> tuple[Int[np.ndarray, " n"], Int[np.ndarray, " t"]]:
    """Read a folder's own split of rows that have these names; empty if there are no index files, or no rows."""
    train, test = (found.folder / f"{part}_index.txt" for part in ("train", "test"))
    if not names or not (needed or train.exists() or test.exists()):
        return np.zeros(0, int), np.zeros(0, int)
    listed = [found.noting(None, read_rows, path, names) for path in (train, test)]
    parts = [np.array(list(dict.fromkeys(each or [])), int) for each in listed]
    for path, each, part in zip((train, test), listed, parts, strict=True):
        if repeated := len(each or []) - len(part):
            found.warnings.append(f"{path.name} names {repeated} {rows} more than once; each counts once")
    both = np.intersect1d(parts[0], parts[1])
    if len(both):
        others = f"expected {rows} that are not in train_index.txt"
        found.problems.append(f"{test}: {others}, found {names[both[0]]} in both ({len(both)} in all)")
    unused = len(names) - len(np.union1d(parts[0], parts[1]))
    if unused and not found.problems:
        found.warnings.append(f"{unused} {rows} are in neither train_index.txt nor test_index.txt")
    return parts[0], parts[1]


def read_rows(path: Path, names: Sequence[str]) -> list[int]:
    """Read an index file of rows that have these names."""
    numbered = names[0] == "0"
    listed = read_text(path, f"{'a number' if numbered else 'a picture name'} in each line", LARGEST_INDEX).split()
    index_of = {name: index for index, name in enumerate(names)}
    unknown = [(row, name) for row, name in enumerate(listed, start=1) if name not in index_of]
    if not unknown:
        return [index_of[name] for name in listed]
    row, name = unknown[0]
    if numbered:
        sentence = f"{path}, row {row}: expected a whole number from 0 to {names[-1]}, found {shown(name)}"
        sentence += "; the first row has the number 0" if name == str(len(names)) else ""
    else:
        sentence = f"{path}, row {row}: expected the name of a picture, found {shown(name)}, which has no picture"
        numbers = {"0", *(str(int(each)) for each in names)}
        if len(unknown) == len(listed) and all(each in numbers for each in listed):
            sentence += "; the names lack leading zeros, as GSRF writes them: bisplat dataset adds them"
    raise InputError(summary([sentence] * len(unknown), "rows"))


def read_index(path: Path, names: Sequence[str]) -> Int[np.ndarray, " n"]:
    """Read an index file that names at least one row, and each once."""
    index = read_rows(path, names)
    if not index:
        raise InputError(f"{path}: expected one picture name per line, found an empty file")
    if len(set(index)) < len(index):
        repeated = next(name for name, count in Counter(index).items() if count > 1)
        raise InputError(f"{path}: expected each name once, found {names[repeated]} more than once")
    return np.array(index, dtype=int)


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
