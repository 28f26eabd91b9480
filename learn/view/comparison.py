"""A predicted spectrum beside the true one: panels and numbers, on one scale."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Complex

from learn.metrics import score
from learn.view.chart import (
    DECIBELS,
    DECIBELS_DIFFERENCE,
    DEGREES,
    LINEAR,
    LINEAR_DIFFERENCE,
    Panel,
    in_decibels,
)
from learn.view.subject import Picture, Spectrum
from simulate.angular_grid import AZIMUTHS_DEG, ELEVATIONS_DEG

PREDICTED, TRUE = (230, 120, 0), (0, 150, 220)
"""Colours of what is predicted, and of what is recorded or traced."""

Field = Complex[np.ndarray, "90 360"]


class Angle(NamedTuple):
    """A direction of arrival in degrees."""

    azimuth: int
    elevation: int


def dominant(picture: Picture) -> Angle:
    """Where a picture's maximum is."""
    row, column = np.unravel_index(picture.argmax(), picture.shape)
    return Angle(int(AZIMUTHS_DEG[column]), int(ELEVATIONS_DEG[row]))


def panels(
    by: str, predicted: Spectrum | None, name: str, truth: Spectrum | None, in_phase: bool, in_db: bool
) -> list[Panel]:
    """Predicted, true and their difference, on one scale."""
    colours, between = (
        (DEGREES, DEGREES) if in_phase
        else (DECIBELS, DECIBELS_DIFFERENCE) if in_db
        else (LINEAR, LINEAR_DIFFERENCE)
    )  # fmt: skip
    fields = [None if each is None else each.field for each in (predicted, truth)]
    if in_phase:
        fields[0] = in_phase_with(fields[0], fields[1])

    def one(title: str, spectrum: Spectrum | None, field: Field | None, ink) -> Panel:
        if spectrum is None:
            return Panel(f"{title}: none here", None, colours)
        marks = ((*dominant(spectrum.picture), ink),)
        if not in_phase:
            values = in_decibels(spectrum.picture) if in_db else spectrum.picture
            return Panel(title, values, colours, marks=marks)
        if field is None:
            return Panel(f"{title}: pictures have no phase", None, colours)
        return Panel(
            f"{title}, phase",
            np.degrees(np.angle(field)),
            colours,
            0.15 + 0.85 * np.clip(spectrum.picture, 0, 1),
            marks,
        )

    drawn = []
    if predicted is not None:
        drawn.append(one(f"predicted by {by}", predicted, fields[0], PREDICTED))
    drawn.append(one(name, truth, fields[1], TRUE))
    if predicted is not None and truth is not None and all(panel.values is not None for panel in drawn):
        first, second = drawn
        assert first.values is not None and second.values is not None
        difference = first.values - second.values
        if in_phase:
            difference = (difference + 180) % 360 - 180
        drawn.append(Panel(f"predicted − {name.split(',')[0]}", difference, between, second.brightness))
    return drawn


def in_phase_with(field: Field | None, other: Field | None) -> Field | None:
    """A field turned by the one phase that brings it nearest to another: pictures do not determine it."""
    if field is None or other is None:
        return field
    return field * np.exp(1j * np.angle((field.conj() * other).sum()))


def figures(predicted: Spectrum | None, name: str, truth: Spectrum | None, milliseconds: float) -> str:
    """The numbers below the picture."""
    lines = []
    for label, spectrum in (("predicted", predicted), (name.split(",")[0], truth)):
        if spectrum is not None:
            azimuth, elevation = dominant(spectrum.picture)
            lines.append(f"{label}: dominant direction azimuth {azimuth}°, elevation {elevation}°")
    if predicted is not None and truth is not None:
        scores = score(predicted.picture[None], truth.picture[None])
        lines.append(f"**SSIM {scores.ssim[0]:.3f}**, directions {scores.aoa_error[0]:.1f}° apart")
    if predicted is not None:
        lines.append(f"predicted in {milliseconds:.0f} ms")
    return "  \n".join(lines)
