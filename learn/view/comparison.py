"""A predicted spectrum beside the true one: the panels that show them, and the numbers below."""

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
"""RGB of the marks of a predicted spectrum, and of a recorded or traced one."""

Field = Complex[np.ndarray, "90 360"]


class Angle(NamedTuple):
    """A direction of arrival.

    Attributes:
        azimuth: 0…359 degrees.
        elevation: 1…90 degrees.
    """

    azimuth: int
    elevation: int


def dominant(picture: Picture) -> Angle:
    """The direction of a spectrum's maximum.

    >>> spectrum = np.zeros((90, 360))
    >>> spectrum[39, 200] = 1  # row 0 is 1 degree of elevation
    >>> dominant(spectrum)
    Angle(azimuth=200, elevation=40)
    """
    row, column = np.unravel_index(picture.argmax(), picture.shape)
    return Angle(int(AZIMUTHS_DEG[column]), int(ELEVATIONS_DEG[row]))


def panels(
    by: str, predicted: Spectrum | None, name: str, truth: Spectrum | None, in_phase: bool, in_db: bool
) -> list[Panel]:
    """Panels of the predicted spectrum, the true one and their difference, with the same colours for the first two.

    Args:
        by: what the prediction is made by.
        predicted: the predicted spectrum; None: nothing predicts, and there is no panel for it.
        name: what the true spectrum is called, e.g. "recorded, spectrum 00001".
        truth: the true spectrum; None: there is none, and its panel says so.
        in_phase: show the phase of the complex field instead of the magnitude.
        in_db: show magnitudes in dB, below the maximum of each spectrum.
    """
    colours, difference_colours = (
        (DEGREES, DEGREES) if in_phase
        else (DECIBELS, DECIBELS_DIFFERENCE) if in_db
        else (LINEAR, LINEAR_DIFFERENCE)
    )  # fmt: skip
    fields = [None if each is None else each.field for each in (predicted, truth)]
    if in_phase:
        fields[0] = in_phase_with(fields[0], fields[1])

    def panel(title: str, spectrum: Spectrum | None, field: Field | None, ink: tuple[int, int, int]) -> Panel:
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
        drawn.append(panel(f"predicted by {by}", predicted, fields[0], PREDICTED))
    drawn.append(panel(name, truth, fields[1], TRUE))
    if predicted is not None and truth is not None and all(each.values is not None for each in drawn):
        first, second = drawn
        assert first.values is not None and second.values is not None
        difference = first.values - second.values
        if in_phase:
            difference = (difference + 180) % 360 - 180
        drawn.append(Panel(f"predicted − {name.split(',')[0]}", difference, difference_colours, second.brightness))
    return drawn


def in_phase_with(field: Field | None, other: Field | None) -> Field | None:
    """A field times the one phase factor that brings it nearest to another field.

    A model that is trained on spectra does not know the common phase of its field. The factor is e^{j∠⟨field, other⟩},
    which minimises ‖field e^{jα} − other‖.

    Args:
        field: the field to turn; None: returned as it is.
        other: the field to compare it with; None: ``field`` is returned as it is.

    >>> other = np.full((90, 360), 1j)
    >>> bool(np.allclose(in_phase_with(-2j * other, other), 2 * other))
    True
    """
    if field is None or other is None:
        return field
    return field * np.exp(1j * np.angle((field.conj() * other).sum()))


def numbers(predicted: Spectrum | None, name: str, truth: Spectrum | None, milliseconds: float) -> str:
    """The numbers below the panels, as Markdown.

    Args:
        predicted: the predicted spectrum; None: nothing predicts.
        name: what the true spectrum is called.
        truth: the true spectrum; None: there is none.
        milliseconds: how long the prediction took.
    """
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
