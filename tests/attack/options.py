"""The options of every command, and commands on valid files that take one or two of them with other values."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Annotated, Any, get_args, get_origin, get_type_hints

from hypothesis import strategies as st

from bisplat.commands.command_groups import COMMANDS as OF_THE_PROGRAM
from tests.attack.changes import TEXTS
from tests.attack.victims import PLACE, RECORDED

COMMANDS: dict[str, tuple[str, tuple[str, ...]]] = {
    "check": ("data", ("data",)),
    "dataset": (f"recordings/log.npz {RECORDED}", ("recordings",)),
    "train": ("data --model mlp-responses --steps 2 --batch-size 2", ("data", "network")),
    "predict": ("network --positions places.csv", ("data", "network", "places.csv")),
    "compare": ("data --models nearest", ("data",)),
    "simulate": ("closet -n 3 --engine fullwave --field field", ("field",)),
    "scene": (f"meshes/wall.ply {PLACE}", ("meshes",)),
    "evaluate": ("nowhere", ()),
    "crossvalidate": ("nowhere --scene closet", ()),
    "export": ("kriged", ("data", "kriged")),
    "demo": ("--spectra 0", ()),
    "view": ("nowhere", ()),
    "calibrate": ("closet nowhere", ()),
    "plan": ("kriged -n 3", ("data", "kriged")),
    "locate": ("kriged data", ("data", "kriged")),
}
"""Of each command: arguments, and the files that these need. Where the work takes long, it has no files to work on."""

WITHOUT_OUTPUT = ("check", "evaluate", "crossvalidate", "view")

OUTPUTS = (
    *("", "x", "x.npz", "x.png", "a/b", "pipe", "data", "measured", "places.csv", "x" * 300),
    *("\x1b[2J", "[/red]", "é", "*"),
)
"""Names of outputs; none is outside of the workplace."""

STARTS_PROCESSES = ("workers", "ray", "gpu")  # Options whose valid values start other processes

ABSURD = ("", "0", "-1", "nan", "1e9", "9" * 20, "9" * 400, "x", "\x1b[2J", "[]")  # Their values here


def options_of(command: str) -> dict[str, Any]:
    """Name and type of each option of a command, as its function has them, or the dataclasses that this takes."""
    hints = get_type_hints(OF_THE_PROGRAM[command], include_extras=True)
    return _options({name: kind for name, kind in hints.items() if name != "return"})


def _options(annotated: dict[str, Any]) -> dict[str, Any]:
    named: dict[str, Any] = {}
    for name, annotation in annotated.items():
        kind = get_args(annotation)[0] if get_origin(annotation) is Annotated else annotation
        if dataclasses.is_dataclass(kind):
            hints = get_type_hints(kind, include_extras=True)
            named |= _options({field.name: hints[field.name] for field in dataclasses.fields(kind)})
        else:
            called = [each.name for each in get_args(annotation)[1:] if getattr(each, "name", None)]
            named[called[0] if called else name] = annotation
    return named


def _without(arguments: list[str], *spellings: str) -> list[str]:
    """The arguments without an option and its values, since no option may be given twice."""
    kept, dropping = [], False
    for word in arguments:
        dropping = word in spellings or (dropping and not word.startswith("-"))
        kept += [] if dropping else [word]
    return kept


@st.composite
def command_lines(draw: Callable[[st.SearchStrategy], Any]) -> tuple[str, list[str], str]:
    """Strategy: command, its arguments with other values of one to three options, and its output."""
    command = draw(st.sampled_from(sorted(COMMANDS)))
    arguments = COMMANDS[command][0].split()
    output = "out.npz" if command == "predict" else "out.onnx" if command == "export" else "out"
    positional, *_ = known = list(options_of(command))
    for _ in range(draw(st.integers(1, 3))):
        name = draw(st.sampled_from(known))
        option, kind = f"--{name.replace('_', '-')}", str(options_of(command)[name])
        arguments = _without(arguments, option, "-n" if name in ("spectra", "positions", "number") else option)
        if name == "output":
            output = draw(st.sampled_from(OUTPUTS))
        elif name in STARTS_PROCESSES:
            arguments.append(f"{option}={draw(st.sampled_from(ABSURD))}")
        elif name == positional:
            arguments[0] = draw(st.sampled_from(TEXTS))
        elif kind.startswith("bool") or name in ("json", "force"):
            arguments.append(draw(st.sampled_from((option, option.replace("--", "--no-", 1)))))
        elif "tuple" in kind.lower() or "Triple" in kind:
            arguments += [option, *draw(st.lists(st.sampled_from(TEXTS), min_size=command == "compare", max_size=3))]
        else:
            arguments.append(f"{option}={draw(st.sampled_from(TEXTS))}")
    if command not in WITHOUT_OUTPUT:
        arguments.append(f"--output={output}")
    return command, [each.replace("\0", "") for each in arguments], output
