"""Comparison of a predicted spectrum with the true one: the panels, and the numbers below them."""

from __future__ import annotations

import numpy as np
from jaxtyping import Complex

from learn.data.metrics import score
from learn.view.chart import (
    DECIBELS,
    DECIBELS_DIFFERENCE,
    DEGREES,
    LINEAR,
    LINEAR_DIFFERENCE,
    Panel,
    in_decibels,
)
from learn.view.subject import Spectrum
from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.beamformer import Beamformer

PREDICTED, TRUE = (230, 120, 0), (0, 150, 220)
"""RGB of the marks of a predicted spectrum, and of a recorded or traced one."""

Field = Complex[np.ndarray, "90 360"]


def panels(
    by: str,
    predicted: Spectrum | None,
    name: str,
    truth: Spectrum | None,
    grid: AngularGrid,
    in_phase: bool,
    in_db: bool,
) -> list[Panel]:
    """Panels of the predicted spectrum, the true one and their difference. The first two have the same colour scale."""
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
            return Panel(f"{title}: none at this position", None, colours)
        azimuth, elevation = grid.dominant_angles(spectrum.values)
        marks = ((azimuth, elevation, ink),)
        if not in_phase:
            values = in_decibels(spectrum.values) if in_db else spectrum.values
            return Panel(title, values, colours, marks=marks)
        if field is None:
            return Panel(f"{title}: its phase is not known", None, colours)
        return Panel(
            f"{title}, phase",
            np.degrees(np.angle(field)),
            colours,
            0.15 + 0.85 * np.clip(spectrum.values, 0, 1),
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
    """A field times the phase factor e^{jα} that minimises ‖field e^{jα} − other‖, with α = ∠⟨field, other⟩."""
    if field is None or other is None:
        return field
    return field * np.exp(1j * np.angle((field.conj() * other).sum()))


def numbers(
    predicted: Spectrum | None, name: str, truth: Spectrum | None, beamformer: Beamformer, milliseconds: float
) -> str:
    """The numbers below the panels, as Markdown."""
    lines = []
    for label, spectrum in (("predicted", predicted), (name.split(",")[0], truth)):
        if spectrum is not None:
            azimuth, elevation = beamformer.grid.dominant_angles(spectrum.values)
            lines.append(f"{label}: dominant direction azimuth {azimuth:g}°, elevation {elevation:g}°")
    if predicted is not None and truth is not None:
        scores = score(predicted.values[None], truth.values[None], beamformer.grid, beamformer.array)
        lines.append(f"**SSIM {scores.ssim[0]:.3f}**, directions {scores.aoa_error[0]:.1f}° apart")
    if predicted is not None:
        lines.append(f"predicted in {milliseconds:.0f} ms")
    return "  \n".join(lines)
