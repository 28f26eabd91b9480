"""Parts of the reference that the code itself states: the commands with their options, and the radio materials.

``{commands}`` lists every command as its parser has it. ``{materials}`` lists the radio materials with their values at
a frequency.
In docstrings, ``[key]`` of references.bib becomes a citation.
"""

from __future__ import annotations

import argparse
import re
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import tyro
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

KEY = re.compile(r"\[([a-z]+\d{4}[a-z]?)\]")


class Commands(SphinxDirective):
    """A section for each command: its description, and tables of its options."""

    def run(self) -> list[nodes.Node]:
        from bisplat.commands.command_groups import GROUPS

        lines: list[str] = []
        for group, commands in GROUPS.items():
            lines += [f"## {group}", ""]
            for command in commands:
                lines += command_section(command)
        return self.parse_text_to_nodes("\n".join(lines), allow_section_headings=True)


def command_section(command: Callable[..., Any]) -> Iterator[str]:
    """Lines of Markdown about a command: what it does, and tables of its arguments and options."""
    name = f"bisplat {command.__name__}"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        parser = tyro.extras.get_parser(command, prog=name)
    yield from [f"### {name}", "", _escaped(parser.description or ""), ""]
    for group in parser._action_groups:
        actions = [action for action in group._group_actions if action.dest != "help"]
        if actions:
            title = "argument" if not actions[0].option_strings else "option"
            named = group.title not in ("options", "positional arguments")
            yield from [f"*{group.title}*", ""] if named else []
            yield from [f"| {title} | meaning | default |", "|---|---|---|"]
            yield from map(_row, actions)
            yield ""


def _row(action: argparse.Action) -> str:
    text = " ".join((action.help or "").split()).removesuffix(" (required)")
    meaning, _, default = text.removesuffix(")").rpartition(" (default: ")
    if not meaning:
        meaning, default = text, "required" if action.required else ""
    metavar = (action.metavar or "").removeprefix("{None}|")  # type: ignore[union-attr]
    names = list(action.option_strings) or [metavar]
    if names[-1].startswith("--no-"):  # a switch
        default = {"True": "on", "False": "off"}.get(default, default)
    shown = ", ".join(f"`{name}`" for name in names)
    values = f" `{_cell(metavar)}`" if action.option_strings and metavar else ""
    value = (
        f"`{default}`"
        if default not in ("", "required", "on", "off", "None", "['None']")
        else default.strip("[]'").replace("None", "")
    )
    return f"| {shown}{values} | {_escaped(meaning)} | {_cell(value)} |"


def _escaped(text: str) -> str:
    return _cell(re.sub(r"([*_<\[\]$])", r"\\\1", text))


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


class Materials(SphinxDirective):
    """A table of the radio materials with their values at a frequency in hertz, the directive's argument."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        from scenes.scene.materials import EXTRAPOLATION, P2040

        f = float(self.arguments[0]) / 1e9
        lines = [
            f"| material | a | b | c | d | range, GHz | ε_r at {f:g} GHz | σ at {f:g} GHz, S/m | thickness, mm |",
            "|" + "---|" * 9,
        ]
        for name, row in P2040.items():
            cells = [
                f"`{name}`",
                f"{row.a:g}",
                f"{row.b:g}",
                f"{row.c:g}",
                f"{row.d:g}",
                "{:g} to {:g}".format(*row.range_ghz),
            ]
            low, high = (1 - EXTRAPOLATION) * row.range_ghz[0], (1 + EXTRAPOLATION) * row.range_ghz[1]
            values = [f"{row.a * f**row.b:.3g}", f"{row.c * f**row.d:.3g}"] if low <= f <= high else ["refused"] * 2
            lines.append("| " + " | ".join([*cells, *values, f"{1000 * row.thickness:g}"]) + " |")
        return self.parse_text_to_nodes("\n".join(lines))


def cite(app: Sphinx, what: str, name: str, thing: object, options: object, lines: list[str]) -> None:
    """Turn the keys in a docstring into citations."""
    lines[:] = [KEY.sub(r":cite:p:`\1`", line) for line in lines]


def lengthen_dashes(app: Sphinx, doctree: nodes.document) -> None:
    """Write the `` -- `` that Sphinx puts after a parameter's name as a dash."""
    for text in list(doctree.findall(nodes.Text)):
        if text == " -- ":
            text.parent.replace(text, nodes.Text(" – "))


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("commands", Commands)
    app.add_directive("materials", Materials)
    app.connect("autodoc-process-docstring", cite)
    app.connect("doctree-read", lengthen_dashes)
    return {"parallel_read_safe": True}
