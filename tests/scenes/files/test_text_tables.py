"""Names in a table are whole, in a pipe as in a narrow terminal."""

import re
import sys

from scenes.files.plain_text import print_rows, print_table

NAME = "bisplat-aperture-without-dynamic-network, 200"


def test_long_names_are_whole_where_there_is_no_terminal(capsys):
    columns = {f"a long heading {k}": 0.123456 for k in range(20)}
    print_rows("table", [{"": NAME} | columns])
    print_table("table", {NAME: columns})
    assert capsys.readouterr().out.count(NAME) == 2


def test_sentences_are_folded_where_there_is_no_terminal(capsys):
    print_table("table", {"": {"split": "half of the test positions have a training position nearby, " * 4}})
    assert 80 < max(map(len, capsys.readouterr().out.splitlines())) < 100


def test_long_names_are_folded_in_a_narrow_terminal(capsys, monkeypatch):
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "40")
    print_rows("table", [{"": NAME.replace(" ", ""), "SSIM": 0.5, "AoA (°)": 12.5, "train (s)": 3.25}])
    lines = re.sub(r"\x1b\[\d+m", "", capsys.readouterr().out).splitlines()
    assert max(map(len, lines)) <= 40
    assert "".join(line.split("│")[1].strip() for line in lines if line.startswith("│")) == NAME.replace(" ", "")
