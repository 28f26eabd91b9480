"""Read JSON, YAML and XML from the user. All of the program's files of these kinds are parsed here, strictly.

Python's JSON parser accepts NaN and Infinity, rounds 1e999 to infinity, keeps the last of two equal keys, and reads
integers too large for double precision. In YAML, aliases can make a huge value of a small file, and dates and tags make
values that are not texts, numbers, lists or mappings; PyYAML reads YAML 1.1, in which 1_0 is 10, 1:30 is 90 and 010 is
8, while 1e3 and -.5 are texts. All of this is refused or, for numbers, read as in YAML 1.2, in decimals.
"""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, ParseError, TreeBuilder, XMLParser

import yaml

from scenes.files.errors import InputError, printable, shown
from scenes.files.input_file import MEGABYTE, parse_number, parse_whole, read_bytes, read_text

LARGEST_JSON = 16 * MEGABYTE
"""Bytes. Our largest file lists the spectra of a split, with 10 bytes for each."""

LARGEST_YAML = 4 * MEGABYTE
"""Bytes. It is enough for about 60,000 objects, which take half a minute to read."""

LARGEST_XML = 64 * MEGABYTE  # Bytes. It is enough for about 200,000 shapes.

DEEPEST = 50
"""Most levels of nested lists, mappings or elements. Our own files have five; Python fails at about a thousand."""

TOO_DEEP = f"values nested more than {DEEPEST} levels deep"


def read_json(path: Path, expected: str, nan: bool = False) -> Any:
    return parse_json(read_text(path, expected, LARGEST_JSON), str(path), expected, nan)


def parse_json(text: str, source: str, expected: str, nan: bool = False) -> Any:
    try:
        value = json.loads(
            text,
            object_pairs_hook=_object,
            parse_constant=float if nan else _constant,
            parse_float=_float,
            parse_int=_integer,
        )
    except json.JSONDecodeError as error:
        found = f"malformed JSON, {printable(error.msg)} in line {error.lineno}, column {error.colno}"
    except ValueError as error:
        found = str(error)
    except RecursionError:
        found = TOO_DEEP
    else:
        if not _too_deep(value):
            return value
        found = TOO_DEEP
    raise InputError(f"{source}: expected {expected} as JSON, found {found}") from None


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    result = dict(pairs)
    if len(result) < len(pairs):
        seen: set[str] = set()
        twice = next(key for key, _ in pairs if key in seen or seen.add(key))  # type: ignore[func-returns-value]
        raise ValueError(f"the key {shown(twice)} twice")
    return result


def _constant(text: str) -> float:
    raise ValueError(f"{text}, which JSON does not have")


def _float(text: str) -> float:
    value = float(text)
    if math.isinf(value):
        raise ValueError(f"the number {shown(text)}, which is too large")
    return value


def _integer(text: str) -> int:
    _float(text)
    return int(text)


def _too_deep(value: object) -> bool:
    level = [value]
    for _ in range(DEEPEST + 1):
        level = [
            child
            for each in level
            if isinstance(each, dict | list)
            for child in (each.values() if isinstance(each, dict) else each)
        ]
    return bool(level)


def plain_values(value: Any) -> Any:
    """Turn tuples into lists and NumPy's numbers into Python's, within mappings and lists, too, for YAML and JSON."""
    if isinstance(value, dict):
        return {key: plain_values(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [plain_values(each) for each in value]
    return value.item() if hasattr(value, "item") else value


INTEGER, FLOAT, TIMESTAMP = (f"tag:yaml.org,2002:{name}" for name in ("int", "float", "timestamp"))

NUMBERS = {
    INTEGER: re.compile(r"[-+]?[0-9]+$"),
    FLOAT: re.compile(
        r"([-+]?([0-9]+\.[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?|[-+]?[0-9]+[eE][-+]?[0-9]+|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN))$"
    ),
}
"""What is a number without quotes, by tag."""


class PlainLoader(yaml.SafeLoader):
    """PyYAML's safe loader without dates. It refuses aliases, deep nesting, repeated keys, and keys that are lists."""

    level = 0

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        event = self.peek_event()
        if self.check_event(yaml.AliasEvent):
            raise yaml.MarkedYAMLError(
                problem=f"the alias *{event.anchor} (aliases are not supported)", problem_mark=event.start_mark
            )
        if self.level > DEEPEST:
            raise yaml.MarkedYAMLError(problem=TOO_DEEP, problem_mark=event.start_mark)
        self.level += 1
        node = super().compose_node(parent, index)
        self.level -= 1
        return node

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen = set()
        for key, _ in node.value if isinstance(node, yaml.MappingNode) else ():
            if not isinstance(key, yaml.ScalarNode):
                raise yaml.MarkedYAMLError(problem="a key that is not a text", problem_mark=key.start_mark)
            if key.value in seen:
                raise yaml.MarkedYAMLError(problem=f"the key {shown(key.value)} twice", problem_mark=key.start_mark)
            seen.add(key.value)
        return super().construct_mapping(node, deep)

    def construct_yaml_int(self, node: yaml.ScalarNode) -> int:
        return parse_whole(self.construct_scalar(node))

    def construct_yaml_float(self, node: yaml.ScalarNode) -> float:
        return parse_number(re.sub(r"\.(?=[a-zA-Z])", "", self.construct_scalar(node)))  # Python has no point in .inf


# Dates stay texts, since no key of ours needs a date. So a scene may be named 2024-01-01.
PlainLoader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in resolvers if tag not in (INTEGER, FLOAT, TIMESTAMP)]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
PlainLoader.add_constructor(INTEGER, PlainLoader.construct_yaml_int)
PlainLoader.add_constructor(FLOAT, PlainLoader.construct_yaml_float)


class PlainDumper(yaml.CSafeDumper):
    """libyaml's safe dumper. It also quotes texts that ``PlainLoader`` alone would read as numbers."""


for each in (PlainLoader, PlainDumper):
    for tag, pattern in NUMBERS.items():
        each.add_implicit_resolver(tag, pattern, [*"-+.0123456789"])


def read_yaml(path: Path, expected: str) -> Any:
    text = read_text(path, expected, LARGEST_YAML)
    place = str(path)
    try:
        return yaml.load(text, Loader=PlainLoader)
    except yaml.MarkedYAMLError as error:
        place += f", line {error.problem_mark.line + 1}" if error.problem_mark else ""
        found = f"malformed YAML, {error.problem}"
    except yaml.YAMLError as error:
        found = f"malformed YAML, {' '.join(str(error).split())}"
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:  # of a tag such as !!int
        found = f"malformed YAML, a value that does not fit its tag ({shown(str(error))})"
    raise InputError(f"{place}: expected {expected} as YAML, found {printable(found)}") from None


class _PlainBuilder(TreeBuilder):
    """Builds the tree of an XML file. It refuses deep nesting, and a DOCTYPE, without which there are no entities."""

    level = 0

    def doctype(self, name: str, pubid: str | None, system: str | None) -> None:
        raise InputError("a DOCTYPE, which is not supported")

    def start(self, tag: str, attrs: dict[str, str]) -> Element:  # type: ignore[override]
        self.level += 1
        if self.level > DEEPEST:
            raise InputError(f"elements nested more than {DEEPEST} levels deep")
        return super().start(tag, attrs)

    def end(self, tag: str) -> Element:
        self.level -= 1
        return super().end(tag)


def read_xml(path: Path) -> Element:
    data = read_bytes(path, "a Mitsuba scene as XML", LARGEST_XML)
    parser = XMLParser(target=_PlainBuilder())
    try:
        parser.feed(data)
        return parser.close()
    except (ParseError, InputError, LookupError, ValueError) as error:  # LookupError: an unknown encoding
        raise InputError(f"{path}: expected a Mitsuba scene as XML, found {printable(str(error))}") from None
