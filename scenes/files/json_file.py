"""Read JSON from the user. All of the program's JSON is parsed here.

Python's parser is lenient. It accepts NaN and Infinity, which JSON does not have, rounds 1e999 to infinity, keeps the
last of two equal keys, and reads integers that are too large for double precision. All of these are refused here.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from scenes.files.errors import InputError, printable, shown
from scenes.files.input_file import MEGABYTE, read_text

LIMIT = 16 * MEGABYTE
"""Largest size of a JSON file, bytes. Our largest file lists the spectra of a split, with 10 bytes for each."""

DEEPEST = 50
"""Most levels of nested lists and mappings. Our own files have at most five; Python fails at about a thousand."""

TOO_DEEP = f"values nested more than {DEEPEST} levels deep"


def read_json(path: Path, expected: str, nan: bool = False) -> Any:
    """Read the value in a JSON file."""
    return parse_json(read_text(path, expected, LIMIT), str(path), expected, nan)


def parse_json(text: str, source: str, expected: str, nan: bool = False) -> Any:
    """Parse a JSON text.

    >>> parse_json('{"rows": 4}', "metadata.json", "an array")
    {'rows': 4}
    >>> parse_json('{"rows": 4, "rows": 5}', "metadata.json", "an array")
    Traceback (most recent call last):
    scenes.files.errors.InputError: metadata.json: expected an array as JSON, found the key 'rows' twice
    """
    try:
        value = json.loads(
            text,
            object_pairs_hook=_object,
            parse_constant=float if nan else _constant,
            parse_float=_float,
            parse_int=_integer,
        )
    except json.JSONDecodeError as error:
        found = f"malformed JSON, {printable(error.msg)} in line {error.lineno}, column {error.colno}"
    except ValueError as error:
        found = str(error)
    except RecursionError:
        found = TOO_DEEP
    else:
        if not _too_deep(value):
            return value
        found = TOO_DEEP
    raise InputError(f"{source}: expected {expected} as JSON, found {found}") from None


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    result = dict(pairs)
    if len(result) < len(pairs):
        seen: set[str] = set()
        twice = next(key for key, _ in pairs if key in seen or seen.add(key))  # type: ignore[func-returns-value]
        raise ValueError(f"the key {shown(twice)} twice")
    return result


def _constant(text: str) -> float:
    raise ValueError(f"{text}, which JSON does not have")


def _float(text: str) -> float:
    value = float(text)
    if math.isinf(value):
        raise ValueError(f"the number {shown(text)}, which is too large")
    return value


def _integer(text: str) -> int:
    _float(text)
    return int(text)


def _too_deep(value: object) -> bool:
    level = [value]
    for _ in range(DEEPEST + 1):
        level = [
            child
            for each in level
            if isinstance(each, dict | list)
            for child in (each.values() if isinstance(each, dict) else each)
        ]
    return bool(level)


def plain_number(value: Any) -> Any:
    """A number of NumPy as one of Python's; the ``default`` of ``json.dumps`` for arguments that users give.

    >>> import json, numpy
    >>> json.dumps({"steps": numpy.int64(5)}, default=plain_number)
    '{"steps": 5}'
    """
    if hasattr(value, "item"):
        return value.item()
    raise TypeError(f"{type(value).__name__} is not JSON serializable")
