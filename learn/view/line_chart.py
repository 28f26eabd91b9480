"""Fast drawing of lines on two axes for the viewer."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, UInt8
from PIL import Image, ImageDraw

from learn.view.chart import BACKGROUND, BOTTOM, INK, LEFT, MISSING, RIGHT, TOP, font
from scenes.files.errors import printable
from simulate.spectra.angular_grid import COLUMNS

WIDTH, HEIGHT = LEFT + COLUMNS + RIGHT, 110  # Width of the panel, that of a spectrum, and height of the plot, pixels

FOOT = 18  # Height of the line below the axis, pixels


class Curve(NamedTuple):
    """A line to draw."""

    points: Float[np.ndarray, "n 2"]  # x and y; those that are not finite are left out
    ink: tuple[int, int, int]  # RGB
    stems: bool = False  # draw a stem from the axis to each point, and no line


def draw_curves(
    title: str,
    curves: Sequence[Curve],
    axis: str,
    ends: tuple[float, float] | None = None,
    unit: str = "",
    foot: str = "",
) -> UInt8[np.ndarray, "H W 3"]:
    """Draw lines over an axis with a label. The ends are those of the other axis; None: those of what is drawn."""
    image = Image.new("RGB", (WIDTH, TOP + HEIGHT + BOTTOM + FOOT), BACKGROUND)
    pen = ImageDraw.Draw(image)
    right, bottom, small = WIDTH - RIGHT, TOP + HEIGHT, font(11)
    pen.text((6, 18), printable(title), fill=INK, font=font(13), anchor="ls")
    pen.rectangle((LEFT - 1, TOP - 1, right, bottom), outline=INK)
    finite = [each.points[np.isfinite(each.points).all(axis=1)] for each in curves if not each.stems]
    every = np.concatenate([*finite, np.zeros((0, 2))])
    if not len(every):
        return np.asarray(image)
    start, end = _apart(every[:, 0])
    low, high = _apart(every[:, 1]) if ends is None else ends

    def where(points: Float[np.ndarray, "n 2"]) -> list[tuple[float, float]]:
        shares = (points - [start, low]) / [end - start, high - low]
        x, y = LEFT + (right - LEFT) * shares[:, 0], bottom - HEIGHT * shares[:, 1].clip(0, 1)
        return list(zip(x.tolist(), y.tolist(), strict=True))

    for value in _ticks(low, high):
        y = where(np.array([[start, value]]))[0][1]
        pen.line((LEFT - 5, y, LEFT, y), fill=INK)
        pen.line((LEFT, y, right - 1, y), fill=MISSING)
        pen.text((LEFT - 8, y), f"{value:g}{unit}".replace("-", "−"), fill=INK, font=small, anchor="rm")
    for value in _ticks(start, end):
        x = where(np.array([[value, low]]))[0][0]
        pen.line((x, bottom, x, bottom + 5), fill=INK)
        pen.text((x, bottom + 7), f"{value:g}".replace("-", "−"), fill=INK, font=small, anchor="mt")
    pen.text((right + 8, bottom + 7), axis, fill=INK, font=small, anchor="lt")
    for each in curves:
        if each.stems:
            shown = (each.points[:, 0] >= start) & (each.points[:, 0] <= end) & (each.points[:, 1] > low)
            for x, y in where(each.points[shown]):
                pen.line((x, bottom - 1, x, y), fill=each.ink)
                pen.ellipse((x - 2, y - 2, x + 2, y + 2), fill=each.ink)
        else:
            pen.line(where(each.points[np.isfinite(each.points).all(axis=1)]), fill=each.ink, width=2, joint="curve")
    pen.text((6, bottom + 36), foot, fill=INK, font=small, anchor="lm")
    return np.asarray(image)


def _apart(values: Float[np.ndarray, " n"]) -> tuple[float, float]:
    """The ends of values, which differ."""
    low, high = float(values.min()), float(values.max())
    return (low, high) if high > low else (low - 0.5, high + 0.5)


def _ticks(start: float, end: float) -> Float[np.ndarray, " n"]:
    """Four to ten round numbers between two."""
    rough = (end - start) / 5
    power = 10.0 ** np.floor(np.log10(rough))
    step = power * next(each for each in (1, 2, 5, 10) if each * power >= rough)
    return np.arange(np.ceil(start / step), np.floor(end / step) + 1) * step + 0.0  # no −0
