"""Figures of reports: ticks of logarithmic axes, and the line of the array's ceiling."""

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

import learn.reports.figures
from learn.quantities.array_ceiling import CEILING
from learn.reports.figures import draw_distribution, draw_error_over_distance
from learn.reports.method_styles import CEILING_STYLE
from learn.reports.plots import label_log_axis


def labelled(axis) -> list[str]:
    """Texts of the labelled ticks within the axis."""
    low, high = axis.get_view_interval()
    ticks = [*axis.get_major_ticks(), *axis.get_minor_ticks()]
    return [tick.label1.get_text() for tick in ticks if low <= tick.get_loc() <= high and tick.label1.get_text()]


@pytest.mark.parametrize(
    ("sizes", "least"),
    [([15, 900], 3), ([50, 800], 3), ([100, 400], 3), ([5, 10], 2), ([210, 290], 2), ([0.02, 40], 3), ([7, 7], 2)],
)
def test_logarithmic_axis_has_several_plain_labels(sizes, least):
    figure = Figure()
    axes = figure.subplots()
    axes.plot(sizes, [0.2, 0.5], "o-")
    axes.set(xscale="log")
    label_log_axis(axes.xaxis)
    figure.draw_without_rendering()
    labels = labelled(axes.xaxis)
    assert least <= len(labels) == len(set(labels)) <= 9
    assert not any("times" in label for label in labels)  # 2×10²


@pytest.fixture
def drawn(monkeypatch):
    """The figures that are drawn, by the names of their files."""
    figures = {}
    monkeypatch.setattr(learn.reports.figures, "save", lambda figure, path, *_: figures.update({path: figure}))
    return figures


@pytest.mark.parametrize("largest", [0.4, 1.5, 4, 80])
def test_axis_of_angles_has_at_least_two_labels(drawn, largest):
    errors = np.linspace(0, largest, 20)
    draw_error_over_distance(np.linspace(0.01, 0.2, 20), 1 - errors / 100, errors, "distance")
    drawn["distance"].draw_without_rendering()
    assert 2 <= len(labelled(drawn["distance"].axes[1].yaxis)) <= 10


@pytest.mark.parametrize("methods", [["nearest"], ["model", "mean-picture", "nearest"], [f"m{n}" for n in range(24)]])
def test_ceiling_has_one_colour_that_no_method_has(drawn, methods):
    generator = np.random.default_rng(0)
    names = [*methods[:1], CEILING, *methods[1:]]
    draw_distribution({name: generator.random(9) for name in names}, "ssim")
    colours = {line.get_label().split(":")[0]: to_rgb(line.get_color()) for line in drawn["ssim"].axes[0].lines}
    bound = colours.pop(f"{CEILING} (bound)")
    assert bound == to_rgb(CEILING_STYLE["color"])
    assert bound not in colours.values() and len(colours) == len(methods)
    assert all(max(colour) - min(colour) > 0.05 for colour in colours.values())
