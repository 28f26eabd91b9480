"""Read text files of other programs: their lines, in whatever encoding, and the numbers in them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from io import BytesIO, TextIOWrapper

from scenes.files.errors import InputError, shown

BYTE_ORDER_MARKS = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16", b"\xef\xbb\xbf": "utf-8-sig"}

LONGEST_WHOLE = 18  # Most digits of a whole number, which then fits into 64 bits


def text_lines(data: bytes) -> Iterator[tuple[int, str]]:
    """Yield the numbers, from 1, and stripped lines of a text: as its mark says, else UTF-8 or Latin-1."""
    encoding = next((name for mark, name in BYTE_ORDER_MARKS.items() if data.startswith(mark)), None)
    if encoding is None:
        try:
            data.decode()
            encoding = "utf-8"
        except UnicodeDecodeError:
            encoding = "latin-1"
    for number, line in enumerate(TextIOWrapper(BytesIO(data), encoding, errors="replace"), 1):
        yield number, line.strip()


def coordinates(words: Sequence[str], label: str, line: int) -> list[float]:
    """Return the first three words as numbers."""
    try:
        values = decimals(words[:3])
    except ValueError:
        raise InputError(f"{label}: line {line}: expected numbers, found {shown(' '.join(words))}") from None
    if len(values) < 3:
        raise InputError(f"{label}: line {line}: expected vertices of three coordinates, found {len(values)}: {values}")
    return values


def decimals(words: Sequence[str]) -> list[float]:
    """Convert words to numbers. Raise a ValueError if one is not a number as other programs write it."""
    _require_digits(words)
    return [float(word) for word in words]


def whole_numbers(words: Sequence[str]) -> list[int]:
    """Convert words to whole numbers. Raise a ValueError as ``decimals`` does."""
    _require_digits(words)
    if any(len(word) > LONGEST_WHOLE for word in words):
        raise ValueError(words)
    return [int(word) for word in words]


def _require_digits(words: Sequence[str]) -> None:
    """Refuse 1_0 and digits of other scripts, which Python would read; all words at once, for speed."""
    text = "".join(words)
    if "_" in text or not text.isascii():
        raise ValueError(text)
