"""Figures say where they come from, in their metadata; a method looks the same in every figure."""

import itertools
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from learn.reports.figures import draw_distribution, draw_reliability
from learn.reports.method_styles import KNOWN, line_styles
from learn.reports.paper import COLUMN
from learn.reports.provenance import Provenance, command

MADE = Provenance("lab on held-out", "mlp", "lab", "random", "18 training", "", "0", "Python", "2026-01-31", "1.0")


@pytest.mark.parametrize("given", ["~/runs/my lab", "runs/lab"])
def test_command_can_be_typed_again(given):
    typed = given.replace("~", str(Path.home()))
    shown = "~/'runs/my lab'" if "my" in given else given
    assert command(["/x/bin/bisplat", "evaluate", typed]) == f"bisplat evaluate {shown}"
    assert command(["/x/bisplat/__main__.py", "evaluate", typed]) == f"bisplat evaluate {shown}"
    assert command(["/x/pytest", typed]) == command([]) == "Python"


def test_png_and_pdf_name_their_origin_and_are_a_column_wide(tmp_path):
    draw_distribution({"mlp": np.array([0.2, 0.4])}, tmp_path / "ssim.png", provenance=MADE)
    draw_reliability(np.ones((2, 3)), tmp_path / "reliability.png", MADE)
    for name in ("ssim", "reliability"):
        with Image.open(tmp_path / f"{name}.png") as image:
            assert image.text["Description"] == MADE.sentence() and image.text["Title"] == MADE.title
            assert image.width / image.info["dpi"][0] == pytest.approx(COLUMN, abs=0.01)
        content = (tmp_path / f"{name}.pdf").read_bytes()
        for word in (b"/Title", b"/Subject", b"/Keywords", b"/Creator (bisplat-wrf 1.0)", MADE.title.encode()):
            assert word in content
        assert b"/MediaBox [ 0 0 252 " in content  # 3.5 in in points


def test_foot_keeps_the_size_of_the_axes_and_overlaps_nothing(monkeypatch, tmp_path):
    drawn = []

    def write_png(figure, *_):
        figure.draw_without_rendering()
        drawn.append(figure)

    monkeypatch.setattr("learn.reports.paper.write_png", write_png)
    for made in (None, MADE):
        draw_distribution({"mlp": np.array([0.2, 0.4])}, tmp_path / "x.png", provenance=made)
    plain, footed = drawn
    heights = [figure.axes[0].get_position().height * figure.get_size_inches()[1] for figure in (plain, footed)]
    assert heights[1] == pytest.approx(heights[0], rel=0.05)
    foot = footed.texts[0].get_window_extent()
    assert foot.y0 >= 0 and foot.x1 <= footed.bbox.x1
    assert foot.y1 < footed.axes[0].xaxis.label.get_window_extent().y0


def test_a_method_looks_the_same_in_any_order_and_any_company():
    labels = ["mine", "yours", "helmholtz", "nearest"]
    expected = line_styles(labels)
    for order in itertools.permutations(labels):
        assert line_styles(order) == expected
    marked = line_styles(["nearest †", "mlp"])["nearest †"]
    assert marked == expected["nearest"] == line_styles(["nearest"])["nearest"]
    sizes = line_styles(["nearest, 20", "nearest, 200", "mlp"])
    assert {style["color"] for name, style in sizes.items() if "nearest" in name} == {expected["nearest"]["color"]}
    assert sizes["nearest, 20"]["ls"] != sizes["nearest, 200"]["ls"]
    assert line_styles(["mlp (this run)"])["mlp (this run)"]["color"] == line_styles(["mlp"])["mlp"]["color"]


def test_methods_differ_in_colour_and_marker_and_neighbours_in_dash():
    colours, _, markers = zip(*KNOWN.values(), strict=True)
    assert len(set(colours)) == len(set(markers)) == len(KNOWN)
    others = [f"m{number}" for number in range(24)]
    looks = [tuple(map(str, style.values())) for style in line_styles([*KNOWN, *others]).values()]
    assert len(set(looks)) == len(looks)
