"""Find an array that explains pictures that no 4 × 4 array explains as magnitudes.

The search takes seconds, so only ``check`` and ``convert`` make it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, UInt8
from threadpoolctl import threadpool_limits

from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.array import Array
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.identification import (
    CLEARLY,
    EXPLAINED,
    GRIDS,
    Coarse,
    can_fit,
    coarsely,
    examined,
    fits_of,
    rounding,
    with_best_spacing,
    with_fewest_elements,
)
from simulate.spectra.lags import median_residual
from simulate.spectra.spectrum import SCALES, PictureScale, evenly

SQUARES = [(side, side) for side in range(2, 9)]
LINES_ALONG_X = [(1, length) for length in range(2, 17)]
LINES_ALONG_Y = [(length, 1) for length in range(2, 17)]
"""Rows and columns of the arrays that ``explain`` tries. Others are found as parts of the squares."""

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

FEW = 4  # Number of spectra from which ``explain`` finds candidates


@dataclass(frozen=True)
class Explanation:
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
    # The spectra change least along azimuth at the boresight, which tells which way up they are.
    spread = spectra.std(axis=2).mean(axis=0)
    likely = [each for each in (*GRIDS, *END_TO_END) if (each.elevation_step_deg < 0) == (spread[0] < spread[-1])]
    grids = [each for each in likely if each in GRIDS] if grid is None else [grid]
    if array is not None:
        return _of_known(spectra, array, grids)
    few = evenly(spectra, FEW)
    if grid is None:
        wider = coarsely(few, (4, 4), likely, ("magnitude",))
        found = _refined(spectra, wider["magnitude"], "magnitude")
        if found is not None:
            return found
    coarse: dict[tuple[int, int], Coarse] = {}
    sizes = []
    for family in (SQUARES, LINES_ALONG_X, LINES_ALONG_Y):
        coarse[family[-1]] = coarsely(few, family[-1], grids, SCALES)
        # If the largest array explains them nowhere, no smaller one of this family does, since it has its lags.
        possible = [each for each in SCALES if coarse[family[-1]][each][0][0] < COARSELY]
        sizes += [(size, following, possible) for size, following in zip(family, [*family[1:], None], strict=True)]
    for size, following, scales in sorted(sizes, key=lambda each: math.prod(each[0])):
        for scale in scales:
            for each in (size, following):
                if each is not None and each not in coarse:
                    coarse[each] = coarsely(few, each, grids, scales)
            found = _refined(spectra, coarse[size][scale], scale)
            if found is None:
                continue
            larger = None if following is None else _refined(spectra, coarse[following][scale], scale)
            if larger is not None and found.residual > CLEARLY * larger.residual:
                return larger
            return found
    return None


def _refined(
    spectra: Float[np.ndarray, "K 90 360"], coarse: list[tuple[float, Beamformer]], scale: PictureScale
) -> Explanation | None:
    """The explanation with a spacing near one of the best two, without needless elements, if there is one."""
    few = evenly(spectra, FEW)
    near = [with_best_spacing(few, each, scale) for left, each in coarse[:2] if left < COARSELY]
    fits = fits_of(spectra, near, scale)
    if not fits or fits[0][0] >= rounding(spectra) * EXPLAINED:
        return None
    beamformer = with_fewest_elements(spectra, fits[0][1], scale)
    return Explanation(beamformer, scale, median_residual(spectra, beamformer, scale))


def _of_known(spectra: Float[np.ndarray, "K 90 360"], array: Array, grids: Sequence[AngularGrid]) -> Explanation | None:
    """The first scale for which a known array explains the spectra on one of the grids."""
    if not can_fit(array):
        return None
    for scale in SCALES:
        residual, best = fits_of(spectra, [Beamformer(array, grid) for grid in grids], scale)[0]
        if residual < rounding(spectra) * EXPLAINED:
            return Explanation(best, scale, residual)
    return None
