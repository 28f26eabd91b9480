"""Numbers on the command line, which are read as in files: 1_0 and full-width digits are refused."""

from __future__ import annotations

from collections.abc import Callable

from tyro.constructors import ConstructorRegistry, PrimitiveConstructorSpec, PrimitiveTypeInfo

from scenes.files.input_file import parse_number, parse_whole

PARSERS: dict[type, Callable[[str], float]] = {int: parse_whole, float: parse_number}

REGISTRY = ConstructorRegistry()
"""The rules of the command line's parser."""


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
