"""``bisplat`` without a command: every command in its group, and the version."""

from importlib.metadata import version

import pytest

from bisplat.commands.command_groups import COMMANDS, GROUPS, summary


@pytest.mark.parametrize("arguments", [(), ("-h",), ("--help",)], ids=["none", "-h", "--help"])
def test_overview_shows_every_command_in_its_group(command, arguments):
    status, out, err = command(*arguments)
    lines = out.splitlines()
    assert (status, err) == (0, "")
    first = lines.index(f"{next(iter(GROUPS))}:")
    shown = [line.split()[0] for line in lines[first:] if line.startswith("  ")]
    assert shown == list(COMMANDS) == [each.__name__ for group in GROUPS.values() for each in group]
    assert max(map(len, lines)) <= 80


@pytest.mark.parametrize("name", COMMANDS)
def test_help_begins_with_one_sentence_and_names_no_file_of_the_documentation(command, name):
    status, out, _ = command(name, "--help")
    sentence = summary(COMMANDS[name])
    assert sentence.endswith(".") and sentence.count(". ") == 0 and sentence[0].isupper()
    assert status == 0 and sentence in out
    assert "docs/" not in out and ".py" not in out
    assert "['None']" not in " ".join(out.replace("│", " ").split())


def test_version(command):
    assert command("--version") == (0, f"bisplat-wrf {version('bisplat-wrf')}\n", "")
