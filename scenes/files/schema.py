"""Check a value from a file against a schema. Errors name the key and the value.

A schema is a ``msgspec.Struct`` or a dataclass of settings. A dataclass also makes its own checks.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterable
from dataclasses import MISSING, field, fields, make_dataclass
from typing import Annotated, Any, TypeVar

import msgspec
from msgspec import Meta, inspect

from scenes.files.errors import InputError, ParameterError, did_you_mean, printable, shown

T = TypeVar("T")

Count = Annotated[int, Meta(ge=0)]
Positive = Annotated[float, Meta(gt=0)]

WORDS = {
    "float": "a number",
    "int": "a whole number",
    "str": "a text",
    "bool": "true or false",
    "object": "a mapping",
    "array": "a list",
    "null": "nothing",
}
"""Readable names for the types in msgspec's messages."""

RECORDS = inspect.StructType | inspect.DataclassType

_type_info = functools.cache(inspect.type_info)

BOUNDS = {">=": "of at least", "<=": "of at most", ">": "above", "<": "below"}


def conform(value: object, schema: type[T], source: str, numbers_as_text: bool = False, complete: bool = False) -> T:
    kind = _type_info(schema)  # type: ignore[arg-type]
    try:
        result = msgspec.convert(value, schema, strict=not numbers_as_text)
        _check_keys(value, kind, source, complete)
        return result
    except msgspec.ValidationError as error:
        cause = error.__cause__
        sentence, _, place = str(error).partition(" - at ")
    place, _, _ = place.partition("[...]")  # if msgspec does not name the key, the mapping itself is shown
    names = re.findall(r"\.([^.\[\]`]+)|\[(\d+)\]", place)
    keys: list[str | int] = [name or int(index) for name, index in names]
    for key in keys:
        value, kind = value[key], _inside(kind, key)  # type: ignore[index]
    if isinstance(cause, ParameterError):  # a dataclass's own check
        raise InputError(f"{_place(source, [*keys, cause.parameter])}{cause.message}")
    if isinstance(cause, InputError):
        raise InputError(f"{_place(source, keys)}{cause}")
    if place.startswith("`key`"):
        raise InputError(f"{_place(source, keys)}expected texts as keys, found {shown(value)}")
    raise InputError(f"{_place(source, keys)}{_expected_found(sentence, value, kind)}")


def _place(source: str, keys: list[str | int]) -> str:
    where = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys).removeprefix(".")
    return f"{source}: {where}{': ' if where else ''}"


def _check_keys(value: Any, kind: inspect.Type, source: str, complete: bool, keys: tuple[str, ...] = ()) -> None:
    """Refuse unknown keys of dataclasses and, if ``complete``, missing ones. msgspec ignores both."""
    if isinstance(kind, inspect.UnionType):
        kind = next((each for each in kind.types if isinstance(each, RECORDS)), kind)
    if not isinstance(kind, RECORDS) or not isinstance(value, dict):
        return
    known = {each.encode_name: each.type for each in kind.fields}
    if complete and isinstance(kind, inspect.DataclassType):
        for each in fields(kind.cls):
            if each.name not in value:
                raise InputError(f"{_place(source, list(keys))}expected the key {each.name}, found none")
    for key, inner in value.items():
        if key in known:
            _check_keys(inner, known[key], source, complete, (*keys, key))
        elif isinstance(kind, inspect.DataclassType):
            raise InputError(f"{_place(source, list(keys))}{_unknown(key, known)}")


def recorded(settings: type, **beside: tuple[Any, Any]) -> Any:
    """Return a schema for a dataclass of settings and further keys in the same file."""
    further = [
        (name, kind, field(kw_only=True) if default is MISSING else field(default=default, kw_only=True))
        for name, (kind, default) in beside.items()
    ]
    return make_dataclass(
        settings.__name__, further, bases=(settings,), frozen=True, namespace={"__module__": settings.__module__}
    )


def _inside(kind: inspect.Type, key: str | int) -> inspect.Type:
    """Return the type of a field or an item. msgspec's message says that the container is a struct or a list."""
    if isinstance(kind, inspect.UnionType):
        kind = next(each for each in kind.types if isinstance(each, RECORDS | inspect.ListType | inspect.VarTupleType))
    if isinstance(kind, RECORDS):
        return next(field.type for field in kind.fields if field.encode_name == key)
    if isinstance(kind, inspect.TupleType):
        return kind.item_types[int(key)]
    assert isinstance(kind, inspect.ListType | inspect.VarTupleType)
    return kind.item_type


def _unknown(key: object, known: Iterable[str]) -> str:
    return f"expected a known key, found {shown(key)}; {did_you_mean(key, known)}"


def _expected_found(sentence: str, value: Any, kind: inspect.Type) -> str:
    """Translate msgspec's message into our words."""
    if isinstance(kind, inspect.UnionType):
        kind = next((each for each in kind.types if not isinstance(each, inspect.NoneType)), kind)
    if match := re.fullmatch(r"Object contains unknown field `(.*)`", sentence, re.DOTALL):
        assert isinstance(kind, RECORDS)
        known = [field.encode_name for field in kind.fields]
        return _unknown(match[1], known)
    if match := re.fullmatch(r"Object missing required field `(.*)`", sentence):
        return f"expected the key {match[1]}, found none"
    if sentence.startswith("Invalid enum value") and isinstance(kind, inspect.LiteralType):
        return f"expected {' or '.join(map(str, kind.values))}, found {shown(value)}"
    if match := re.fullmatch(r"Expected `array` of length (\d+).*", sentence):
        return f"expected a list of {match[1]}, found {shown(value)}"
    if match := re.fullmatch(r"Expected `(int|float)` (\S+) (\S+)", sentence):
        return f"expected {WORDS[match[1]]} {BOUNDS[match[2]]} {float(match[3]):g}, found {shown(value)}"
    if match := re.match(r"Expected `([^`]+)`", sentence):
        words = " or ".join(WORDS.get(word, word) for word in match[1].split(" | "))
        return f"expected {words}, found {shown(value)}"
    return f"expected another value, found {shown(value)} ({printable(sentence)})"
