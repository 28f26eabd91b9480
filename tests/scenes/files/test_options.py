"""An option is declared in one place, a dataclass; the command line, Python, JSON and the docs are made of it."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]

ADD_AN_OPTION = """
import inspect, json, sys
from pathlib import Path
import {module} as module

folder, source = Path(sys.argv[1]), Path(module.__file__).read_text()
source = source.replace("    Attributes:\\n", "    Attributes:\\n        colour: of the waves.\\n", 1)
source = source.replace("    {first}", "    colour: str = 'blue'\\n    {first}", 1)
exec(compile(source, module.__file__, "exec"), vars(module))  # as if the file had the option

sys.path.append("docs/_extensions")
from bisplat.commands.command_groups import COMMANDS
from from_code import command_section
assert any(line.startswith("| `--colour` `STR` | of the waves. |") for line in command_section(COMMANDS["{command}"]))
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
        ("learn.models.model_settings", "steps: int = 1500", "train", IN_TRAIN),
    ],
)
def test_an_option_added_to_the_dataclass_is_everywhere(module, first, command, uses, tmp_path):
    program = (ADD_AN_OPTION + uses + SHOW_THE_HELP).replace("{module}", module).replace("{first}", first)
    program = program.replace("{command}", command)
    words = [sys.executable, "-c", program, str(tmp_path / "out")]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "--colour" in done.stdout and "of the waves." in done.stdout
