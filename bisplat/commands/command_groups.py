"""The commands in groups. The command line takes its commands from this table, and prints them in this order."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import version

from bisplat.commands.comparison_commands import compare
from bisplat.commands.dataset_commands import dataset
from bisplat.commands.evaluation_commands import crossvalidate, evaluate
from bisplat.commands.locate_command import locate
from bisplat.commands.predict_command import predict
from bisplat.commands.scene_command import scene
from bisplat.commands.simulate_command import simulate
from bisplat.commands.training_commands import check, demo, export, train
from bisplat.commands.uses_commands import calibrate, plan
from bisplat.commands.view_command import view

GROUPS: dict[str, tuple[Callable[..., None], ...]] = {
    "From a scene to a model": (scene, simulate, train, evaluate, view),
    "First look": (demo,),
    "Datasets": (check, dataset),
    "Predictions": (predict, locate, plan, export),
    "Comparisons": (crossvalidate, compare),
    "Scenes": (calibrate,),
}
"""Every command, by the title of its group; the everyday commands come first."""

COMMANDS: dict[str, Callable[..., None]] = {each.__name__: each for group in GROUPS.values() for each in group}
"""Every command by its name."""

INTRODUCTION = """\
Ray-trace spatial spectra in NeRF² format, train models, and score them.

usage: bisplat COMMAND ...        run a command
       bisplat COMMAND --help     list its options
       bisplat --version          print the version
"""


def overview() -> str:
    """The text that ``bisplat`` and ``bisplat --help`` print: each command with the first line of its docstring."""
    lines = [INTRODUCTION]
    for title, commands in GROUPS.items():
        lines.append(f"{title}:")
        lines += [f"  {each.__name__:<14} {summary(each)}" for each in commands]
        lines.append("")
    return "\n".join(lines).rstrip()


def summary(command: Callable[..., None]) -> str:
    """The first line of a command's docstring: a sentence that says what it does."""
    return (command.__doc__ or "").partition("\n")[0]


def stated_version() -> str:
    return f"bisplat-wrf {version('bisplat-wrf')}"
