"""Find an array that explains pictures that no 4 × 4 array explains as magnitudes.

The search takes seconds, so only ``check`` and ``convert`` make it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from operator import itemgetter

import numpy as np
from jaxtyping import Float, UInt8
from scipy.optimize import minimize_scalar
from threadpoolctl import threadpool_limits

from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.array import Array, PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.element_array import require_planar
from simulate.spectra.identification import CLEARLY, EXPLAINED, can_fit, examined, rounding, with_fewest_elements
from simulate.spectra.lags import GRIDS, SPACING_DIGITS, SPACING_STEP, SPACINGS
from simulate.spectra.picture_scale import PictureScale, median_residual
from simulate.spectra.spectrum import evenly

SQUARES = [(side, side) for side in range(2, 9)]
LINES_ALONG_X = [(1, length) for length in range(2, 17)]
LINES_ALONG_Y = [(length, 1) for length in range(2, 17)]
"""Rows and columns of the arrays to try. Others are found as parts of the squares."""

SCALES: tuple[PictureScale, ...] = ("magnitude", "power", "decibels")

END_TO_END = (
    AngularGrid(90.0, -1.0, 360 / 359),
    AngularGrid(90.0, -90 / 89, 360 / 359),
    AngularGrid(0.0, 1.0, 360 / 359),
    AngularGrid(0.0, 90 / 89, 360 / 359),
    AngularGrid(0.0, 90 / 89),
    AngularGrid(90.0, -90 / 89),
)
"""Grids whose last column repeats the first, or whose rows reach both the horizon and boresight, as
``numpy.linspace(-180, 180, 360)`` and ``numpy.linspace(0, 90, 90)`` make them."""

COARSELY = 10.0
"""Grey levels. Spacings that leave more than this are not refined. A spacing 0.01 wavelengths off leaves about 2."""

FEW = 4
"""Number of spectra from which candidates are found."""

Coarse = dict[PictureScale, list[tuple[float, Beamformer]]]
"""For each scale, what the best spacing on each grid leaves, and this array and grid; the best grid first."""


@dataclass(frozen=True)
class Explanation:
    """An array, a grid and a scale that explain pictures."""

    beamformer: Beamformer  # the array and the grid
    scale: PictureScale  # what the grey levels stand for
    residual: float  # median of the root mean square errors that it leaves, grey levels of 255


@threadpool_limits.wrap(1)  # several threads are much slower on such small matrices
def explain(
    pictures: UInt8[np.ndarray, "K 90 360"], array: Array | None = None, grid: AngularGrid | None = None
) -> Explanation | None:
    """Find the smallest array that explains pictures, and what their grey levels stand for.

    Smallest first, since a larger array with a smaller spacing explains the pictures of a smaller one, too, and the
    power of an array looks like the magnitude of one almost twice as large.
    """
    spectra = examined(pictures)
    if not len(spectra):
        return None
    grids = _likely_grids(spectra) if grid is None else (grid,)
    if array is not None:
        return _of_known(spectra, array, grids)
    few = evenly(spectra, FEW)
    if grid is None:
        wider = _coarsely(few, 4, 4, (*grids, *_end_to_end(grids)), ("magnitude",))
        found = _refined(spectra, wider["magnitude"], "magnitude")
        if found is not None:
            return found
    coarse: dict[tuple[int, int], Coarse] = {}
    sizes = []
    for family in (SQUARES, LINES_ALONG_X, LINES_ALONG_Y):
        coarse[family[-1]] = _coarsely(few, *family[-1], grids, SCALES)
        # If the largest array explains them nowhere, no smaller one of this family does, since it has its lags.
        possible = [each for each in SCALES if coarse[family[-1]][each][0][0] < COARSELY]
        sizes += [(size, following, possible) for size, following in zip(family, [*family[1:], None], strict=True)]
    for size, following, scales in sorted(sizes, key=lambda each: math.prod(each[0])):
        for scale in scales:
            for each in (size, following):
                if each is not None and each not in coarse:
                    coarse[each] = _coarsely(few, *each, grids, scales)
            found = _refined(spectra, coarse[size][scale], scale)
            if found is None:
                continue
            larger = None if following is None else _refined(spectra, coarse[following][scale], scale)
            if larger is not None and found.residual > CLEARLY * larger.residual:
                return larger
            return found
    return None


def _likely_grids(spectra: Float[np.ndarray, "K 90 360"]) -> tuple[AngularGrid, ...]:
    """Those of ``GRIDS`` whose boresight is where the spectra change least along azimuth."""
    spread = spectra.std(axis=2).mean(axis=0)
    upside_down = spread[0] < spread[-1]
    return tuple(each for each in GRIDS if (each.elevation_step_deg < 0) == upside_down)


def _end_to_end(grids: tuple[AngularGrid, ...]) -> tuple[AngularGrid, ...]:
    """Those of ``END_TO_END`` whose rows rise or fall as those of the grids."""
    upwards = grids[0].elevation_step_deg > 0
    return tuple(each for each in END_TO_END if (each.elevation_step_deg > 0) == upwards)


def _coarsely(
    spectra: Float[np.ndarray, "K 90 360"],
    rows: int,
    columns: int,
    grids: tuple[AngularGrid, ...],
    scales: Sequence[PictureScale],
) -> Coarse:
    """The best spacing on each grid with what it leaves, for each scale; the best grid first."""
    left: dict[PictureScale, list[tuple[float, Beamformer]]] = {scale: [] for scale in scales}
    for grid in grids:
        tried = [Beamformer(PlanarArray(rows, columns, float(spacing)), grid) for spacing in SPACINGS]
        residuals = [[median_residual(spectra, each, scale, steps=0) for scale in scales] for each in tried]
        for scale, of_spacings in zip(scales, zip(*residuals, strict=True), strict=True):
            best = int(np.argmin(of_spacings))
            left[scale].append((of_spacings[best], tried[best]))
    return {scale: sorted(fits, key=itemgetter(0)) for scale, fits in left.items()}


def _refined(
    spectra: Float[np.ndarray, "K 90 360"], coarse: list[tuple[float, Beamformer]], scale: PictureScale
) -> Explanation | None:
    """The explanation with a spacing near one of the best two, without needless elements, if there is one."""
    few = evenly(spectra, FEW)
    fits = []
    for _, near in [fit for fit in coarse[:2] if fit[0] < COARSELY]:
        spacing = minimize_scalar(
            lambda spacing, near=near: median_residual(few, _spaced(near, spacing), scale),
            bounds=(_spacing(near) - SPACING_STEP, _spacing(near) + SPACING_STEP),
            method="bounded",
            options={"xatol": 1e-4},
        ).x
        beamformer = _spaced(near, round(spacing, SPACING_DIGITS))
        fits.append((median_residual(spectra, beamformer, scale), beamformer))
    residual, beamformer = min(fits, key=itemgetter(0), default=(np.inf, Beamformer()))
    if residual >= rounding(spectra) * EXPLAINED:
        return None
    beamformer = with_fewest_elements(spectra, beamformer, scale)
    return Explanation(beamformer, scale, median_residual(spectra, beamformer, scale))


def _of_known(
    spectra: Float[np.ndarray, "K 90 360"], array: Array, grids: tuple[AngularGrid, ...]
) -> Explanation | None:
    """The first scale for which a known array explains the spectra on one of the grids."""
    if not can_fit(array):
        return None
    for scale in SCALES:
        fits = [(median_residual(spectra, Beamformer(array, grid), scale), grid) for grid in grids]
        residual, grid = min(fits, key=itemgetter(0))
        if residual < rounding(spectra) * EXPLAINED:
            return Explanation(Beamformer(array, grid), scale, residual)
    return None


def _spaced(beamformer: Beamformer, spacing: float) -> Beamformer:
    array = require_planar(beamformer.array, "a search for the spacing")
    return replace(beamformer, array=replace(array, spacing=float(spacing)))


def _spacing(beamformer: Beamformer) -> float:
    return require_planar(beamformer.array, "a search for the spacing").spacing
