"""Errors in what the user gave, which the command line prints as one sentence, and checks that raise them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from difflib import get_close_matches
from numbers import Integral, Real
from os import PathLike
from types import EllipsisType

import numpy as np
from numpy.typing import ArrayLike


class InputError(ValueError):
    """A file, a name or a value that the user gave is wrong.

    The message is one sentence. It names the file or the parameter, with the key or the row, and says what was expected
    and what was found. The command line prints the message and exits with status 1. ``InputError`` is a ``ValueError``.

    Example:
        >>> import bisplat
        >>> try:
        ...     bisplat.load_scene("laboratory")
        ... except bisplat.InputError as error:
        ...     print(error)
        unknown scene "laboratory"; valid names are bedroom, closet, ... (or give a .yaml file)
    """


class ParameterError(InputError):
    """A parameter of a function has an invalid value. The command line names the option instead of the parameter."""

    def __init__(self, parameter: str, message: str):
        super().__init__(parameter, message)
        self.parameter, self.message = parameter, message

    def __str__(self) -> str:
        return f"{self.parameter}: {self.message}"

    def as_option(self) -> str:
        """Return the message with the name of the command line's option."""
        dashes = "-" if len(self.parameter) == 1 else "--"
        return f"{dashes}{self.parameter.replace('_', '-')}: {self.message}"


def require_positive(**values: float) -> None:
    for name, value in values.items():
        if not (is_number(value) and 0 < value < math.inf):
            raise ParameterError(name, f"expected a positive number, found {shown(value)}")


SEED_MOST = 2**32 - 1  # Largest seed that NumPy, PyTorch and the ray tracer all accept


def require_whole(least: int, most: int, **values: int) -> None:
    for name, value in values.items():
        whole = isinstance(value, Integral) and not isinstance(value, bool)
        if not (whole and value >= least):
            raise ParameterError(name, f"expected a whole number of at least {least}, found {shown(value)}")
        if value > most:
            raise ParameterError(name, f"expected a whole number of at most {most}, found {shown(value)}")


def require_seed(**values: int) -> None:
    require_whole(0, SEED_MOST, **values)


def require_within(least: float, most: float, what: str, **values: float) -> None:
    for name, value in values.items():
        if not (is_number(value) and least <= value <= most):
            raise ParameterError(name, f"expected {what} from {least:g} to {most:g}, found {shown(value)}")


def require_flag(**values: bool) -> None:
    """Refuse switches that are neither True nor False, such as "no", which Python takes for true."""
    for name, value in values.items():
        if not isinstance(value, bool):
            raise ParameterError(name, f"expected true or false, found {shown(value)}")


def require_word(known: Iterable[str], **values: str) -> None:
    *others, last = known
    for name, value in values.items():
        if not (isinstance(value, str) and value in (*others, last)):
            hint = did_you_mean(value, (*others, last))
            nearest = f"; {hint}" if hint.endswith("?") else ""  # the others are listed already
            raise ParameterError(name, f"expected {', '.join(others)} or {last}, found {shown(value)}{nearest}")


def require_path(**values: object) -> None:
    """Raise a ParameterError for values that are neither texts nor paths. An empty text would be the folder here."""
    for name, value in values.items():
        if not isinstance(value, str | PathLike) or value == "":
            raise ParameterError(name, f"expected a path, found {shown(value)}")


def require_instance(*kinds: type, **values: object) -> None:
    for name, value in values.items():
        if not isinstance(value, kinds):
            raise ParameterError(name, f"expected {' or '.join(kind.__name__ for kind in kinds)}, found {shown(value)}")


def is_number(value: object) -> bool:
    """Whether a value is a real number, and not True or False."""
    return isinstance(value, Real) and not isinstance(value, bool)


SHOWN = 80  # Most characters of a value that a message shows


LISTED = 40  # Most known words that a message lists


def shown(value: object) -> str:
    r"""Format a value for an error message: on one line, without control characters, cut if long."""
    if value is None:
        return "nothing"
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # a huge integer; a list that contains itself
        text = f"a {type(value).__name__} that is too long to show"
    return cut(text)


def reason(error: BaseException) -> str:
    r"""Format another library's error for our message: its first line, without control characters, cut if long."""
    return cut((str(error).strip().splitlines() or [type(error).__name__])[0])


def cut(text: str) -> str:
    """Format text as part of a sentence: without control characters, cut if long."""
    return printable(text if len(text) <= SHOWN else text[: SHOWN - 1] + "…")


def named(name: object) -> str:
    r"""Format a name from a file or an option for an error message: in double quotes, printable, cut if long."""
    text = str(name)
    return f'"{printable(text if len(text) <= SHOWN - 2 else text[: SHOWN - 3] + "…")}"'


def printable(text: str) -> str:
    r"""Escape control characters, which a terminal would obey, as Python writes them."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def did_you_mean(word: object, known: Iterable[str]) -> str:
    """Return the end of an error message about an unknown word: the most similar known word, or all known words."""
    known = sorted(known)
    nearest = get_close_matches(str(word)[:SHOWN], known, n=1)
    if nearest:
        return f"did you mean {named(nearest[0])}?"
    more = ", …" if len(known) > LISTED else ""
    return f"valid names are {', '.join(named(name)[1:-1] for name in known[:LISTED])}{more}"


def listed(names: Iterable[str], most: int = 8) -> str:
    """List the first names, without repetitions."""
    each = list(dict.fromkeys(names))
    rest = f" and {len(each) - most} more" if len(each) > most else ""
    return ", ".join(each[:most]) + rest


NUMBERS = {"f": "numbers", "c": "complex numbers"}
"""Kinds of numbers in an array, by NumPy's codes. Real numbers count as complex ones, too."""


def check_array(
    parameter: str,
    value: ArrayLike,
    shape: tuple[int | EllipsisType | None, ...],
    what: str,
    kind: str = "f",
    finite: bool = True,
) -> np.ndarray:
    """Check an array, and return it in double precision.

    NumPy would drop the mask of a masked array and the imaginary parts of complex numbers, and read texts and truth
    values as numbers.
    """
    if np.ma.isMaskedArray(value):
        raise ParameterError(parameter, f"expected {what}, found a masked array")
    try:
        array = np.asarray(value)
    except (TypeError, ValueError, OverflowError):  # of the value's own __array__, or rows of different lengths
        array = np.array(None)
    if array.dtype.kind not in ("iuf" if kind == "f" else "iufc"):
        found = f"{array.dtype.name} numbers" if array.dtype.kind == "c" else shown(value)
        raise ParameterError(parameter, f"expected {what} ({NUMBERS[kind]}), found {found}")
    if not _fits(array.shape, shape):
        raise ParameterError(parameter, f"expected {what}, found shape {array.shape}")
    with np.errstate(over="ignore"):
        array = array.astype(float if kind == "f" else complex, order="C")  # torch takes no negative strides
    if finite and not np.isfinite(array).all():
        where = np.argwhere(~np.isfinite(array))[0].tolist()
        place = f" at {where}" if where else ""
        raise ParameterError(parameter, f"expected {what}, all finite, found {array[tuple(where)]}{place}")
    return array


def _fits(found: tuple[int, ...], shape: tuple[int | EllipsisType | None, ...]) -> bool:
    if shape[:1] == (...,):
        shape = shape[1:]
        found = found[max(len(found) - len(shape), 0) :]
    return len(found) == len(shape) and all(want in (None, has) for want, has in zip(shape, found, strict=True))
