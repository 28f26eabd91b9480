"""Read YAML from the user. All of the program's YAML is parsed here.

YAML has features that a description does not need, and some are dangerous. Aliases can make a huge value of a small
file. Dates and tags make values that are not texts, numbers, lists or mappings. PyYAML reads YAML 1.1, in which 1_0 is
10, 1:30 is 90 and 010 is 8, while 1e3 and -.5 are texts. Here numbers are those of YAML 1.2, in decimals.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import yaml

from scenes.files.errors import InputError, printable, shown
from scenes.files.input_file import MEGABYTE, read_text
from scenes.files.json_file import DEEPEST, TOO_DEEP
from scenes.files.number_text import parse_number, parse_whole

LIMIT = 4 * MEGABYTE
"""Largest size of a YAML file, bytes. It is enough for about 60,000 objects, which take half a minute to read."""

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


class PlainDumper(yaml.SafeDumper):
    """PyYAML's safe dumper. It also quotes texts that ``PlainLoader`` alone would read as numbers."""


for each in (PlainLoader, PlainDumper):
    for tag, pattern in NUMBERS.items():
        each.add_implicit_resolver(tag, pattern, [*"-+.0123456789"])


def read_yaml(path: Path, expected: str) -> Any:
    """Read the value in a YAML file."""
    text = read_text(path, expected, LIMIT)
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
