"""``bisplat`` without a command: every command in its group, and the version."""

import sys
from importlib.metadata import version

import pytest

from bisplat.__main__ import main
from bisplat.commands.command_groups import COMMANDS, GROUPS, summary


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
    assert shown == list(COMMANDS) == [each.__name__ for group in GROUPS.values() for each in group]
    assert max(map(len, lines)) <= 80


@pytest.mark.parametrize("name", COMMANDS)
def test_help_begins_with_one_sentence_and_names_no_file_of_the_documentation(monkeypatch, capsys, name):
    monkeypatch.setattr(sys, "argv", ["bisplat", name, "--help"])
    with pytest.raises(SystemExit) as ended:
        main()
    out = capsys.readouterr().out
    sentence = summary(COMMANDS[name])
    assert sentence.endswith(".") and sentence.count(". ") == 0 and sentence[0].isupper()
    assert ended.value.code == 0 and sentence in out
    assert "docs/" not in out and ".py" not in out
    assert "['None']" not in " ".join(out.replace("│", " ").split())


def test_version(monkeypatch, capsys):
    assert printed(monkeypatch, capsys, "--version") == f"bisplat-wrf {version('bisplat-wrf')}\n"
