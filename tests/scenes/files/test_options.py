"""An option is declared in one place, a dataclass; the command line, Python, JSON and the docs are made of it."""

import subprocess
import sys
from pathlib import Path

import pytest

from bisplat.commands.option_tables import option_tables

ROOT = Path(__file__).parents[3]

ADD_AN_OPTION = """
import inspect, json, sys
from pathlib import Path
import {module} as module

folder, source = Path(sys.argv[1]), Path(module.__file__).read_text()
source = source.replace("    Attributes:\\n", "    Attributes:\\n        colour: of the waves.\\n", 1)
source = source.replace("    {first}", "    colour: str = 'blue'\\n    {first}", 1)
exec(compile(source, module.__file__, "exec"), vars(module))  # as if the file had the option

from bisplat.commands.option_tables import option_tables
assert "| `colour` | `blue` | of the waves. |" in option_tables()
import bisplat
few = bisplat.Propagation(max_depth=0, rays=100)
"""

IN_SIMULATE = """
red = module.Propagation(max_depth=0, rays=100, colour="red")
simulated = bisplat.simulate("closet", folder, n=2, propagation=red).folder
assert json.loads((simulated / "metadata.json").read_text())["propagation"]["colour"] == "red"
bisplat.simulate(simulated, folder)  # by what it records
"""

IN_TRAIN = """
assert "colour" in inspect.signature(bisplat.train).parameters and "colour: of the waves." in bisplat.train.__doc__
data = bisplat.simulate("closet", folder / "data", n=20, propagation=few)
bisplat.train(data, folder / "run", model="mlp-responses", steps=1, colour="red")
assert json.loads((folder / "run" / "config.json").read_text())["by_steps"]["colour"] == "red"
assert bisplat.load_run(folder / "run").config.by_steps.colour == "red"
"""

SHOW_THE_HELP = """
from bisplat.__main__ import main
sys.argv = ["bisplat", "{command}", "--help"]
main()
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("module", "first", "command", "uses"),
    [
        ("simulate.rays.core.propagation", "max_depth: int = 3", "simulate", IN_SIMULATE),
        ("learn.models.steps", "steps: int = 1500", "train", IN_TRAIN),
    ],
)
def test_an_option_added_to_the_dataclass_is_everywhere(module, first, command, uses, tmp_path):
    program = ADD_AN_OPTION.replace("{module}", module).replace("{first}", first) + uses
    program += SHOW_THE_HELP.replace("{command}", command)
    words = [sys.executable, "-c", program, str(tmp_path / "out")]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "--colour" in done.stdout and "of the waves." in done.stdout


def test_the_page_of_options_is_that_of_the_code():
    assert (ROOT / "docs" / "options.md").read_text() == option_tables()
