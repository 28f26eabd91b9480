"""What several commands share: output files, which only --force replaces, and numbers, which are read as in files."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from functools import reduce
from operator import or_
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Union, get_args

from tyro.conf import arg
from tyro.constructors import ConstructorRegistry, PrimitiveConstructorSpec, PrimitiveTypeInfo

from scenes.files.atomic import require_writable
from scenes.files.errors import InputError
from scenes.files.input_file import parse_number, parse_whole, what_is_at

Force = Annotated[bool, arg(help="replace existing output files.")]
"""The option of every command that writes such files."""


def require_new(*paths: Path, force: bool) -> None:
    """Refuse to replace files, and paths to which no file can be written. Commands call this before any long work."""
    for path in paths:
        if path.exists() and not path.is_file():
            raise InputError(f"{path}: expected the name of a file to write, found {what_is_at(path)}")
        if os.path.lexists(path) and not force:
            raise InputError(f"{path}: expected no such file yet, found one; --force replaces it")
        require_writable(path)


PARSERS: dict[type, Callable[[str], float]] = {int: parse_whole, float: parse_number}

REGISTRY = ConstructorRegistry()  # The rules of the command line's parser


@REGISTRY.primitive_rule
def number(option: PrimitiveTypeInfo) -> PrimitiveConstructorSpec | None:
    """How an option of a number is read; None for other options."""
    kind = option.type
    if kind not in PARSERS:
        return None
    return PrimitiveConstructorSpec(
        nargs=1,
        metavar=kind.__name__.upper(),
        instance_from_str=lambda texts: PARSERS[kind](texts[0]),
        is_instance=lambda value: isinstance(value, int | kind),
        str_from_instance=lambda value: [str(value)],
    )


@REGISTRY.primitive_rule
def stated(option: PrimitiveTypeInfo) -> PrimitiveConstructorSpec | None:
    """How an option that need not be stated is read and shown: as if it had to be. None for other options."""
    kinds = get_args(option.type)
    if NoneType not in kinds or option.type_origin not in (Union, UnionType):
        return None
    kind: Any = reduce(or_, [each for each in kinds if each is not NoneType])
    spec = ConstructorRegistry.get_primitive_spec(PrimitiveTypeInfo.make(kind, option.markers))
    if not isinstance(spec, PrimitiveConstructorSpec):
        return None
    return replace(
        spec,
        is_instance=lambda value: value is None or spec.is_instance(value),
        str_from_instance=lambda value: ["none"] if value is None else spec.str_from_instance(value),
    )
