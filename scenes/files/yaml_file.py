"""Read YAML that the user gave: the one place that parses it.

YAML has more than a description needs, and some of it is dangerous: aliases can make a small file a huge value, and
dates and tags make other types than texts, numbers, lists and mappings. PyYAML reads YAML 1.1, where -.5 is a text.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import yaml

from scenes.files.errors import InputError, printable, shown
from scenes.files.input_file import MEGABYTE, read_text
from scenes.files.json_file import DEEPEST, TOO_DEEP

LIMIT = 4 * MEGABYTE
"""Largest size of a YAML file, bytes: about 60,000 objects, which take half a minute to read."""

TIMESTAMP = "tag:yaml.org,2002:timestamp"


class PlainLoader(yaml.SafeLoader):
    """PyYAML's safe loader without aliases, dates, deep nesting, and keys that are twice there, lists or mappings."""

    level = 0

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        event = self.peek_event()
        if self.check_event(yaml.AliasEvent):
            raise yaml.MarkedYAMLError(
                problem=f"the alias *{event.anchor}, and aliases are not read", problem_mark=event.start_mark
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
                raise yaml.MarkedYAMLError(problem="a key that is no text", problem_mark=key.start_mark)
            if key.value in seen:
                raise yaml.MarkedYAMLError(problem=f"the key {shown(key.value)} twice", problem_mark=key.start_mark)
            seen.add(key.value)
        return super().construct_mapping(node, deep)


# A date, which no key of ours takes, is a text: so a scene may be named 2024-01-01.
PlainLoader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in resolvers if tag != TIMESTAMP]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}


class PlainDumper(yaml.SafeDumper):
    """PyYAML's safe dumper, which also quotes texts that only ``PlainLoader`` takes for numbers."""


for each in (PlainLoader, PlainDumper):
    each.add_implicit_resolver("tag:yaml.org,2002:float", re.compile(r"[-+]?\.\d+([eE][-+]?\d+)?$"), [*"-+."])


def read_yaml(path: Path, expected: str) -> Any:
    """The value that a YAML file holds.

    Args:
        path: the file.
        expected: what should be there, for the message, e.g. "a scene".

    Raises:
        InputError: the file cannot be read, is larger than ``LIMIT``, is no YAML, or has an alias, a key twice in one
            mapping, a value that is not what its tag says, or values nested too deep.
    """
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
        found = f"malformed YAML, a value that is not of its type ({shown(str(error))})"
    raise InputError(f"{place}: expected {expected} as YAML, found {printable(found)}") from None
