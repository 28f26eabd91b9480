"""Options with values drawn at random: a command refuses them or takes them, and keeps every promise."""

import os
import shlex

import pytest
from hypothesis import given

from bisplat import __main__ as program
from tests.attack.options import COMMANDS, command_lines, options_of
from tests.attack.victims import Victim

pytestmark = pytest.mark.attack


def test_every_command_is_attacked():
    known = {name for name, value in vars(program).items() if callable(value) and value.__module__.endswith("commands")}
    known |= {"scene", "simulate", "view"}
    assert set(COMMANDS) == known - {"main"}
    assert {"snr_db", "diffraction", "cell"} <= set(options_of("simulate"))


@pytest.mark.parametrize("group", ["options"])
def test_other_values(group, workplace, tally):
    @given(command_lines())
    def attack(drawn) -> None:
        command, arguments, output = drawn
        needs = COMMANDS[command][1]
        place = "measured" if command == "responses" else output.split("/")[0]
        victim = Victim("", shlex.join([command, *arguments]), (), needs, (place,))
        tally.attack(victim, lambda folder: os.mkfifo(folder / "pipe"))

    attack()
    tally.finish()
