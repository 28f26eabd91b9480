"""Pages and figures show names from files as text."""

import numpy as np
import pytest

from learn.comparison.comparison import Comparison
from learn.comparison.results_folder import Settings, row_name
from learn.quantities.array_ceiling import CEILING
from learn.quantities.spectra import Spectra
from learn.reports.comparison_report import write_comparison
from learn.reports.figures import draw_distribution

ODD = "<script>alert(1)</script>&amp;\"'"
ESCAPED = "&lt;script&gt;alert(1)&lt;/script&gt;&amp;amp;&#34;&#39;"


def comparison(*labels: str) -> Comparison:
    """A comparison of methods with two seeds that took five steps each."""
    settings = Settings(
        dataset=f"/data/{ODD}", quantity="spectrum", split=ODD, seed=0, guard=0.0, minutes=None, steps=50, device=ODD
    )
    row = {"train_size": None, "test": 2, "known": 5, "train": 4, "ssim_median": 0.5, "ssim_mean": 0.5, "steps": 5}
    rows = [{**row, "label": label, "seed": seed} for label in labels for seed in (0, 1)]
    return Comparison(quantity=Spectra(), settings=settings, folder=None, rows=rows)


def test_markup_in_names_is_text(tmp_path):
    write_comparison(comparison(ODD.replace("/", "")), tmp_path)
    page = (tmp_path / "table.html").read_text()
    assert "<script" not in page and page.count(ESCAPED) >= 2


def test_methods_are_explained_whatever_follows_their_names(tmp_path):
    write_comparison(comparison("nearest", "mean-picture"), tmp_path)
    page = (tmp_path / "table.html").read_text()
    assert "nearest copies the" in page and "mean-picture predicts" in page and "inverse-distance averages" not in page


@pytest.mark.parametrize("name", ["$\\frac{$", "_mine", "a\x1b\nb"])
def test_methods_of_any_name_are_drawn(name, tmp_path):
    row = {"label": name, "seed": 0, "train_size": None}
    (tmp_path / "runs" / row_name(row) / "logs" / "version_0").mkdir(parents=True)
    log = tmp_path / "runs" / row_name(row) / "logs" / "version_0" / "metrics.csv"
    log.write_text("step,validation_ssim\n99,0.5\n")
    write_comparison(comparison(name), tmp_path, variants=True)
    draw_distribution({name: np.array([0.1, 0.5]), CEILING: np.array([0.5, 0.9])}, tmp_path / "ssim.png")
    assert all((tmp_path / f"{figure}.pdf").exists() for figure in ("variants", "learning_curves", "ssim"))
