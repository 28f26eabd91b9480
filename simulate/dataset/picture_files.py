"""The pictures of a dataset folder. Any other file with the name of a picture is refused before it is decoded."""

from __future__ import annotations

import tempfile
import warnings
import zlib
from collections.abc import Sequence
from io import BytesIO
from itertools import pairwise
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int, UInt8
from PIL import Image

from scenes.files.errors import InputError, reason, shown
from scenes.files.input_file import MEGABYTE, read_bytes, what_is_at
from simulate.spectra.angular_grid import COLUMNS, ROWS

IN_MEMORY = 2 * 10**9
"""Most bytes of pictures in memory. More pictures are decoded into a temporary file, which is mapped."""

LARGEST_FILE = 10 * MEGABYTE
"""Most bytes of a picture's file. A picture of 360 × 90 grey levels has at most 33 kB."""

MOST_PIXELS = 10**7
"""Most pixels of a picture to convert. One with steps of 0.1° in both directions has 3.2 million."""

MOST_DIGITS = 9  # Most digits of the number that is a picture's name


def is_number(name: str) -> bool:
    """Whether the name of a picture is a number of at most nine digits 0 to 9."""
    return name.isascii() and name.isdecimal() and len(name) <= MOST_DIGITS


def picture_files(folder: Path) -> list[Path]:
    """The pictures in the folder ``spectrum`` of a dataset, in the order of their numbers, from 0 or 1 on."""
    if not folder.is_dir():
        raise InputError(f"{folder}: expected a folder of pictures, found {what_is_at(folder)}")
    entries = sorted(path for path in folder.iterdir() if path.suffix)
    files = [
        path for path in entries if path.suffix.lower() == ".png" and path.stem.isascii() and path.stem.isdecimal()
    ]
    if not files:
        found = f"found others, such as {shown(entries[0].name)}" if entries else "found none"
        raise InputError(f"{folder}: expected pictures 00001.png, 00002.png, ..., {found}")
    long = min((path.name for path in files if not is_number(path.stem)), default=None)
    if long is not None:
        raise InputError(f"{folder}: expected names of at most {MOST_DIGITS} digits, found {shown(long)}")
    files.sort(key=lambda path: (int(path.stem), path.name))
    for one, other in pairwise(files):
        if int(one.stem) == int(other.stem):
            raise InputError(f"{folder}: expected one picture for each number, found {one.name} and {other.name}")
    return files


def read_pictures(folder: Path, problems: list[str]) -> tuple[list[str], UInt8[np.ndarray, "K 90 360"]]:
    """Read all pictures of a dataset."""
    try:
        files = picture_files(folder)
        if int(files[0].stem) == 0:
            found = f"found {files[0].name}; bisplat dataset numbers them from 1"
            raise InputError(f"{folder}: expected pictures 00001.png, 00002.png, ..., {found}")
    except InputError as error:
        problems.append(str(error))
        return [], np.zeros((0, ROWS, COLUMNS), np.uint8)
    pictures = _zeros((len(files), ROWS, COLUMNS))
    sentences: dict[str, list[str]] = {}  # by kind of fault
    for index, path in enumerate(files):
        try:
            pictures[index] = read_picture(path)
        except InputError as error:
            kind = str(error).removeprefix(str(path)).split("damaged")[0]
            sentences.setdefault(kind, []).append(str(error))
    problems += [summary(alike, "pictures") for alike in sentences.values()]
    return [path.stem for path in files], pictures


def read_all(folder: Path) -> tuple[list[str], UInt8[np.ndarray, "K 90 360"]]:
    """Read all pictures of a folder: their names and grey levels."""
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
    """The first of several sentences on the same fault, with the number of the others."""
    more = len(alike) - 1
    verb = "have" if more > 1 else "has"
    thing = things if more > 1 else things.removesuffix("s")
    return alike[0] + (f"; {more} more {thing} {verb} the same fault" if more else "")


def read_picture(path: Path) -> UInt8[np.ndarray, "90 360"]:
    """Read one 8-bit grey picture."""
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
        return ", a transposed spectrum; bisplat dataset transposes it back"
    options = " and ".join((["--elevations"] if height != ROWS else []) + (["--azimuths"] if width != COLUMNS else []))
    if options:
        return f"; bisplat dataset samples it at the directions of this format, given {options}"
    return "; bisplat dataset turns it into 8-bit grey"


def read_any_picture(path: Path) -> tuple[Int[np.ndarray, "H W"], str]:
    """Read a PNG of grey levels, of any size and mode: the levels, and Pillow's name for its mode."""
    content = read_bytes(path, "a PNG picture", LARGEST_FILE)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # our messages cover what Pillow warns about
            with Image.open(BytesIO(content), formats=["PNG"]) as image:
                width, height = image.size
                frames = getattr(image, "n_frames", 1)
                if width * height <= MOST_PIXELS and frames == 1:
                    image.load()
                    pixels, mode = _pixels(image), image.mode
    except Image.DecompressionBombError:
        raise _too_large(path, "more") from None
    except Image.UnidentifiedImageError:
        found = "a damaged one or a file of another kind"
        raise InputError(f"{path}: expected a whole PNG picture, found {found}") from None
    except Exception as error:  # Pillow raises errors of many classes for damaged files
        raise InputError(f"{path}: expected a whole PNG picture, found a damaged one ({reason(error)})") from error
    if frames > 1:
        raise InputError(f"{path}: expected a PNG picture with one frame, found one with {frames}")
    if width * height > MOST_PIXELS:
        raise _too_large(path, f"{width} × {height}")
    if pixels.ndim == 3:
        if np.ptp(pixels, axis=-1).any():
            raise InputError(
                f"{path}: expected grey levels, found a picture of mode {mode} with colours that are not grey, whose "
                "order from dark to bright is not known"
            )
        pixels = pixels[..., 0]
    return pixels, mode


def _pixels(image: Image.Image) -> np.ndarray:
    """Grey levels [H, W] or colours [H, W, 3], without transparency; the colours of a palette, not their numbers."""
    if image.mode in ("L", "LA", "1"):
        return np.asarray(image.convert("L"))
    if image.mode.startswith("I"):
        return np.asarray(image)
    return np.asarray(image.convert("RGB"))


def _too_large(path: Path, found: str) -> InputError:
    return InputError(f"{path}: expected a PNG picture of at most {MOST_PIXELS // 10**6} million pixels, found {found}")


def encode_picture(picture: UInt8[np.ndarray, "90 360"]) -> bytes:
    """The PNG file of one picture: 8-bit grey."""
    buffer = BytesIO()
    # Runs of equal bytes alone take a quarter of the time of Pillow's default, and the files are a sixth larger.
    Image.fromarray(picture).save(buffer, format="PNG", compress_level=1, compress_type=zlib.Z_RLE)
    return buffer.getvalue()


def encode_power(power_db: Float[np.ndarray, "90 360"]) -> bytes:
    """The TIFF file of a spectrum's absolute power in dB: one channel of float32, with rows as in the pictures."""
    buffer = BytesIO()
    # Uncompressed, since every reader can read that, and compression would save a fifth at most.
    Image.fromarray(power_db.astype(np.float32)).save(buffer, format="TIFF")
    return buffer.getvalue()


def picture_names(count: int) -> list[str]:
    """Names from 1 on, padded with zeros to five digits, or more if needed."""
    digits = max(5, len(str(count)))
    return [f"{number:0{digits}d}" for number in range(1, count + 1)]
