"""Pages show names from files as text."""

from types import SimpleNamespace

import pytest

from learn.comparison.results_folder import Settings, row_name
from learn.quantities.array_ceiling import CEILING
from learn.reports.comparison_report import write_ablation
from learn.reports.figures import draw_ssim_distribution
from learn.reports.html_page import SCORE_COLUMNS, Picture, write_page

ODD = "<script>alert(1)</script>&amp;\"'"
ESCAPED = "&lt;script&gt;alert(1)&lt;/script&gt;&amp;amp;&#34;&#39;"

SETTINGS = Settings("data/lab", "files", 0, None, 50, "1 CPU threads")


def test_markup_in_names_is_text(tmp_path):
    values = {
        "settings": SimpleNamespace(dataset=ODD, dataset_sha256="0f", split=ODD, minutes=1.0, device=ODD),
        "rows": {ODD: {"ssim_median": 0.5}},
        "columns": {**SCORE_COLUMNS, "other": ODD},
        "figures": SimpleNamespace(ssim_cdf=Picture("x", 100)),
        "remark": ODD,
        "test": 1,
        "seeds": 1,
    }
    write_page(tmp_path / "page.html", "compare.html.j2", **values)
    page = (tmp_path / "page.html").read_text()
    assert "<script" not in page and page.count(ESCAPED) == 6


def test_methods_are_explained_whatever_follows_their_names(tmp_path):
    rows = {"nearest, 200 †": {"ssim_median": 0.5}, "mean-picture †": {"ssim_median": 0.4}}
    values = {"settings": SETTINGS, "columns": SCORE_COLUMNS, "remark": "", "test": 1, "seeds": 1}
    figures = SimpleNamespace(ssim_cdf=Picture("x", 100))
    write_page(tmp_path / "page.html", "compare.html.j2", rows=rows, figures=figures, **values)
    page = (tmp_path / "page.html").read_text()
    assert "nearest copies the" in page and "mean-picture predicts" in page and "inverse-distance averages" not in page


@pytest.mark.parametrize("name", ["$\\frac{$", "_mine", "a\x1b\nb"])
def test_methods_of_any_name_are_drawn(name, tmp_path):
    row = {"label": name, "test": 2, "ssim_median": 0.5, "ssim_spread": 0.1, "seed": 0, "seeds": 2, "train_size": None}
    (tmp_path / "runs" / row_name(row) / "logs" / "version_0").mkdir(parents=True)
    log = tmp_path / "runs" / row_name(row) / "logs" / "version_0" / "metrics.csv"
    log.write_text("step,validation_ssim\n99,0.5\n")
    rows = {"averages": lambda: [row, row], "rows": [row], "doubts": lambda: {name: "only 5 training steps"}}
    write_ablation(SimpleNamespace(**rows, folder=tmp_path, settings=SETTINGS, distances=None, array=None), tmp_path)
    draw_ssim_distribution({name: [0.1, 0.5], CEILING: [0.5, 0.9]}, tmp_path / "ssim.png")
    assert (tmp_path / "ablation.pdf").exists() and (tmp_path / "ssim.pdf").exists()
