"""Read index files that number the positions from 0, as those of received powers and of channels do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Int

from scenes.files.errors import InputError, shown
from scenes.files.input_file import parse_whole, read_text
from simulate.dataset.index_files import LARGEST_INDEX


def numbered_split(
    folder: Path, count: int, problems: list[str], warnings: list[str]
) -> tuple[Int[np.ndarray, " n"], Int[np.ndarray, " t"]]:
    """Read the folder's own split."""
    files = [folder / f"{part}_index.txt" for part in ("train", "test")]
    parts = [np.zeros(0, dtype=int), np.zeros(0, dtype=int)]
    if not any(path.exists() for path in files):
        return parts[0], parts[1]
    for number, path in enumerate(files):
        try:
            parts[number] = read_numbers(path, count)
        except InputError as error:
            problems.append(str(error))
    both = np.intersect1d(parts[0], parts[1])
    if len(both):
        problems.append(
            f"{files[1]}: expected numbers that are not in train_index.txt, found {both[0]} in both "
            f"({len(both)} in all)"
        )
    unused = count - len(np.union1d(parts[0], parts[1]))
    if unused and not problems:
        warnings.append(f"{unused} positions are in neither train_index.txt nor test_index.txt")
    return parts[0], parts[1]


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
