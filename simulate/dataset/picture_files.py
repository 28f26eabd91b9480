"""Read the pictures of a dataset folder; whatever else has the name of a picture is refused before it is decoded."""

from __future__ import annotations

import tempfile
import warnings
from collections.abc import Sequence
from io import BytesIO
from itertools import pairwise
from pathlib import Path

import numpy as np
from jaxtyping import UInt8
from PIL import Image

from scenes.files.errors import InputError, reason, shown
from scenes.files.input_file import MEGABYTE, read_bytes
from simulate.spectra.angular_grid import COLUMNS, ROWS

IN_MEMORY = 2 * 10**9
"""Bytes of pictures that are kept in memory; more are decoded into a temporary file and mapped."""

LARGEST_FILE = 10 * MEGABYTE
"""Bytes of a picture; one of 360 × 90 grey levels has at most 33 kB."""

MOST_PIXELS = 10**7
"""Of a picture that is converted: a tenth of a degree in both directions has 3.2 million."""

MOST_DIGITS = 9
"""Of the number that is a picture's name."""


def what_is_at(path: Path) -> str:
    """What is found at a path that should be a folder, for a message."""
    return "a file" if path.is_file() else "nothing there"


def is_number(name: str) -> bool:
    """Whether the name of a picture is a number: of at most nine of the digits 0 to 9.

    >>> is_number("00003"), is_number("٣"), is_number("9" * 20)
    (True, False, False)
    """
    return name.isascii() and name.isdecimal() and len(name) <= MOST_DIGITS


def picture_files(folder: Path) -> list[Path]:
    """The pictures of a dataset's folder ``spectrum``, by number; other programs number them from 0.

    Raises:
        InputError: there is no such folder, no picture whose name is a number in it, a number of too many digits, or
            two pictures of one number.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: expected a folder of pictures, found {what_is_at(folder)}")
    files = [path for path in folder.glob("*.png") if path.stem.isascii() and path.stem.isdecimal()]
    if not files:
        raise InputError(f"{folder}: expected pictures 00001.png and on, found none")
    long = min((path.name for path in files if not is_number(path.stem)), default=None)
    if long is not None:
        raise InputError(f"{folder}: expected names of at most {MOST_DIGITS} digits, found {shown(long)}")
    files.sort(key=lambda path: (int(path.stem), path.name))
    for one, other in pairwise(files):
        if int(one.stem) == int(other.stem):
            raise InputError(f"{folder}: expected one picture of each number, found {one.name} and {other.name}")
    return files


def read_pictures(folder: Path, problems: list[str]) -> tuple[list[str], UInt8[np.ndarray, "K 90 360"]]:
    """Read all pictures of a dataset.

    Args:
        folder: the dataset's folder ``spectrum``.
        problems: gets one sentence for each kind of unreadable pictures, with their number.

    Returns:
        Names of the pictures, and their grey levels.
    """
    try:
        files = picture_files(folder)
        if int(files[0].stem) == 0:
            found = f"found {files[0].name}; bisplat convert numbers them from 1"
            raise InputError(f"{folder}: expected pictures 00001.png and on, {found}")
    except InputError as error:
        problems.append(str(error))
        return [], np.zeros((0, ROWS, COLUMNS), np.uint8)
    pictures = _zeros((len(files), ROWS, COLUMNS))
    sentences: dict[str, list[str]] = {}  # of each kind of fault
    for index, path in enumerate(files):
        try:
            pictures[index] = read_picture(path)
        except InputError as error:
            kind = str(error).removeprefix(str(path)).split("damaged")[0]
            sentences.setdefault(kind, []).append(str(error))
    problems += [summary(alike, "pictures") for alike in sentences.values()]
    return [path.stem for path in files], pictures


def read_all(folder: Path) -> tuple[list[str], UInt8[np.ndarray, "K 90 360"]]:
    """Read all pictures of a folder: their names and grey levels.

    Args:
        folder: pictures 00001.png and on.

    Raises:
        InputError: there are none, or some cannot be read.
    """
    problems: list[str] = []
    found = read_pictures(folder, problems)
    if problems:
        raise InputError(problems[0])
    return found


def _zeros(shape: tuple[int, ...]) -> UInt8[np.ndarray, "*shape"]:
    """Zeros, in memory or in a mapped temporary file that is removed when the process ends."""
    size = int(np.prod(shape))
    if size <= IN_MEMORY:
        return np.zeros(shape, np.uint8)
    with tempfile.TemporaryFile() as file:
        file.truncate(size)
        return np.memmap(file, np.uint8, "r+", shape=shape)


def summary(alike: Sequence[str], things: str) -> str:
    """The first of some sentences on the same fault, and the number of the others.

    >>> summary(["a.png: damaged", "b.png: damaged", "c.png: damaged"], "pictures")
    'a.png: damaged; 2 more pictures have the same fault'
    """
    more = len(alike) - 1
    verb = "have" if more > 1 else "has"
    thing = things if more > 1 else things.removesuffix("s")
    return alike[0] + (f"; {more} more {thing} {verb} the same fault" if more else "")


def read_picture(path: Path) -> UInt8[np.ndarray, "90 360"]:
    """Read one 8-bit grey spectrum picture.

    Args:
        path: the PNG file.

    Returns:
        Grey levels; the dataset's grid says which directions its rows and columns are.

    Raises:
        InputError: not a readable PNG, or not 360 × 90 pixels of 8-bit grey.
    """
    picture, mode = read_any_picture(path)
    if picture.shape != (ROWS, COLUMNS) or mode != "L":
        height, width = picture.shape[:2]
        raise InputError(
            f"{path}: expected {COLUMNS} × {ROWS} pixels of 8-bit grey (mode L), found "
            f"{width} × {height} of mode {mode}{_mended_by(height, width)}"
        )
    return picture


def _mended_by(height: int, width: int) -> str:
    if (height, width) == (COLUMNS, ROWS):
        return ", as a transposed spectrum has; bisplat convert turns it"
    if (height, width) != (ROWS, COLUMNS):
        return "; bisplat convert samples it at the directions of this format"
    return "; bisplat convert makes 8-bit grey of it"


def read_any_picture(path: Path) -> tuple[np.ndarray, str]:
    """Read a PNG of any size and mode: its pixels, and Pillow's name of its mode.

    Raises:
        InputError: not a regular file of at most ``LARGEST_FILE`` bytes, not a readable PNG, one of several frames, or
            one of more than ``MOST_PIXELS`` pixels, which its header tells before any is decoded.
    """
    content = read_bytes(path, "a PNG picture", LARGEST_FILE)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # our sentences say what Pillow warns of
            with Image.open(BytesIO(content), formats=["PNG"]) as image:
                width, height = image.size
                frames = getattr(image, "n_frames", 1)
                if width * height <= MOST_PIXELS and frames == 1:
                    image.load()
                    return np.asarray(image), image.mode
    except Image.DecompressionBombError:
        raise _too_large(path, "more") from None
    except Image.UnidentifiedImageError:
        found = "a damaged one or a file of another kind"
        raise InputError(f"{path}: expected a whole PNG picture, found {found}") from None
    except Exception as error:  # damage makes Pillow raise errors of many classes
        raise InputError(f"{path}: expected a whole PNG picture, found a damaged one ({reason(error)})") from error
    if frames > 1:
        raise InputError(f"{path}: expected a PNG picture of one frame, found one of {frames}")
    raise _too_large(path, f"{width} × {height}")


def _too_large(path: Path, found: str) -> InputError:
    return InputError(f"{path}: expected a PNG picture of at most {MOST_PIXELS // 10**6} million pixels, found {found}")
