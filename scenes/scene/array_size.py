"""Read the size of an array, such as 8x8 or 4x4@0.491."""

from __future__ import annotations

import re

from scenes.files.errors import ParameterError, shown

PATTERN = re.compile(r"(\d{1,4})[x×X](\d{1,4})(?:@(\d{1,9}(?:\.\d{1,9})?|\.\d{1,9}))?")


def read_array(text: str) -> tuple[int, int, float | None]:
    """Read the number of elements of a planar array, and their spacing.

    >>> read_array("8x8"), read_array("1x16@0.25")
    ((8, 8, None), (1, 16, 0.25))
    """
    match = PATTERN.fullmatch(text) if isinstance(text, str) else None
    if match is None:
        expected = "expected ROWSxCOLUMNS or ROWSxCOLUMNS@SPACING in wavelengths, such as 8x8 or 4x4@0.491"
        raise ParameterError("array", f"{expected}, found {shown(text)}")
    return int(match[1]), int(match[2]), float(match[3]) if match[3] else None
