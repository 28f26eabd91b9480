"""The error a user sees: one sentence, no traceback."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches


class InputError(ValueError):
    """Something the user gave is wrong.

    The message is one sentence that names the file and the key or row, says what was expected and what was
    found. The command line prints it as it is and exits with status 1.
    """


def did_you_mean(word: object, known: Iterable[str]) -> str:
    """The end of an error message about an unknown `word`: the nearest known one, or all of them."""
    known = sorted(known)
    nearest = get_close_matches(str(word), known, n=1)
    return f'did you mean "{nearest[0]}"?' if nearest else f"known are {', '.join(known)}"
