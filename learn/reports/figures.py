"""Figures for reports: spectra side by side, distributions of SSIM, and errors over the transmitter region."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from matplotlib.figure import Figure
from matplotlib.ticker import StrMethodFormatter
from scipy.special import ndtri

from learn.quantities.array_ceiling import shown_name
from learn.reports.method_styles import line_styles
from learn.reports.paper import COLUMN, PAGE, at_paper_size, save, write_png
from learn.reports.plots import MAGNITUDE, label_log_axis, plot_spectrum
from learn.reports.provenance import Provenance
from scenes.files.plain_text import in_figure
from simulate.spectra.angular_grid import AngularGrid

RANKS = {"worst": 0.0, "lower quartile": 0.25, "median": 0.5, "upper quartile": 0.75, "best": 1.0}
"""Spectra that are drawn as examples: name, and fraction of the spectra that have a lower SSIM."""


def ranked(ssim: Float[np.ndarray, " K"]) -> list[tuple[str, int]]:
    """Names and indices of the spectra that are drawn as examples."""
    order = np.argsort(ssim)
    return [(name, int(order[round(share * (len(order) - 1))])) for name, share in RANKS.items()]


@at_paper_size()
def draw_spectra(
    spectra: Float[np.ndarray, "6 90 360"],
    positions: Float[np.ndarray, "6 3"],
    grid: AngularGrid,
    path: Path,
) -> None:
    """Draw six spectra, each below the position of its transmitter."""
    figure = Figure(figsize=(PAGE, 3.0), layout="constrained")
    axes = figure.subplots(2, 3, sharex=True, sharey=True)
    for axis, spectrum, position in zip(axes.flat, spectra, positions, strict=True):
        plot_spectrum(spectrum, axis, grid)
        axis.label_outer()
        axis.set_title("transmitter at ({:.2f}, {:.2f}, {:.2f}) m".format(*position))
    figure.colorbar(axes[0, 0].images[0], ax=axes, label="magnitude, largest = 1")
    write_png(figure, path)


@at_paper_size()
def draw_examples(
    prediction: Float[np.ndarray, "K 90 360"],
    truth: Float[np.ndarray, "K 90 360"],
    ssim: Float[np.ndarray, " K"],
    grid: AngularGrid,
    path: Path,
    names: tuple[str, str] = ("predicted", "truth"),
    provenance: Provenance | None = None,
) -> None:
    """Draw five examples, from the worst to the best SSIM, each as predicted spectrum, true spectrum and difference."""
    figure = Figure(figsize=(PAGE, 5.6), layout="constrained")
    axes = figure.subplots(len(RANKS), 3, sharex=True, sharey=True)
    for row, (name, index) in zip(axes, ranked(ssim), strict=True):
        panels = (prediction[index], truth[index], prediction[index] - truth[index])
        for axis, panel, difference in zip(row, panels, (False, False, True), strict=True):
            plot_spectrum(panel, axis, grid, difference)
            axis.label_outer()
        figure.colorbar(row[2].images[0], ax=row[2], label="difference")
        figure.colorbar(row[1].images[0], ax=row[1], label="magnitude")
        row[0].set_ylabel(f"{name}\nSSIM {ssim[index]:.3f}\nelevation (°)")
    for axis, title in zip(axes[0], (*names, " − ".join(names)), strict=True):
        axis.set_title(title)
    save(figure, path, provenance)


@at_paper_size()
def draw_examples_polar(
    prediction: Float[np.ndarray, "K 90 360"],
    truth: Float[np.ndarray, "K 90 360"],
    ssim: Float[np.ndarray, " K"],
    grid: AngularGrid,
    path: Path,
    provenance: Provenance | None = None,
) -> None:
    """Draw the examples of ``draw_examples`` as polar charts, with boresight in the middle and azimuth as the angle."""
    figure = Figure(figsize=(PAGE, 4.2), layout="constrained")
    axes = figure.subplots(3, len(RANKS), subplot_kw={"projection": "polar"})
    for column, (name, index) in zip(axes.T, ranked(ssim), strict=True):
        panels = (prediction[index], truth[index], prediction[index] - truth[index])
        for axis, panel, difference in zip(column, panels, (False, False, True), strict=True):
            plot_spectrum(panel, axis, grid, difference)
            axis.set(xlabel="", yticklabels=["", "", ""])
            axis.tick_params(labelsize="x-small", pad=-2)
            axis.set_xticklabels([])
        column[0].set_title(f"{name}\nSSIM {ssim[index]:.3f}")
    axes[-1, 0].set_xticklabels(["0°", "90°", "180°", "270°"])  # the same in all
    for row, label in zip(axes, ("predicted", "truth", "predicted − truth"), strict=True):
        row[0].set_ylabel(label, labelpad=24)
        unit = "difference" if "−" in label else "magnitude"
        figure.colorbar(row[-1].collections[0], ax=row, shrink=0.8, label=unit)
    note = "azimuth (°) around, elevation 90° in the middle, rings at 60°, 30° and 0°"
    save(figure, path, provenance, note)


@at_paper_size()
def draw_distribution(
    scores: Mapping[str, Float[np.ndarray, " K"]],
    path: Path,
    label: str = "SSIM",
    share: str = "share of test spectra",
    provenance: Provenance | None = None,
    ends: tuple[float | None, float | None] = (None, None),
    logarithmic: bool = False,
) -> None:
    """Draw the cumulative distribution of a score of every method and of the array's ceiling, between ends of it."""
    figure = Figure(figsize=(COLUMN, 2.3 + 0.15 * len(scores)), layout="constrained")
    axis, styles = figure.subplots(), line_styles(scores)
    axis.set_xscale("log" if logarithmic else "linear")
    for name, values in scores.items():
        stated = values[~np.isnan(values)]
        if len(stated):
            style = {key: each for key, each in styles[name].items() if key != "marker"}
            axis.ecdf(stated, label=f"{in_figure(shown_name(name))}: median {np.median(stated):.3g}", **style)
    axis.set(xlabel=label, ylabel=share, xlim=ends, ylim=(0, 1))
    axis.grid(alpha=0.3)
    if logarithmic:
        label_log_axis(axis.xaxis)
    if axis.lines:
        figure.legend(loc="outside upper left", handlelength=3.2)
    save(figure, path, provenance)


@at_paper_size()
def draw_reliability(errors: Float[np.ndarray, "K P"], path: Path, provenance: Provenance | None = None) -> None:
    """Draw the share of errors within stated intervals against the share that each interval should contain."""
    errors = errors[np.isfinite(errors).all(axis=1)]
    stated = np.linspace(0.01, 0.99, 99)
    within = np.sort(errors, axis=None).searchsorted(ndtri((1 + stated) / 2), side="right") / errors.size
    figure = Figure(figsize=(COLUMN, 3.4), layout="constrained")
    axis = figure.subplots()
    axis.plot([0, 1], [0, 1], color="0.6", lw=1, ls="--", label="as stated")
    axis.plot(stated, within, lw=1.8, label=f"found, {len(errors)} test spectra")
    axis.set(xlabel="stated share of true values in the interval", ylabel="found share", aspect="equal")
    axis.grid(alpha=0.3)
    figure.legend(loc="outside upper left", ncols=2)
    save(figure, path, provenance)


LARGEST_AOA_ERROR = 30.0  # Upper end of the colour scale of AoA errors in the map, degrees


class MapScore(NamedTuple):
    """A score that ``draw_error_map`` shows."""

    values: Float[np.ndarray, " K"]  # [K] the score at each test position
    limits: tuple[float, float]  # ends of the colour scale
    label: str  # what it is, with its unit
    colours: str = MAGNITUDE  # name of the colour map

    @classmethod
    def of_spectra(cls, ssim: Float[np.ndarray, " K"], aoa_error: Float[np.ndarray, " K"]) -> list[MapScore]:
        """SSIM and AoA error, degrees."""
        return [
            cls(ssim, (0, 1), "SSIM"),
            cls(aoa_error, (0, LARGEST_AOA_ERROR), "AoA error (°)", f"{MAGNITUDE}_r"),
        ]

    @property
    def extend(self) -> str:
        """Ends of the colour scale beyond which there are values, as Matplotlib calls them."""
        below, above = bool((self.values < self.limits[0]).any()), bool((self.values > self.limits[1]).any())
        return {(False, False): "neither", (True, False): "min", (False, True): "max"}.get((below, above), "both")


@at_paper_size()
def draw_error_map(
    positions: Float[np.ndarray, "K 3"],
    scores: Sequence[MapScore],
    known: Float[np.ndarray, "n 3"],
    path: Path,
    provenance: Provenance | None = None,
) -> None:
    """Draw scores over the transmitter region, from above and from the side."""
    figure = Figure(figsize=(PAGE, 2.9 * len(scores)), layout="constrained")
    axes = figure.subplots(len(scores), 2, squeeze=False)
    for row, score in zip(axes, scores, strict=True):
        for axis, (first, second) in zip(row, ((0, 1), (0, 2)), strict=True):
            axis.scatter(known[:, first], known[:, second], s=1.5, color="0.75", label="training positions")
            points = axis.scatter(
                positions[:, first],
                positions[:, second],
                c=score.values,
                s=14,
                cmap=score.colours,
                vmin=score.limits[0],
                vmax=score.limits[1],
                label="test positions",
            )
            axis.set(xlabel=f"{'xyz'[first]} (m)", ylabel=f"{'xyz'[second]} (m)", aspect="equal")
        figure.colorbar(points, ax=row, label=score.label, extend=score.extend)
    axes[0, 0].set_title("from above")
    axes[0, 1].set_title("from the side")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper left", ncols=2)
    save(figure, path, provenance)


@at_paper_size()
def draw_error_over_distance(
    distance: Float[np.ndarray, " K"],
    ssim: Float[np.ndarray, " K"],
    aoa_error: Float[np.ndarray, " K"],
    path: Path,
    provenance: Provenance | None = None,
) -> None:
    """Draw SSIM and AoA error against the distance to the nearest training position, with medians of five groups."""
    figure = Figure(figsize=(PAGE, 2.8), layout="constrained")
    axes = figure.subplots(1, 2)
    fifths = np.array_split(np.argsort(distance), 5)
    for axis, values, label in zip(axes, (ssim, aoa_error), ("SSIM", "AoA error (°)"), strict=True):
        axis.scatter(100 * distance, values, s=6, color="0.6", label="one position")
        groups = [group for group in fifths if len(group)]
        medians = [(100 * np.median(distance[group]), np.median(values[group])) for group in groups]
        axis.plot(*zip(*medians, strict=True), "o-", label="median of a fifth of them")
        axis.set(xlabel="distance to the nearest training position (cm)", ylabel=label)
        axis.grid(alpha=0.3)
    axes[0].set_ylim(top=1)
    if np.max(aoa_error) > 2:
        axes[1].set_yscale("symlog", linthresh=1)
        axes[1].set_yticks([0, 1, *(n for n in (2, 5, 10, 20, 50, 100) if n <= np.max(aoa_error))])
        axes[1].yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper left", ncols=2)
    save(figure, path, provenance)
