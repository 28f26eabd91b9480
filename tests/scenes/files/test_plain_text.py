"""Names from files are shown whole and as they are: in tables, figures, Markdown, file names and on stderr."""

import io
import re
import sys
import warnings
from dataclasses import replace

import pytest
from markdown_it import MarkdownIt
from matplotlib.figure import Figure
from matplotlib.text import Text

from bisplat.__main__ import refuse
from scenes.drawing import scene_drawing
from scenes.drawing.scene_drawing import draw_scene
from scenes.files.errors import did_you_mean, named, printable
from scenes.files.plain_text import in_figure, in_markdown, print_rows, print_table, say

ODD = ["$\\frac{$", "$a_b$", "a\\$b$", "[/x]", "[red]a[/red]", ":smile:", "<b>a</b>", "*a*", "![a](/etc/passwd)", "`a`"]
COMMANDS = "\x1b[2J\x9b2J\x07\u202e\udcff\n"
NAME = "bisplat-aperture-without-dynamic-network, 200"
ESCAPED = r"\x1b[2J\x9b2J\x07\u202e\udcff\n"


@pytest.mark.parametrize("name", ODD)
def test_tables_show_text_as_it_is(name, capsys):
    print_table(name, {name: {name: name}})
    print_rows(name, [{name: name}])
    heading = name.replace("_", " ")
    text = capsys.readouterr().out
    assert text.count(name) + (text.count(heading) if heading != name else 0) == 7


def test_tables_and_sentences_hold_no_commands(capsys):
    print_table(COMMANDS, {COMMANDS: {COMMANDS: COMMANDS}})
    print_rows(COMMANDS, [{COMMANDS: COMMANDS}])
    say(COMMANDS)
    with pytest.raises(SystemExit):
        refuse(f"{COMMANDS}: no such file")
    out, err = capsys.readouterr()
    assert out.count(ESCAPED) == 7 and err.count(ESCAPED) == 2
    assert not {*"\x1b\x9b\x07\u202e\udcff"} & {*out, *err}


@pytest.mark.parametrize("name", [*ODD, "_a", COMMANDS, "x" * 10_000])
def test_figures_show_text_as_it_is(name):
    figure = Figure()
    axis = figure.subplots()
    axis.plot([0, 1], label=in_figure(name))
    axis.set_title(in_figure(name))
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        legend = axis.legend()
        figure.savefig(io.BytesIO())
    assert len(legend.get_texts()) == 1
    text, is_formula = axis.title._preprocess_math(axis.title.get_text())
    assert not is_formula and len(text) <= 80
    if name in ODD:
        assert text == name


@pytest.mark.parametrize("name", [*ODD, COMMANDS, "# a", "1. a", "- a", "a\n\nb", "&lt;", "|a|b|\n|-|-|", "    a"])
def test_markdown_shows_text_as_it_is(name):
    paragraph = MarkdownIt("commonmark").enable("table").parse(f"**Note.** {in_markdown(name)}")
    assert [token.type for token in paragraph] == ["paragraph_open", "inline", "paragraph_close"]
    shown = (paragraph[1].children or [])[4:]  # after the bold word
    assert {token.type for token in shown} <= {"text", "text_special"}
    assert "".join(token.content for token in shown).strip() == printable(name).strip()


@pytest.mark.parametrize("name", [*ODD, "_a", COMMANDS[:3], "x" * 1000])
def test_scenes_of_any_name_are_drawn(scene, name, tmp_path, monkeypatch):
    texts = []
    monkeypatch.setattr(scene_drawing, "draw_plan", lambda axes, scene: ([item.name for item in scene.objects], ""))
    monkeypatch.setattr(scene_drawing, "draw_view", lambda axes, scene: [])
    monkeypatch.setattr(Figure, "savefig", lambda figure, *_, **__: texts.extend(figure.findobj(Text)))
    objects = tuple(replace(item, name=f"{name}{item.name}", material=name) for item in scene.objects)
    materials = {name: replace(scene.materials["wood"], name=name)}
    draw_scene(replace(scene, name=name, objects=objects, materials=materials), tmp_path / "scene.png")
    with_name = [text for text in texts if in_figure(name)[1:60] in text.get_text()]
    assert len(with_name) == 4  # the title, two objects, their material
    assert not any(text._preprocess_math(text.get_text())[1] for text in texts)


def test_messages_are_bounded():
    assert named("a" * 10_000) == f'"{"a" * 77}…"' and named(COMMANDS) == f'"{ESCAPED}"'
    assert len(did_you_mean("x" * 10**7, ["a" * 10_000] * 10_000)) < 4000
    assert did_you_mean("concrte", ["concrete"]) == 'did you mean "concrete"?'


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
