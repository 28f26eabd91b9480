"""The CSV files in per_sample/: the scores of each test spectrum, a file for each row of a comparison."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float

from learn.data.metrics import Scores
from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError, shown
from scenes.files.input_file import MEGABYTE, parse_number, read_text

COLUMNS = ("ssim", "psnr_db", "mae", "aoa_error_deg")
"""Columns of the file after the first one, ``name``, which is that of the spectrum."""

LARGEST = 100 * MEGABYTE
"""Largest size of the file, bytes: a hundred for each of a million spectra."""


def write_scores(path: Path, names: Sequence[str], scores: Scores) -> None:
    """Write the scores of K spectra."""
    columns = zip(scores.ssim, scores.psnr, scores.mae, scores.aoa_error, strict=True)
    lines = [f"{name}," + ",".join(f"{value:.6f}" for value in row) for name, row in zip(names, columns, strict=True)]
    write_atomically(path, "\n".join([",".join(["name", *COLUMNS]), *lines, ""]).encode())


def read_scores(path: Path) -> dict[str, Float[np.ndarray, " K"]]:
    """Read what ``write_scores`` wrote: the scores of K spectra, by ``COLUMNS``."""
    expected = "the scores of each test spectrum"
    lines = read_text(path, expected, LARGEST).splitlines()
    header = ",".join(["name", *COLUMNS])
    if lines[:1] != [header]:
        raise InputError(f"{path}, line 1: expected the header {header}, found {shown(''.join(lines[:1]))}")
    values = [_numbers(line) for line in lines[1:]]
    if None in values:
        number = values.index(None) + 1
        found = shown(lines[number])
        raise InputError(f"{path}, line {number + 1}: expected a name and {len(COLUMNS)} finite numbers, found {found}")
    if not values:
        raise InputError(f"{path}: expected {expected}, found none")
    return dict(zip(COLUMNS, np.array(values).T, strict=True))


def _numbers(line: str) -> list[float] | None:
    """The numbers of a line. None: there are more or fewer than expected, or one is not a finite number."""
    _, *texts = line.split(",")
    try:
        values = [parse_number(text) for text in texts]
    except ValueError:
        return None
    return values if len(values) == len(COLUMNS) and np.isfinite(values).all() else None
