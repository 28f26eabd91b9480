"""Plots of spectra and of distributions of scores on a Matplotlib axis, for reports and for users.

Without a given axis, each function draws a new figure, complete with colour bar or legend. On a given axis these are
left to the caller, who knows what else is in the figure.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.patheffects import withStroke
from matplotlib.projections.polar import PolarAxes
from matplotlib.ticker import Locator, LogLocator, MaxNLocator, NullFormatter, StrMethodFormatter

from scenes.files.errors import ParameterError, require_flag, require_instance
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
    """Plot a spectrum over azimuth and elevation, or on a polar axis as the gateway sees it.

    The horizon is at the bottom. Azimuth is periodic: on a grid of a full turn, azimuth 0° is drawn at both ends. On a
    polar axis, azimuth is the angle, and boresight is in the centre: the radius is 90 minus the elevation in degrees.

    Args:
        spectrum: magnitude [90, 360], 0…1; with ``difference`` the difference of two spectra, −1…1.
        ax: the axis to draw on, which may be polar, such as ``plt.subplot(projection="polar")``.
            ``ax.figure.colorbar(ax.images[0])``, of a polar one ``ax.collections[0]``, adds a colour bar. None: a new
            figure with one.
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
    values = check_spectra("spectrum", spectrum)
    if values.ndim != 2:
        raise ParameterError("spectrum", f"expected one spectrum of {ROWS} x {COLUMNS}, found shape {values.shape}")
    require_instance(AngularGrid, grid=grid)
    require_flag(difference=difference)
    if ax is not None:
        require_instance(Axes, ax=ax)
    given, ax = ax, _new_axis(figsize=(6.4, 2.6)) if ax is None else ax
    colours: Any = {"cmap": MAGNITUDE, "vmin": 0, "vmax": 1}
    if difference:
        colours = {"cmap": DIFFERENCE, "vmin": -1, "vmax": 1}
    # Half a step before and after each direction of the grid: the pixels' edges.
    azimuth = (np.arange(COLUMNS + 1) - 0.5) * grid.azimuth_step_deg
    elevation = grid.elevation_first_deg + (np.arange(ROWS + 1) - 0.5) * grid.elevation_step_deg
    if isinstance(ax, PolarAxes):
        radius = (90 - elevation).clip(0)
        ax.pcolormesh(np.radians(azimuth), radius, values, rasterized=True, **colours)
        ax.set_xticks(np.radians([0, 90, 180, 270]))
        ax.set_yticks([30, 60, 90], ["60°", "30°", ""], path_effects=[withStroke(linewidth=2, foreground="white")])
        ax.set(xlabel="azimuth around, elevation from the rim (0°) to the centre (90°)", ylim=(0, 90))
        ax.grid(alpha=0.3)
        return ax
    turn = COLUMNS * grid.azimuth_step_deg
    if np.isclose(turn, 360):
        values = np.column_stack([values, values[:, 0]])
        azimuth = np.append(azimuth, turn + 0.5 * grid.azimuth_step_deg)
    extent = (azimuth[0], azimuth[-1], elevation[0], elevation[-1])
    image = ax.imshow(values, origin="lower", extent=extent, aspect="auto", **colours)
    ax.set(xlabel="azimuth (°)", ylabel="elevation (°)", xticks=range(0, 361, 90), yticks=range(0, 91, 30))
    ax.set(xlim=(0, min(turn, 360)), ylim=extent[2:])
    if given is None:
        ax.figure.colorbar(image, ax=ax, label="difference" if difference else "normalised magnitude")
    return ax


def _new_axis(**style: Any) -> Axes:
    """The axis of a new pyplot figure, which notebooks show."""
    from matplotlib import pyplot  # reports draw without it

    return pyplot.subplots(layout="constrained", **style)[1]


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
