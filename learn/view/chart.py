"""Fast drawing of spectra for the viewer: rectangular or polar panels with axes and colour bars.

Matplotlib draws axes and colour bars once, and a new spectrum only fills its panel. This takes milliseconds, a new
figure some hundred.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal, NamedTuple

import numpy as np
from jaxtyping import Float, UInt8
from matplotlib import colormaps
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.font_manager import findfont
from PIL import Image, ImageDraw, ImageFont

from learn.reports.plots import DIFFERENCE, LEAST_DB, MAGNITUDE, PHASE
from scenes.files.errors import printable
from simulate.spectra.angular_grid import COLUMNS, ROWS, AngularGrid

Kind = Literal["rectangular", "polar"]

LEFT, TOP, RIGHT, BOTTOM = 54, 46, 96, 46
"""Margins of a panel, pixels: for the elevations, the title, the colour bar and the azimuths."""

DPI = 100  # Dots per inch of axes

DIAMETER = 270  # Diameter of a polar panel in pixels

BACKGROUND, INK, MISSING = (255, 255, 255), (40, 40, 40), (225, 225, 225)
"""RGB of the background, of lines and text, and of a panel without a spectrum."""


class Colours(NamedTuple):
    """A colour map and the values at its ends."""

    name: str  # Matplotlib's name of the colour map
    low: float  # value of the first colour
    high: float  # value of the last colour
    unit: str  # text above the colour bar


LINEAR = Colours(MAGNITUDE, 0.0, 1.0, "")
DECIBELS = Colours(MAGNITUDE, LEAST_DB, 0.0, "dB")
DEGREES = Colours(PHASE, -180.0, 180.0, "°")
LINEAR_DIFFERENCE = Colours(DIFFERENCE, -1.0, 1.0, "")
DECIBELS_DIFFERENCE = Colours(DIFFERENCE, LEAST_DB, -LEAST_DB, "dB")


@dataclass(frozen=True)
class Panel:
    """One spectrum to draw."""

    title: str  # text above the spectrum
    # values in the unit of ``colours``. None: there is no spectrum, and the title says why.
    values: Float[np.ndarray, "90 360"] | None
    colours: Colours  # colours of the values
    brightness: Float[np.ndarray, "90 360"] | None = None  # factor 0…1 on the colour of each pixel. None: 1.
    # directions marked with a ring: azimuth and elevation in degrees, and RGB of the ring
    marks: tuple[tuple[float, float, tuple[int, int, int]], ...] = ()


def draw(panels: Sequence[Panel], kind: Kind, grid: AngularGrid) -> UInt8[np.ndarray, "H W 3"]:
    """Draw panels, one below the other."""
    return np.concatenate([_draw(panel, kind, grid) for panel in panels])


def in_decibels(spectrum: Float[np.ndarray, "90 360"]) -> Float[np.ndarray, "90 360"]:
    """20 log10 of a spectrum divided by its maximum, dB; values below ``LEAST_DB`` become ``LEAST_DB``."""
    maximum = max(float(spectrum.max()), 1e-12)
    return 20 * np.log10(np.maximum(spectrum / maximum, 10 ** (LEAST_DB / 20)))


def _draw(panel: Panel, kind: Kind, grid: AngularGrid) -> UInt8[np.ndarray, "H W 3"]:
    image = _frame(kind, grid, panel.colours).copy()
    if panel.values is None:
        colour = np.broadcast_to(np.array(MISSING, np.uint8), (ROWS, COLUMNS, 3))
    else:
        colour = colour_of(panel.values, panel.colours)
        if panel.brightness is not None:
            colour = (colour * panel.brightness[..., None]).astype(np.uint8)
    plot = _placed(colour, kind, grid)
    plot_area = image[TOP : TOP + plot.shape[0], LEFT : LEFT + plot.shape[1]]
    np.copyto(plot_area, plot, where=_inside(kind, grid)[..., None])
    drawn = Image.fromarray(image)
    pen = ImageDraw.Draw(drawn)
    pen.text((6, 18), printable(panel.title), fill=INK, font=_font(), anchor="ls")
    for azimuth, elevation, ink in panel.marks:
        x, y = _where(azimuth, elevation, kind, grid)
        for radius, line in ((6, (255, 255, 255)), (5, ink), (4, ink), (3, (255, 255, 255))):
            pen.ellipse((x - radius, y - radius, x + radius, y + radius), outline=line)
    return np.asarray(drawn)


def colour_of(values: Float[np.ndarray, "*shape"], colours: Colours) -> UInt8[np.ndarray, "*shape 3"]:
    """RGB of values; a value outside the range of the colour map gets the colour of the nearer end."""
    index = np.clip((values - colours.low) / (colours.high - colours.low), 0, 1) * 255
    return _table(colours.name)[index.astype(np.uint8)]


@cache
def _table(name: str) -> UInt8[np.ndarray, "256 3"]:
    return (255 * colormaps[name](np.linspace(0, 1, 256))[:, :3]).round().astype(np.uint8)


@cache
def _font() -> ImageFont.FreeTypeFont:
    return ImageFont.truetype(findfont("DejaVu Sans"), 13)  # Matplotlib includes this font


def _placed(colour: UInt8[np.ndarray, "90 360 3"], kind: Kind, grid: AngularGrid) -> UInt8[np.ndarray, "H W 3"]:
    """The plot of a spectrum's colours: the highest elevation is the top row, or the middle of the disc."""
    if kind == "rectangular":
        return colour[::-1]
    rows, columns, _ = _polar(grid)
    return colour[rows, columns]


@cache
def _polar(grid: AngularGrid) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Row and column of the spectrum for each pixel of a polar panel, and whether the grid has its direction."""
    x, y = np.meshgrid(np.arange(DIAMETER) + 0.5 - DIAMETER / 2, DIAMETER / 2 - np.arange(DIAMETER) - 0.5)
    radius = np.hypot(x, y) / (DIAMETER / 2)
    elevation = 90 * (1 - radius)
    columns = np.round(_column(np.degrees(np.arctan2(y, x)), grid)).astype(int)
    rows = np.round((elevation - grid.elevation_first_deg) / grid.elevation_step_deg).astype(int)
    columns[columns == round(360 / abs(grid.azimuth_step_deg))] = 0  # a full turn further
    inside = (radius <= 1) & (rows >= -1) & (rows <= ROWS) & (columns < COLUMNS)
    return rows.clip(0, ROWS - 1), columns.clip(0, COLUMNS - 1), inside


def _column(azimuth: float | Float[np.ndarray, "H W"], grid: AngularGrid) -> Any:
    """Column of an azimuth in degrees, from 0; beyond the last one if the grid does not reach so far."""
    return azimuth / grid.azimuth_step_deg % (360 / abs(grid.azimuth_step_deg))


@cache
def _inside(kind: Kind, grid: AngularGrid) -> np.ndarray:
    if kind == "rectangular":
        return np.ones((ROWS, COLUMNS), bool)
    return _polar(grid)[2]


def _where(azimuth: float, elevation: float, kind: Kind, grid: AngularGrid) -> tuple[float, float]:
    """Pixel (x, y) of a direction; azimuth and elevation are in degrees."""
    if kind == "rectangular":
        row = (elevation - grid.elevation_first_deg) / grid.elevation_step_deg
        return LEFT + _column(azimuth, grid) + 0.5, TOP + ROWS - 0.5 - row
    radius = DIAMETER / 2 * (1 - elevation / 90)
    middle = DIAMETER / 2
    angle = np.radians(azimuth)
    return LEFT + middle + radius * np.cos(angle), TOP + middle - radius * np.sin(angle)


@cache
def _frame(kind: Kind, grid: AngularGrid, colours: Colours) -> UInt8[np.ndarray, "H W 3"]:
    """A panel without its spectrum, title and marks: axes, labels and colour bar."""
    height, width = _inside(kind, grid).shape
    whole = np.array([LEFT + width + RIGHT, TOP + height + BOTTOM])  # pixels
    figure = Figure(figsize=tuple(whole / DPI), dpi=DPI)
    canvas, place = FigureCanvasAgg(figure), (LEFT, BOTTOM, width, height)
    axis = figure.add_axes(tuple(place / np.tile(whole, 2)), polar=kind == "polar")
    axis.tick_params(labelsize="small")
    if kind == "polar":
        axis.set(xticks=np.radians([0, 90, 180, 270]), yticks=[])
        axis.grid(False)
        axis.spines["polar"].set_visible(False)
        axis.set_xlabel("edge: elevation 0°, middle: 90°", fontsize="small", labelpad=0)
    else:
        turn, half = COLUMNS * grid.azimuth_step_deg, grid.elevation_step_deg / 2
        first, (lowest, highest) = 0 if turn > 0 else 360, grid.elevations_deg[[0, -1]]
        axis.set(xticks=range(0, 361, 90), yticks=range(0, 91, 30))
        axis.set(xlim=(first, first + turn), ylim=(lowest - half, highest + half))
        axis.set_xlabel("azimuth (°)", fontsize="small", labelpad=0)
        axis.set_ylabel("elevation (°)", fontsize="small")
    bar = figure.add_axes(((LEFT + width + 40) / whole[0], BOTTOM / whole[1], 10 / whole[0], height / whole[1]))
    figure.colorbar(ScalarMappable(Normalize(colours.low, colours.high), colours.name), bar)
    bar.set_title(colours.unit, fontsize="small")
    bar.tick_params(labelsize="small")
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3]
