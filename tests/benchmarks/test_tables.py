"""Tables of hand-written pages are filled in from the measured sections, and nothing wrong stays unnoticed."""

import pytest

from benchmarks.ledger.entry import Entry, Measured
from benchmarks.ledger.tables import with_tables
from scenes.files.errors import InputError


def entry(title: str, columns: list[str], *rows: list[str]) -> Entry:
    return Entry(title, "a command", "", {}, Measured("2031-02-03", "a test", "", columns, list(rows)))


ENTRIES = {
    "closet": entry("Closet", ["method", "SSIM", "s"], ["kriging", "0.9", "1"], ["network", "0.8", "2"]),
    "lab": entry("Lab", ["method", "SSIM", "s"], ["network", "0.7", "4"], ["copy", "0.6", "0"]),
    "sweep": entry(
        "Sweep",
        ["method", "training spectra", "SSIM"],
        ["network", "50", "0.5"],
        ["kriging", "50", "0.6"],
        ["kriging", "1000", "0.9"],
        ["bound", "–", "1"],
    ),
}


def table(comment: str) -> list[list[str]]:
    """The filled table's lines of cells, without the line below the headings."""
    text = with_tables(f"Before\n\n<!-- {comment} -->\nold\n<!-- end -->\n\nAfter\n", ENTRIES)
    assert text.startswith(f"Before\n\n<!-- {comment} -->\n\n|") and text.endswith("<!-- end -->\n\nAfter\n")
    assert "old" not in text and with_tables(text, ENTRIES) == text
    lines = [line for line in text.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in [lines[0], *lines[2:]]]


def test_whole_table_of_a_section_with_a_link_to_it():
    assert table("table: closet") == [["method", "SSIM", "s"], ["kriging", "0.9", "1"], ["network", "0.8", "2"]]
    text = with_tables("<!-- table: closet --><!-- end -->", ENTRIES)
    assert "From [Closet](generated/measurements.md#closet)." in text


def test_some_rows_and_columns():
    assert table("table: closet | rows: network | columns: s") == [["method", "s"], ["network", "2"]]


def test_one_column_of_several_sections_ordered_by_the_last():
    found = table("across: SSIM | sections: small room = closet; large = lab")
    assert found == [
        ["", "small room", "large"],
        ["network", "0.8", "0.7"],
        ["copy", "–", "0.6"],
        ["kriging", "0.9", "–"],
    ]
    assert table("across: s | sections: a = closet; b = lab | rows: copy")[1:] == [["copy", "–", "0"]]


def test_a_sweep_by_the_number_of_spectra():
    assert table("sizes: SSIM | section: sweep") == [
        ["", "50", "1000"],
        ["kriging", "0.6", "0.9"],
        ["network", "0.5", "–"],
        ["bound", "–", "–"],
    ]
    assert table("sizes: SSIM | section: sweep | rows: network")[1:] == [["network", "0.5", "–"]]


@pytest.mark.parametrize(
    "comment",
    [
        "table: cupboard",
        "table: closet | rows: networ",
        "table: closet | columns: m",
        "across: PSNR | sections: a = lab",
    ],
)
def test_unknown_names_are_refused(comment):
    with pytest.raises(InputError, match="expected the"):
        table(comment)
