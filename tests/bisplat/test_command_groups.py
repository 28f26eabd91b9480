"""``bisplat`` without a command: every command in its group, and the version."""

import sys
from importlib.metadata import version

import pytest

from bisplat.__main__ import main
from bisplat.commands.command_groups import COMMANDS, GROUPS, summary

EVERYDAY = ["scene", "simulate", "train", "evaluate", "view"]


def printed(monkeypatch, capsys, *arguments: str) -> str:
    """Standard output of ``bisplat`` with these arguments, which ends with status 0."""
    monkeypatch.setattr(sys, "argv", ["bisplat", *arguments])
    main()
    out, err = capsys.readouterr()
    assert err == ""
    return out


@pytest.mark.parametrize("arguments", [(), ("-h",), ("--help",)], ids=["none", "-h", "--help"])
def test_overview_shows_every_command_in_its_group(monkeypatch, capsys, arguments):
    lines = printed(monkeypatch, capsys, *arguments).splitlines()
    first = lines.index(f"{next(iter(GROUPS))}:")
    shown = [line.split()[0] for line in lines[first:] if line.startswith("  ")]
    assert shown == list(COMMANDS) and shown[:5] == EVERYDAY
    assert all(f"{title}:" in lines for title in GROUPS)
    assert max(map(len, lines)) <= 80


def test_each_command_is_in_one_group():
    names = [each.__name__ for group in GROUPS.values() for each in group]
    assert len(names) == len(set(names)) == len(COMMANDS)


@pytest.mark.parametrize("name", COMMANDS)
def test_summary_is_one_short_sentence(name):
    sentence = summary(COMMANDS[name])
    assert sentence.endswith(".") and sentence.count(". ") == 0 and sentence[0].isupper()


@pytest.mark.parametrize("name", COMMANDS)
def test_help_of_a_command_names_no_file_of_the_documentation(monkeypatch, capsys, name):
    monkeypatch.setattr(sys, "argv", ["bisplat", name, "--help"])
    with pytest.raises(SystemExit) as ended:
        main()
    out = capsys.readouterr().out
    assert ended.value.code == 0 and summary(COMMANDS[name]) in out
    assert "docs/" not in out and ".py" not in out
    assert "['None']" not in " ".join(out.replace("│", " ").split())


def test_version(monkeypatch, capsys):
    assert printed(monkeypatch, capsys, "--version") == f"bisplat-wrf {version('bisplat-wrf')}\n"
