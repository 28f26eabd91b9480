"""HTML pages in one style for screens (light and dark) and print. Each is a single file that contains its figures."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape

from learn.baselines.array_ceiling import shown_name
from scenes.files.atomic import write_atomically

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
ENVIRONMENT.filters["shown_name"] = shown_name


def write_page(path: Path, template: str, **values: Any) -> None:
    """Write an HTML page.

    Args:
        path: path of the page.
        template: name of a file in ``learn/reports/templates``.
        values: values of the template's variables.
    """
    write_atomically(path, ENVIRONMENT.get_template(template).render(**values).encode())


def embedded(folder: Path, names: tuple[str, ...]) -> dict[str, str]:
    """Figures of a folder as base64 text, which a page embeds.

    Args:
        folder: the folder.
        names: names of the figures; the files are NAME.png.
    """
    return {name: base64.b64encode((folder / f"{name}.png").read_bytes()).decode() for name in names}
