"""Read XML from the user, with limited depth and no DOCTYPE, whose entities could grow or refer to other files."""

from __future__ import annotations

from pathlib import Path
from xml.etree.ElementTree import Element, ParseError, TreeBuilder, XMLParser

from scenes.files.errors import InputError, printable
from scenes.files.input_file import MEGABYTE, read_bytes

LIMIT = 64 * MEGABYTE
"""Largest size of an XML file, bytes. It is enough for about 200,000 shapes."""

DEEPEST = 50
"""Most levels of elements. Scene files have five."""


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


def read_xml(path: Path, expected: str) -> Element:
    """Read the root element of an XML file."""
    data = read_bytes(path, f"{expected} as XML", LIMIT)
    parser = XMLParser(target=_PlainBuilder())
    try:
        parser.feed(data)
        return parser.close()
    except (ParseError, InputError, LookupError, ValueError) as error:  # LookupError: an unknown encoding
        raise InputError(f"{path}: expected {expected} as XML, found {printable(str(error))}") from None
