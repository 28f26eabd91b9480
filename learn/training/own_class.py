"""The user's own classes, named ``module:Class``. This module does not import torch."""

from __future__ import annotations

import os
import sys
from importlib import import_module
from traceback import extract_tb
from typing import Any

from scenes.files.errors import ParameterError, cut, reason


def own_class(name: str, parameter: str) -> Any:
    """Import a class. Its module is searched for on Python's path and then in the current folder.

    Args:
        name: ``module:Class``.
        parameter: name of the parameter, for the error message.

    Raises:
        ParameterError: the module cannot be imported, or has no such class. The message says why.
    """
    module, _, attribute = name.partition(":")
    here = os.getcwd()
    sys.path.append(here)
    try:
        return getattr(import_module(module), attribute)
    except (Exception, SystemExit) as error:  # the user's module can raise anything while it is imported
        ours = ("<frozen", __file__, import_module.__code__.co_filename)
        frames = [each for each in extract_tb(error.__traceback__) if not each.filename.startswith(ours)]
        place = f" ({frames[-1].filename}, line {frames[-1].lineno})" if frames else ""
        found = f"{type(error).__name__}: {reason(error)}{place}"
        raise ParameterError(parameter, f"expected a class at {cut(name)}, found {found}") from error
    finally:
        if here in sys.path:
            del sys.path[len(sys.path) - 1 - sys.path[::-1].index(here)]
