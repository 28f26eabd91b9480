"""The size of figures on paper, and how they are written: as PNG and PDF, with where they come from at their foot."""

from __future__ import annotations

import textwrap
from io import BytesIO
from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_pdf import FigureCanvasPdf
from matplotlib.figure import Figure

from learn.reports.provenance import Provenance
from scenes.files.atomic import write_atomically
from scenes.files.errors import printable

COLUMN, PAGE = 3.5, 7.16  # Widths of a column and of a page of a two-column journal, inches

PNG_DPI, PDF_DPI = 220, 200  # Dots per inch of PNG files, and of pictures within a PDF

PNG_EFFORT = 3
"""Compression of PNG files, 0 to 9. They are a little larger than with the usual 6, and written in half the time."""

STYLE: dict[str, Any] = {
    "font.size": 8,
    "axes.titlesize": 8,
    "axes.labelsize": 8,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "legend.fontsize": 7,
    "axes.linewidth": 0.6,
    "lines.linewidth": 1.1,
    "lines.markersize": 3.5,
    "pdf.fonttype": 42,  # fonts that journals accept
}
"""Properties of Matplotlib for figures that are included at their own width."""

_NOTE_POINTS, _FOOT_POINTS = 7, 6
_LETTER = 0.53  # Mean width of a letter, in font sizes; a little too wide, so that no line is cut


def at_paper_size() -> Any:
    """A context, or a decorator, in which figures have the fonts and lines of ``STYLE``."""
    return rc_context(STYLE)  # type: ignore[arg-type]


def save(figure: Figure, path: Path, provenance: Provenance | None = None, note: str = "") -> None:
    """Write a figure as PNG and PDF; it grows at its foot by the lines of the note and of the provenance."""
    lines = [(note, _NOTE_POINTS, "0.2")] if note else []
    if provenance is not None:
        lines.append((provenance.sentence(), _FOOT_POINTS, "0.45"))
    if lines:
        _add_foot(figure, lines)
    png, pdf = (None, None) if provenance is None else (provenance.png_metadata(), provenance.pdf_metadata())
    write_png(figure, path, png)
    figure.set_layout_engine("none")  # the layout of the PNG, which takes long to find
    content = BytesIO()
    figure.set_dpi(PDF_DPI)
    FigureCanvasPdf(figure).print_pdf(content, metadata=pdf)
    write_atomically(path.with_suffix(".pdf"), content.getbuffer())


def write_png(figure: Figure, path: Path, metadata: dict[str, str] | None = None) -> None:
    """Write a figure as PNG alone."""
    content = BytesIO()
    figure.set_dpi(PNG_DPI)
    FigureCanvasAgg(figure).print_png(  # savefig would draw it twice
        content, metadata=metadata, pil_kwargs={"compress_level": PNG_EFFORT}
    )
    write_atomically(path, content.getbuffer())


def _add_foot(figure: Figure, texts: list[tuple[str, int, str]]) -> None:
    """Make the figure higher, and write texts of given sizes (points) and colours at its foot."""
    width, height = figure.get_size_inches()
    wrapped = [
        (
            textwrap.wrap(printable(text), int(72 * (width - 0.1) / (_LETTER * points)), break_on_hyphens=False),
            points,
            colour,
        )
        for text, points, colour in texts
    ]
    foot = sum(1.25 * points * len(lines) + 2 for lines, points, _ in wrapped) / 72 + 0.04  # inches
    whole = height + foot
    figure.set_size_inches(width, whole)
    figure.get_layout_engine().set(rect=(0, foot / whole, 1, height / whole))  # type: ignore[union-attr, call-arg]
    top = foot - 0.02
    for lines, points, colour in wrapped:
        place = {"x": 0.05 / width, "y": top / whole, "va": "top", "linespacing": 1.15}
        figure.text(s="\n".join(lines), fontsize=points, color=colour, parse_math=False, **place)
        top -= (1.25 * points * len(lines) + 2) / 72
