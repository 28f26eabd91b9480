"""Options with values drawn at random: a command refuses them or takes them, and keeps every promise."""

import os
import shlex

import pytest

from bisplat.commands.command_groups import COMMANDS as OF_THE_PROGRAM
from tests.attack.options import COMMANDS, command_lines, options_of
from tests.attack.victims import Victim

pytestmark = pytest.mark.attack


def test_every_command_is_attacked():
    assert set(COMMANDS) == set(OF_THE_PROGRAM)
    assert {"snr_db", "diffraction", "cell"} <= set(options_of("simulate"))


@pytest.mark.parametrize("group", ["options"])
def test_other_values(group, tally):
    def attack(drawn):
        command, arguments, output = drawn
        place = output.split("/")[0]
        victim = Victim("", shlex.join([command, *arguments]), (), COMMANDS[command][1], (place,))
        return victim, lambda folder: os.mkfifo(folder / "pipe")

    tally.attacks(command_lines().map(attack))
