"""Plots of spectra and of distributions of scores on a Matplotlib axis, for reports and for users.

Without a given axis, each function draws a new figure, complete with colour bar or legend. On a given axis these are
left to the caller, who knows what else is in the figure.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.patheffects import withStroke
from matplotlib.projections.polar import PolarAxes
from matplotlib.ticker import Locator, LogLocator, MaxNLocator, NullFormatter, StrMethodFormatter

from learn.quantities.array_ceiling import shown_name
from learn.reports.method_styles import line_styles
from scenes.files.errors import ParameterError, check_array, require_flag, require_instance
from scenes.files.plain_text import in_figure
from simulate.spectra.angular_grid import COLUMNS, ROWS, AngularGrid
from simulate.spectra.spectrum import check_spectra

# The colour maps of figures, reports and the viewer. The one for phases is cyclic.
MAGNITUDE = "viridis"
DIFFERENCE = "RdBu_r"
PHASE = "twilight"
LEAST_DB = -30.0  # Lower end of the scale in decibels, dB relative to the spectrum's maximum


def plot_spectrum(
    spectrum: Float[np.ndarray, "90 360"],
    ax: Axes | None = None,
    grid: AngularGrid = AngularGrid(),
    difference: bool = False,
) -> Axes:
    """Plot a spectrum over azimuth and elevation, with the horizon at the bottom.

    Azimuth is periodic: on a grid of a full turn, azimuth 0° is drawn at both ends.

    Args:
        spectrum: magnitude [90, 360], 0…1; with ``difference`` the difference of two spectra, −1…1.
        ax: the axis to draw on; ``ax.figure.colorbar(ax.images[0])`` adds a colour bar. None: a new figure with one.
        grid: the directions of rows and columns, ``dataset.grid``. The default is that of the NeRF² format.
        difference: use the colour map of differences, with white for 0.

    Returns:
        The axis.

    Raises:
        ParameterError: the array has another shape, or holds grey levels instead of numbers from 0 to 1.

    Example:
        >>> import bisplat
        >>> spectrum = bisplat.load_run("runs/lab").predict([[2.5, 3.0, 1.2]]).spectra[0]
        >>> ax = bisplat.plot_spectrum(spectrum)
        >>> ax.get_xlabel(), ax.get_ylabel()
        ('azimuth (°)', 'elevation (°)')
        >>> ax.figure.savefig("spectrum.png")
    """
    values = _one(spectrum)
    _check(ax, grid, difference)
    given, ax = ax, _new_axis(figsize=(6.4, 2.6)) if ax is None else ax
    azimuth, elevation = _pixel_edges(grid)
    turn = COLUMNS * grid.azimuth_step_deg
    if np.isclose(turn, 360):
        values = np.column_stack([values, values[:, 0]])
        azimuth = np.append(azimuth, turn + 0.5 * grid.azimuth_step_deg)
    extent = (azimuth[0], azimuth[-1], elevation[0], elevation[-1])
    image = ax.imshow(values, origin="lower", extent=extent, aspect="auto", **_colours(difference))
    ax.set(xlabel="azimuth (°)", ylabel="elevation (°)", xticks=range(0, 361, 90), yticks=range(0, 91, 30))
    ax.set(xlim=(0, min(turn, 360)), ylim=extent[2:])
    if given is None:
        ax.figure.colorbar(image, ax=ax, label=_quantity(difference))
    return ax


def plot_polar(
    spectrum: Float[np.ndarray, "90 360"],
    ax: Axes | None = None,
    grid: AngularGrid = AngularGrid(),
    difference: bool = False,
) -> Axes:
    """Plot a spectrum as the gateway sees it: azimuth is the angle, and boresight is in the centre.

    Args:
        spectrum: magnitude [90, 360], 0…1; with ``difference`` the difference of two spectra, −1…1.
        ax: a polar axis to draw on, such as ``plt.subplot(projection="polar")``;
            ``ax.figure.colorbar(ax.collections[0])`` adds a colour bar. None: a new figure with one.
        grid: the directions of rows and columns, ``dataset.grid``. The default is that of the NeRF² format.
        difference: use the colour map of differences, with white for 0.

    Returns:
        The axis. Its angle is the azimuth in radians; its radius is 90 minus the elevation in degrees.

    Raises:
        ParameterError: the axis is not polar, or the array has another shape or holds grey levels instead of numbers
            from 0 to 1.

    Example:
        >>> import bisplat
        >>> dataset = bisplat.read_dataset("data/lab")
        >>> ax = bisplat.plot_polar(dataset.spectra[0], grid=dataset.grid)
        >>> ax.get_xlabel()
        'azimuth around, elevation from the rim (0°) to the centre (90°)'
    """
    values = _one(spectrum)
    _check(ax, grid, difference)
    given, ax = ax, _new_axis(figsize=(6, 4.2), subplot_kw={"projection": "polar"}) if ax is None else ax
    if not isinstance(ax, PolarAxes):
        raise ParameterError("ax", f'expected an axis with projection="polar", found {type(ax).__name__}')
    azimuth, elevation = _pixel_edges(grid)
    radius = (90 - elevation).clip(0)
    image = ax.pcolormesh(np.radians(azimuth), radius, values, rasterized=True, **_colours(difference))
    ax.set_xticks(np.radians([0, 90, 180, 270]))
    ax.set_yticks([30, 60, 90], ["60°", "30°", ""], path_effects=[withStroke(linewidth=2, foreground="white")])
    ax.set(xlabel="azimuth around, elevation from the rim (0°) to the centre (90°)", ylim=(0, 90))
    ax.grid(alpha=0.3)
    if given is None:
        ax.figure.colorbar(image, ax=ax, label=_quantity(difference), shrink=0.8, pad=0.1)
    return ax


def plot_cdf(
    scores: Mapping[str, Float[np.ndarray, " K"]] | Float[np.ndarray, " K"],
    ax: Axes | None = None,
    quantity: str = "SSIM",
) -> Axes:
    """Plot the cumulative distribution of the scores of one method or of several.

    Args:
        scores: a score of each spectrum [K]; or a dictionary from names of methods to such scores. The names become
            labels, with the median; a method's line looks the same in every figure.
        ax: the axis to draw on; ``ax.legend()`` adds the names. None: a new figure, with a legend.
        quantity: label of the scores' axis, with the unit, such as "AoA error (°)".

    Returns:
        The axis.

    Raises:
        ParameterError: there are no scores, or one is not finite.

    Example:
        >>> import bisplat
        >>> scores = bisplat.evaluate("runs/lab").scores
        >>> ax = bisplat.plot_cdf({name: each.aoa_error for name, each in scores.items()}, quantity="AoA error (°)")
        >>> ax.get_xlabel(), ax.get_ylabel(), len(ax.lines)
        ('AoA error (°)', 'share of spectra', 5)
    """
    _check(ax)
    given, ax = ax, _new_axis(figsize=(6.4, 4.2)) if ax is None else ax
    named = scores if isinstance(scores, Mapping) else {"": scores}
    styles = line_styles(named)
    for name, values in named.items():
        values = check_array("scores", values, (None,), "scores of one method")
        if not len(values):
            raise ParameterError("scores", "expected at least one score, found none")
        style = {key: value for key, value in styles[name].items() if key != "marker"}
        label = f"{in_figure(shown_name(name))}: median {np.median(values):.3f}" if name else None
        ax.ecdf(values, label=label, **style)
    ax.set(xlabel=quantity, ylabel="share of spectra", ylim=(0, 1))
    ax.grid(alpha=0.3)
    if given is None and any(named):
        ax.legend()
    return ax


def _new_axis(**style: Any) -> Axes:
    """The axis of a new pyplot figure, which notebooks show."""
    from matplotlib import pyplot  # reports draw without it

    return pyplot.subplots(layout="constrained", **style)[1]


def _check(ax: Axes | None, grid: AngularGrid = AngularGrid(), difference: bool = False) -> None:
    require_instance(AngularGrid, grid=grid)
    require_flag(difference=difference)
    if ax is not None:
        require_instance(Axes, ax=ax)


def _one(spectrum: Float[np.ndarray, "90 360"]) -> Float[np.ndarray, "90 360"]:
    values = check_spectra("spectrum", spectrum)
    if values.ndim != 2:
        raise ParameterError("spectrum", f"expected one spectrum of {ROWS} x {COLUMNS}, found shape {values.shape}")
    return values


def _pixel_edges(grid: AngularGrid) -> tuple[Float[np.ndarray, " 361"], Float[np.ndarray, " 91"]]:
    """Azimuths and elevations of the pixels' edges, degrees: half a step before and after each direction of a grid."""
    azimuth = (np.arange(COLUMNS + 1) - 0.5) * grid.azimuth_step_deg
    return azimuth, grid.elevation_first_deg + (np.arange(ROWS + 1) - 0.5) * grid.elevation_step_deg


def _colours(difference: bool) -> dict[str, Any]:
    return {"cmap": DIFFERENCE, "vmin": -1, "vmax": 1} if difference else {"cmap": MAGNITUDE, "vmin": 0, "vmax": 1}


def _quantity(difference: bool) -> str:
    return "difference" if difference else "normalised magnitude"


def label_log_axis(axis: Axis) -> None:
    """Label the ticks of a logarithmic axis, when all is drawn; Matplotlib labels too few on a short one."""
    low, high = sorted(axis.get_view_interval())

    def ticks(locator: Locator) -> int:
        return sum(low <= tick <= high for tick in locator.tick_values(low, high))

    if ticks(LogLocator()) > 2:
        return
    subdivided = LogLocator(subs=(1, 2, 5))
    axis.set_major_locator(subdivided if ticks(subdivided) > 2 else MaxNLocator(4, min_n_ticks=2))
    axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.set_minor_formatter(NullFormatter())
