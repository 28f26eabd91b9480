"""The page docs/options.md: ``python -m bisplat.commands.option_tables > docs/options.md``.

Each option is declared once, in a dataclass. The page, the command line and the Python functions all read it there.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Annotated, Any, get_args, get_origin, get_type_hints

from tyro.conf import Suppress

from learn.models.steps import Processes, Steps
from scenes.files.options import default_of, described
from scenes.scene.tolerances import Tolerances
from simulate.engines.engine import Machines
from simulate.engines.engine_table import ENGINES
from simulate.exchange.conversion import Conversion
from simulate.generation.simulation_options import Simulation

COMMANDS: dict[str, tuple[type, ...]] = {
    "bisplat simulate": (Simulation, *ENGINES.values(), Machines),
    "bisplat train": (Steps, Processes),
    "bisplat calibrate": (Tolerances,),
    "bisplat convert": (Conversion,),
}


def option_tables() -> str:
    """The page in Markdown."""
    lines = [
        "# Options",
        "",
        "Each option is an attribute of a dataclass, a keyword of the Python function, and an option of the command",
        "(`max_depth` is `--max-depth`). metadata.json and config.json record them under the same names. This page is",
        "made by `python -m bisplat.commands.option_tables > docs/options.md`.",
    ]
    for command, kinds in COMMANDS.items():
        for kind in kinds:
            lines += ["", f"## {command}: `{kind.__name__}`", "", "| option | default | meaning |", "|---|---|---|"]
            lines += [f"| `{name}` | {default} | {meaning} |" for name, default, meaning in _rows(kind)]
    return "\n".join(lines) + "\n"


def _rows(kind: type) -> Iterator[tuple[str, str, str]]:
    hints, meanings = get_type_hints(kind, include_extras=True), described(kind)
    for each in fields(kind):
        hint: Any = hints[each.name]
        inner = get_args(hint)[0] if get_origin(hint) is Annotated else hint
        if is_dataclass(inner) and isinstance(inner, type):
            yield from _rows(inner)
        elif Suppress not in get_args(hint):
            default = default_of(each)
            text = "" if default is None else f"`{str(default).lower() if isinstance(default, bool) else default}`"
            yield each.name, text, " ".join(meanings[each.name].split()).replace("|", "\\|")


if __name__ == "__main__":
    print(option_tables(), end="")
