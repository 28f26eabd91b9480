"""Check a value that was read from a file against a schema, a ``msgspec.Struct``; errors name the key and the value."""

from __future__ import annotations

import re
from typing import Any, TypeVar

import msgspec
from msgspec import inspect

from scenes.files.errors import InputError, printable, shown

T = TypeVar("T")

WORDS = {
    "float": "a number",
    "int": "a whole number",
    "str": "a text",
    "bool": "true or false",
    "object": "a mapping",
    "array": "a list",
    "null": "nothing",
}
"""What a reader calls the types of msgspec's messages."""

BOUNDS = {">=": "of at least", "<=": "of at most", ">": "above", "<": "below"}


def conform(value: object, schema: type[T], source: str, numbers_as_text: bool = False) -> T:
    """The value as an instance of a schema.

    Args:
        value: as read from JSON or YAML.
        schema: a subclass of ``msgspec.Struct``.
        source: the start of the message: the file's name.
        numbers_as_text: also take numbers that are texts; YAML 1.1 reads 1e-3, without a point, as a text.

    Raises:
        InputError: a key is missing or unknown, or a value has another type or is out of its range.

    >>> class Array(msgspec.Struct):
    ...     rows: int
    >>> conform({"rows": 4}, Array, "metadata.json").rows
    4
    >>> conform({"rows": "x"}, Array, "metadata.json")
    Traceback (most recent call last):
    scenes.files.errors.InputError: metadata.json: rows: expected a whole number, found 'x'
    """
    try:
        return msgspec.convert(value, schema, strict=not numbers_as_text)
    except msgspec.ValidationError as error:
        sentence, _, place = str(error).partition(" - at ")
    place, _, _ = place.partition("[...]")  # where msgspec does not name the key, the mapping itself is shown
    names = re.findall(r"\.([^.\[\]`]+)|\[(\d+)\]", place)
    keys: list[str | int] = [name or int(index) for name, index in names]
    kind = inspect.type_info(schema)
    for key in keys:
        value, kind = value[key], _inside(kind, key)  # type: ignore[index]
    where = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys).removeprefix(".")
    raise InputError(f"{source}: {where}{': ' if where else ''}{_expected_found(sentence, value, kind)}")


def _inside(kind: inspect.Type, key: str | int) -> inspect.Type:
    """The type of what a struct or a list holds; msgspec's message says that it is one of the two."""
    if isinstance(kind, inspect.UnionType):
        kind = next(each for each in kind.types if isinstance(each, inspect.StructType | inspect.ListType))
    if isinstance(kind, inspect.StructType):
        return next(field.type for field in kind.fields if field.encode_name == key)
    if isinstance(kind, inspect.TupleType):
        return kind.item_types[int(key)]
    assert isinstance(kind, inspect.ListType)
    return kind.item_type


def _expected_found(sentence: str, value: Any, kind: inspect.Type) -> str:
    """msgspec's sentence in our words."""
    if isinstance(kind, inspect.UnionType):
        kind = next((each for each in kind.types if not isinstance(each, inspect.NoneType)), kind)
    if match := re.fullmatch(r"Object contains unknown field `(.*)`", sentence, re.DOTALL):
        assert isinstance(kind, inspect.StructType)
        known = ", ".join(field.encode_name for field in kind.fields)
        return f"expected no keys but {known}, found {shown(match[1])}"
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
