"""The user's own classes, named ``module:Class``, and what went wrong in them. This module does not import torch."""

from __future__ import annotations

import os
import sys
import sysconfig
from importlib import import_module
from pathlib import Path
from traceback import FrameSummary, extract_tb
from typing import Any

from scenes.files.errors import ParameterError, cut, reason

OURS = ("scenes", "simulate", "learn", "bisplat")
"""Our packages."""


def own_class(name: str, parameter: str) -> Any:
    """Import a class. Its module is searched for on Python's path and then in the current folder."""
    module, _, attribute = name.partition(":")
    here = os.getcwd()
    sys.path.append(here)
    try:
        return getattr(import_module(module), attribute)
    except (Exception, SystemExit) as error:  # the user's module can raise anything while it is imported
        found = what_happened(error)
        if isinstance(error, ModuleNotFoundError) and error.name == module:
            found = f"no module {module} in this folder or on Python's path (PYTHONPATH)"
        raise ParameterError(parameter, f"expected a class at {cut(name)}, found {found}") from error
    finally:
        if here in sys.path:
            del sys.path[len(sys.path) - 1 - sys.path[::-1].index(here)]


def what_happened(error: BaseException) -> str:
    """An error of the user's code in words, with the line of the user's code at which it happened.

    >>> try:
    ...     [][0]
    ... except IndexError as error:
    ...     what_happened(error)
    'IndexError: list index out of range'
    """
    frames = [each for each in extract_tb(error.__traceback__) if _is_users(each)]
    place = f" ({frames[-1].filename}, line {frames[-1].lineno})" if frames else ""
    return f"{type(error).__name__}: {reason(error)}{place}"


def is_of_own_code(error: BaseException | None) -> bool:
    """Whether an error passed through code of the user's, so that its traceback tells more than the sentence.

    >>> is_of_own_code(None)
    False
    """
    return error is not None and any(map(_is_users, extract_tb(error.__traceback__)))


_ROOT = Path(__file__).resolve().parents[2]
_LIBRARIES = (*(str(_ROOT / name) + os.sep for name in OURS), sysconfig.get_path("stdlib") + os.sep, "<")


def _is_users(frame: FrameSummary) -> bool:
    """Whether a frame is neither of our packages, nor of Python, nor of an installed library."""
    return not frame.filename.startswith(_LIBRARIES) and "site-packages" not in Path(frame.filename).parts
