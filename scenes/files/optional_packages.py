"""Optional packages, in extras: what only some commands need, and ``pip install 'bisplat-wrf[NAME]'`` adds to the core.

Whoever learns from measured data needs none of them. What does need one calls ``require_extra`` before it imports or
writes anything.
"""

from __future__ import annotations

from importlib.util import find_spec
from typing import NamedTuple

from scenes.files.errors import InputError


class Extra(NamedTuple):
    """Packages that are installed together."""

    called: str  # the one that a reader knows
    modules: tuple[str, ...]  # what is imported of them


EXTRAS = {
    "rays": Extra("Sionna RT", ("sionna", "mitsuba", "drjit")),
    "viewer": Extra("viser", ("viser", "websockets")),
    "ray": Extra("Ray", ("ray",)),
    "onnx": Extra("onnxscript", ("onnxscript",)),
    "fullwave": Extra("gprMax", ("gprMax",)),
}
"""The extras by their names in pyproject.toml."""


class MissingExtraError(InputError, ImportError):
    """An extra is not installed; the message is one sentence with the command that installs it."""

    def __init__(self, extra: str, what: str):
        super().__init__(extra, what)
        self.extra, self.what = extra, what

    def __str__(self) -> str:
        called = EXTRAS[self.extra].called
        return f"{self.what} needs {called}, which is not installed: pip install 'bisplat-wrf[{self.extra}]'"


def require_extra(extra: str, what: str) -> None:
    """Make sure that an extra is installed. Its packages are only looked for, not imported."""
    if not has_extra(extra):
        raise MissingExtraError(extra, what)


def has_extra(extra: str) -> bool:
    return all(find_spec(module) is not None for module in EXTRAS[extra].modules)
