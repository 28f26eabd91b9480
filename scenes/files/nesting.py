"""How deep values read from a file may be nested."""

from __future__ import annotations

DEEPEST = 50
"""Levels of lists and mappings in each other; our own files have five at most. Python fails at about a thousand."""


def too_deep(value: object) -> bool:
    """Whether lists and dictionaries are nested more than ``DEEPEST`` levels deep; none may contain itself.

    >>> too_deep({"a": [1, [2]]})
    False
    """
    level = [value]
    for _ in range(DEEPEST + 1):
        level = [
            child
            for each in level
            if isinstance(each, dict | list)
            for child in (each.values() if isinstance(each, dict) else each)
        ]
    return bool(level)
