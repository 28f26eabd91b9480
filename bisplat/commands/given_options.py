"""The options that the user gave. A command applies each of them, or refuses it.

A parsed option that equals its default may have been given or not. The words of the command line tell.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Collection
from dataclasses import fields, is_dataclass
from itertools import takewhile
from typing import get_type_hints

from scenes.files.errors import InputError

SHORT = re.compile("-[a-z]")

SAME = {
    "-o": "--output",
    "--methods": "--models",
    "--spectra": "-n",
    "--number": "-n",
    "--positions": "-n",  # the number of positions, or of the spectra at them; or a file with as many
    "--snr": "--snr-db",
    "--gain-error": "--gain-error-db",
    "--phase-error": "--phase-error-deg",
    "--phase-noise": "--phase-noise-deg",
    "--tx-power": "--tx-power-dbm",
    "--floor": "--floor-dbm",
    "--shadowing": "--shadowing-db",
    "--quantisation": "--quantisation-db",
}
"""Options that say the same, or one of which would be ignored beside the other."""

OF_ROOMS = {"-n": "--rooms", "--spectra": "--spectra"}
"""What bisplat rooms has otherwise: it takes a number of rooms, and one of spectra in each."""


def given_options() -> list[str]:
    """The names of the options on the command line, as the user wrote them.

    >>> from unittest import mock
    >>> with mock.patch.object(sys, "argv", ["bisplat", "plan", "lab", "-n5", "--max_depth=2", "--no-los", "-o", "x"]):
    ...     given_options()
    ['-n', '--max-depth', '--no-los', '-o']
    """
    names = []
    for word in takewhile(lambda word: word != "--", sys.argv[2:]):
        if word.startswith("--"):
            names.append(word.partition("=")[0].replace("_", "-"))
        elif SHORT.match(word):  # and no negative number
            names.append(word[:2])
    return names


def refuse_given(names: Collection[str], expected: str) -> None:
    """Refuse options that would change nothing in this call.

    Args:
        names: the options.
        expected: why, as the end of the sentence "--NAME: expected ...".

    Raises:
        InputError: the user gave one of them.

    >>> from unittest import mock
    >>> with mock.patch.object(sys, "argv", ["bisplat", "scene", "lab", "--unit", "mm"]):
    ...     refuse_given(["--unit"], "a mesh to import, found the scene lab")
    Traceback (most recent call last):
    scenes.files.errors.InputError: --unit: expected a mesh to import, found the scene lab
    """
    for name in given_options():
        if name in names:
            raise InputError(f"{name}: expected {expected}")


def refuse_repeated() -> None:
    """Refuse an option that is given twice, since the parser would use only the last one.

    Raises:
        InputError: there is one.

    >>> from unittest import mock
    >>> with mock.patch.object(sys, "argv", ["bisplat", "simulate", "lab", "-n", "5", "--positions", "places.csv"]):
    ...     refuse_repeated()
    Traceback (most recent call last):
    scenes.files.errors.InputError: -n and --positions: expected one of them, found both
    """
    first: dict[str, str] = {}
    same = SAME | (OF_ROOMS if sys.argv[1:2] == ["rooms"] else {})
    for name in given_options():
        positive = name.replace("--no-", "--", 1)
        before = first.setdefault(same.get(positive, positive), name)
        if before != name:
            raise InputError(f"{before} and {name}: expected one of them, found both")
        if given_options().count(name) > 1:
            raise InputError(f"{name}: expected once, with all its values, found {given_options().count(name)} times")


def names_of(options: type) -> list[str]:
    """The names of a dataclass's options and of nested ones', with those of the switches that turn options off.

    Args:
        options: the dataclass.

    >>> from scenes.scene.tolerances import Tolerances
    >>> names_of(Tolerances)[:4]
    ['--position', '--no-position', '--rotation', '--no-rotation']
    """
    names = []
    for option, kind in get_type_hints(options).items():
        if isinstance(kind, type) and is_dataclass(kind):
            names += names_of(kind)
        elif option in {each.name for each in fields(options)}:
            names += [f"--{prefix}{option.replace('_', '-')}" for prefix in ("", "no-")]
    return names
