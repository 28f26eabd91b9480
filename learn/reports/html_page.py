"""HTML pages in one style for screens (light and dark) and print. Each is a single file that contains its figures."""

from __future__ import annotations

import base64
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape
from PIL import Image

from learn.quantities.array_ceiling import CEILING, SAMPLES, shown_name
from learn.reports.method_styles import THIS_RUN, method_name
from learn.reports.provenance import Provenance
from learn.reports.table_files import shown_number
from scenes.files.atomic import write_atomically

ENVIRONMENT = Environment(
    loader=PackageLoader("learn.reports"), autoescape=select_autoescape(["j2"]), undefined=StrictUndefined
)
ENVIRONMENT.filters.update(method_name=method_name, shown_name=shown_name, shown_number=shown_number)
ENVIRONMENT.globals.update(THIS_RUN=THIS_RUN, CEILING=CEILING, SAMPLES=SAMPLES)
ENVIRONMENT.globals["WITHOUT_TRAINING"] = {
    "mean-picture": "predicts the mean of the known spectra",
    "nearest": "copies the spectrum at the nearest known position",
    "inverse-distance": "averages the spectra at the four nearest known positions, weighted by 1 / distance",
}


def write_page(path: Path, template: str, provenance: Provenance | None = None, **values: Any) -> None:
    """Write an HTML page."""
    write_atomically(path, ENVIRONMENT.get_template(template).render(provenance=provenance, **values).encode())


class Picture(NamedTuple):
    """A figure in a page."""

    data: str  # the PNG as base64 text
    width: int  # width on the screen at most, CSS pixels


ON_SCREEN = 1.35  # How much larger than on paper a figure is on a screen


def embedded(folder: Path, names: tuple[str, ...]) -> dict[str, Picture]:
    """Figures of a folder, which a page embeds."""
    found = {}
    for name in names:
        content = (folder / f"{name}.png").read_bytes()
        with Image.open(BytesIO(content)) as image:
            inches = image.width / image.info.get("dpi", (96,))[0]
        found[name] = Picture(base64.b64encode(content).decode(), round(96 * ON_SCREEN * inches))
    return found
