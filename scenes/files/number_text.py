"""Numbers as text, in files and options: digits 0 to 9, a point and an exponent.

Python's ``float`` and ``int`` read more than that: 1_0 is 10 for them, and full-width or Arabic digits count, too. In a
table of positions these are typing errors.
"""

from __future__ import annotations

import re

from scenes.files.errors import shown

WHOLE = re.compile(r"[-+]?[0-9]+")

NUMBER = re.compile(
    r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?|[-+]?(nan|inf|infinity)", re.IGNORECASE | re.ASCII
)


def parse_number(text: str) -> float:
    """Read a number. Space around it is ignored. NaN and infinity are read, too, since range checks name them.

    >>> parse_number(" -1.5e3")
    -1500.0
    >>> parse_number("1_0")
    Traceback (most recent call last):
    ValueError: expected a number, found '1_0'
    """
    if not NUMBER.fullmatch(text.strip()):
        raise ValueError(f"expected a number, found {shown(text)}")
    return float(text)


def parse_whole(text: str) -> int:
    """Read a whole number. Space around it is ignored.

    >>> parse_whole("-12")
    -12
    """
    if not WHOLE.fullmatch(text.strip()):
        raise ValueError(f"expected a whole number, found {shown(text)}")
    return int(text)
