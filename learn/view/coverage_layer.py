"""The map of received powers in the 3D view: its colours, those of the survey positions, and the key beside them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, UInt8
from PIL import Image, ImageDraw

from learn.powers.coverage import NO_GATEWAY, CoverageMap
from learn.reports.coverage_report import INTERVAL, distinct
from learn.reports.plots import MAGNITUDE
from learn.view.chart import BACKGROUND, INK, Colours, colour_of, font
from learn.view.power_subject import PowerSubject
from scenes.files.errors import printable

STRONGEST = "strongest gateway"
"""What the map shows, if it is not one gateway."""

POWER, WIDTH = "power", "90 % interval"
"""Quantities of a map."""

SILENT = (190, 190, 190)
"""RGB where nothing is received."""

ENDS = (1, 99)
"""Percentiles of the measured powers at which the colours end."""

OPAQUE = 215
"""Opacity of the map, 0 to 255: the floor shines through."""

KEY_WIDTH, LINE = 400, 20
"""Width of the key and height of its lines, pixels."""


class Drawn(NamedTuple):
    """What to draw."""

    # RGBA of the cells; row 0 is the smallest y. Nothing is drawn where the map says nothing.
    image: UInt8[np.ndarray, "ny nx 4"]
    points: UInt8[np.ndarray, "K 3"]  # RGB of the survey positions
    key: UInt8[np.ndarray, "H W 3"]  # the colour bar, or the colours of the gateways


def drawn(subject: PowerSubject, coverage: CoverageMap, shown: str, quantity: str) -> Drawn:
    """Colours of a map and of the survey positions.

    Positions have the colour of the measured power on the scale of the map, so that a position that looks like the map
    around it is predicted rightly. On a map of intervals they are grey.
    """
    dataset, powers = subject.dataset, subject.dataset.rssi_dbm
    names = dataset.gateway_names
    gateway = names.index(shown) if shown in names else None
    if quantity == WIDTH and coverage.width is not None:
        silent = coverage.strongest == NO_GATEWAY
        title = f"width of the 90 % interval, {shown}"
        if gateway is not None:
            width = coverage.width[gateway]
        else:
            width = np.where(silent, np.nan, _taken(coverage.width, np.maximum(coverage.strongest, 0)))
            title += "; grey: nothing received"
        told = width[np.isfinite(width)]
        low, high = (float(told.min()), float(told.max())) if told.size else (0.0, 0.0)
        scale = Colours(INTERVAL, low, high + 1e-6, " dB")
        cells = colour_of(np.nan_to_num(width, nan=low), scale)
        cells[np.isnan(width)] = SILENT
        points = np.broadcast_to(np.array(SILENT, np.uint8), (len(dataset), 3))
        return Drawn(_image(cells, coverage), points, _bar(scale, title))
    if gateway is None:
        table = np.round(255 * np.array([each[:3] for each in distinct(len(names))])).astype(np.uint8)
        table = np.vstack([table, [SILENT]]).astype(np.uint8)  # −1 is the last
        cells, points = table[coverage.strongest], table[subject.strongest_measured]
        seen = sorted({*np.unique(coverage.strongest), *np.unique(subject.strongest_measured)} - {NO_GATEWAY})
        return Drawn(_image(cells, coverage), points, _list([(names[each], table[each]) for each in seen]))
    measured = powers[~np.isnan(powers)]
    low, high = np.percentile(measured, ENDS) if measured.size else (dataset.floor_dbm, 0.0)
    scale = Colours(MAGNITUDE, float(low), max(float(high), float(low) + 1e-6), " dBm")
    cells = colour_of(np.nan_to_num(coverage.median[gateway]), scale)
    cells[~coverage.received[gateway]] = SILENT
    points = colour_of(np.nan_to_num(powers[:, gateway]), scale)
    points[np.isnan(powers[:, gateway])] = SILENT
    return Drawn(_image(cells, coverage), points, _bar(scale, f"power at {shown}; grey: nothing received"))


def _taken(values: Float[np.ndarray, "G ny nx"], index: np.ndarray) -> Float[np.ndarray, "ny nx"]:
    return np.take_along_axis(values, index[None], axis=0)[0]


def _image(cells: UInt8[np.ndarray, "ny nx 3"], coverage: CoverageMap) -> UInt8[np.ndarray, "ny nx 4"]:
    opacity = np.where(np.isnan(coverage.median[0]), 0, OPAQUE).astype(np.uint8)
    return np.dstack([cells, opacity])


def _bar(scale: Colours, title: str) -> UInt8[np.ndarray, "H W 3"]:
    """A horizontal colour bar with three values below it."""
    image = Image.new("RGB", (KEY_WIDTH, 66), BACKGROUND)
    pen = ImageDraw.Draw(image)
    pen.text((6, 16), printable(title), fill=INK, font=font(13), anchor="ls")
    pixels = np.array(image)
    pixels[26:42, 6 : KEY_WIDTH - 6] = colour_of(np.linspace(scale.low, scale.high, KEY_WIDTH - 12), scale)
    image = Image.fromarray(pixels)
    pen = ImageDraw.Draw(image)
    for share, anchor in ((0.0, "lt"), (0.5, "mt"), (1.0, "rt")):
        value = scale.low + share * (scale.high - scale.low)
        place = (6 + share * (KEY_WIDTH - 12), 47)
        pen.text(place, f"{value:.1f}{scale.unit}".replace("-", "−"), fill=INK, font=font(11), anchor=anchor)
    return np.asarray(image)


def _list(entries: Sequence[tuple[str, np.ndarray]]) -> UInt8[np.ndarray, "H W 3"]:
    """The names of gateways beside their colours, in two columns."""
    rows = -(-(len(entries) + 1) // 2)
    image = Image.new("RGB", (KEY_WIDTH, 24 + LINE * rows), BACKGROUND)
    pen = ImageDraw.Draw(image)
    pen.text((6, 16), STRONGEST, fill=INK, font=font(13), anchor="ls")
    for number, (name, colour) in enumerate([*entries, ("nothing received", np.array(SILENT))]):
        x, y = 6 + (KEY_WIDTH // 2) * (number // rows), 24 + LINE * (number % rows)
        pen.rectangle((x, y + 2, x + 12, y + 14), fill=tuple(int(each) for each in colour))
        pen.text((x + 20, y + 8), printable(name)[:24], fill=INK, font=font(12), anchor="lm")
    return np.asarray(image)
