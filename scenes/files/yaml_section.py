"""Read a YAML mapping key by key; every error names the place in the file."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from typing import Any

from scenes.files.errors import InputError, did_you_mean, shown


class Section:
    """One mapping of a YAML file: its keys are checked at once, its values when they are read.

    Args:
        value: the mapping.
        label: the mapping's place in the file, the start of every message.
        required: keys that the mapping must have.
        optional: keys that it may have.

    Attributes:
        label: as given.
        values: the mapping.

    Raises:
        InputError: not a mapping, an unknown key or a missing key. Every reader raises it too, for a value of another
            type than its own.
    """

    def __init__(self, value: object, label: str, required: Collection[str], optional: Collection[str] = ()) -> None:
        self.label = label
        if not isinstance(value, dict):
            raise self.error(f"expected a mapping with {', '.join(required)}, found {shown(value)}")
        for key in value:
            if key not in required and key not in optional:
                raise self.error(f"unknown key {shown(key)}; {did_you_mean(key, [*required, *optional])}")
        for key in required:
            if key not in value:
                raise self.error(f'missing key "{key}"')
        self.values: dict[str, Any] = value

    def error(self, message: str) -> InputError:
        """The error with a message about this mapping."""
        return InputError(f"{self.label}: {message}")

    def text(self, key: str) -> str:
        """A text that is not empty."""
        value = self.values[key]
        if not isinstance(value, str) or not value:
            raise self.error(f"{key} must be a text, found {shown(value)}")
        return value

    def number(self, key: str) -> float:
        """A finite number."""
        return self._number(self.values[key], key)

    def numbers(self, key: str, count: int) -> Any:
        """A tuple of so many numbers."""
        value = self.values[key]
        if not isinstance(value, list) or len(value) != count:
            raise self.error(f"{key} must be a list of {count} numbers, found {shown(value)}")
        return tuple(self._number(v, f"{key}[{i}]") for i, v in enumerate(value))

    def count(self, key: str) -> int:
        """A whole number."""
        value = self.values[key]
        if isinstance(value, bool) or not isinstance(value, int):
            raise self.error(f"{key} must be a whole number, found {shown(value)}")
        return value

    def optional(self, **readers: Callable[[str], Any]) -> dict[str, Any]:
        """The values of the keys that the mapping has, each read by its reader."""
        return {key: read(key) for key, read in readers.items() if key in self.values}

    def _number(self, value: object, key: str) -> float:
        # YAML 1.1 reads 915e6 and 1e-3, without a point and a signed exponent, as text.
        try:
            if not isinstance(value, int | float | str) or isinstance(value, bool):
                raise ValueError
            number = float(value)
        except (ValueError, OverflowError):  # OverflowError: an integer of 400 digits
            raise self.error(f"{key} must be a number, found {shown(value)}") from None
        if not math.isfinite(number):
            raise self.error(f"{key} must be a finite number, found {shown(value)}")
        return number
