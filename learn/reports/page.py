"""Self-contained HTML pages in one look: figures inside the file, light and dark, readable on a phone and in print."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape

from scenes.atomic import write_atomically

SCORE_COLUMNS = {
    "ssim_median": "SSIM median",
    "ssim_mean": "SSIM mean",
    "ssim_p05": "SSIM 5th percentile",
    "psnr_mean": "PSNR (dB)",
    "mae_mean": "mean abs. error",
    "aoa_error_median_deg": "AoA error (°)",
}
"""Headings of a table of scores, by the names in ``Scores.summary``."""

ENVIRONMENT = Environment(
    loader=PackageLoader("learn.reports"), autoescape=select_autoescape(["j2"]), undefined=StrictUndefined
)


def write_page(path: Path, template: str, **values: Any) -> None:
    """Write an HTML page.

    Args:
        path: the page.
        template: name of a file in ``learn/reports/templates``.
        values: what the template shows.
    """
    write_atomically(path, ENVIRONMENT.get_template(template).render(**values).encode())


def embedded(folder: Path, names: tuple[str, ...]) -> dict[str, str]:
    """The figures NAME.png of a folder, each as the base64 text that a page has inside."""
    return {name: base64.b64encode((folder / f"{name}.png").read_bytes()).decode() for name in names}
