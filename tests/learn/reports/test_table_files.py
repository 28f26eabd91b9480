"""Tables as LaTeX and CSV: as many cells in every line, special signs escaped, all digits in the CSV."""

import csv

import pytest

from learn.quantities.array_ceiling import CEILING
from learn.reports.provenance import Provenance
from learn.reports.table_files import write_tables

MADE = Provenance("lab", "a_b", "lab", "random", "18 training", "", "0", "Python", "2026-01-31", "1.0")
COLUMNS = {"ssim_median": "SSIM median", "aoa": "AoA error (°)", "parameters": "parameters", "absent": "absent"}
ROWS = {
    "a_b & 100 % †": {"ssim_median": 0.123456789, "ssim_spread": 0.01, "aoa": 2.5, "parameters": 12345},
    CEILING: {"ssim_median": 0.99, "aoa": 1},
}


@pytest.fixture
def folder(tmp_path):
    write_tables(ROWS, COLUMNS, tmp_path, MADE, "† says little")
    return tmp_path


def test_latex_has_as_many_cells_in_every_line_and_escapes_names(folder):
    lines = (folder / "table.tex").read_text().splitlines()
    comments, body = [line for line in lines if line.startswith("%")], [line for line in lines if line.endswith(r"\\")]
    assert comments == ["% lab", f"% {MADE.sentence()}", "% † says little"]
    assert [line for line in lines if "tabular" in line] == [r"\begin{tabular}{lrrr}", r"\end{tabular}"]
    assert [line.replace(r"\&", "").count("&") for line in body] == [3, 3, 3]
    assert body[0] == r"Method & SSIM median & AoA error (\textdegree{}) & parameters \\"
    assert body[1] == r"a\_b \& 100 \% \textdagger{} & 0.123 $\pm$ 0.010 & 2.500 & 12,345 \\"
    assert body[2].endswith(r"(bound) & 0.990 & 1.000 & -- \\")


def test_csv_has_all_digits(folder):
    with (folder / "table.csv").open(newline="") as file:
        first, bound = csv.DictReader(file)
    assert first == {
        "method": "a_b & 100 % †",
        "ssim_median": "0.123456789",
        "ssim_spread": "0.01",
        "aoa": "2.5",
        "parameters": "12345",
    }
    assert bound["method"] == CEILING and bound["parameters"] == ""
