"""The array and the grid of a folder's spectra: stated in metadata.json, found by a fit, or assumed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from operator import itemgetter
from typing import Any, Literal

import numpy as np
from jaxtyping import Float, UInt8
from scipy.optimize import minimize_scalar
from threadpoolctl import threadpool_limits

from simulate.spectra.angular_grid import COLUMNS, ROWS, AngularGrid
from simulate.spectra.array import Array, PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.element_array import ElementArray, array_kind, require_planar
from simulate.spectra.lags import EXAMINED, LagSpace, median_residual, too_many_lags
from simulate.spectra.spectrum import LARGEST_GREY, PictureScale, evenly, spectrum_of

SPACING_STEP = 0.02
SPACINGS = np.arange(0.30, 0.71, SPACING_STEP)  # Spacings to try first, wavelengths

SPACING_DIGITS = 3
"""Decimals to which a fitted spacing is rounded. A few pictures do not determine more."""

GRIDS = AngularGrid(0.0), AngularGrid(1.0), AngularGrid(89.0, -1.0), AngularGrid(90.0, -1.0)
"""Grids to try: rows from 0° up, as in NeRF²'s measured pictures; rows from 1° up, as NeRF²'s own generator writes
them; and both upside down."""

EXPLAINED = 0.6
"""Grey levels. An array explains a picture of 8 bits if it leaves a smaller root mean square error; rounding leaves
0.29. For fewer bits it may be larger (``rounding``)."""

DOUBTFUL = 3.0  # Grey levels. An array that leaves more did not measure the pictures.

CLEARLY = 1.5
"""The best grid is accepted only if the second best leaves more than this many times its error."""

LEAST_LEVELS = 32
"""Different grey levels of a picture that can contradict an array. Every array explains a picture of two levels."""

MOST_ELEMENTS = 144  # Number of elements above which no fit is made, since it would take many seconds

MOST_FUNCTIONS = 600
"""Most lag functions for which a fit is made, likewise. A planar array of ``MOST_ELEMENTS`` elements has 529."""

VISIBLE = 1e-3
"""Relative size below which a combination of lag functions is lost in the rounding of pictures to 8 bits."""

Source = Literal["metadata", "fitted", "assumed"]

Fit = tuple[float, Beamformer]  # What an array with a grid leaves of spectra, grey levels, and this array and grid

Coarse = dict[PictureScale, list[Fit]]
"""For each scale, the fit of the best spacing on each grid; the best grid first."""


@dataclass(frozen=True)
class Identification:
    """The array and the grid of a folder, and how they are known."""

    beamformer: Beamformer = field(default_factory=Beamformer)  # if assumed, 4 × 4 elements half a wavelength apart
    source: Source = "assumed"  # "metadata" if metadata.json states the array, "fitted" if the pictures show it
    grid_source: Source = "assumed"  # the same for the grid. An assumed one is that of NeRF²'s measured pictures.
    # median of the root mean square errors that the array leaves on the examined pictures, grey levels of 255; None if
    # no picture has enough grey levels to be examined, or if the array is too large to fit
    residual: float | None = None


def stated_array(metadata: dict[str, Any]) -> Array | None:
    """The array that metadata.json states; None if it states none."""
    if "array" not in metadata:
        return None
    if array_kind(metadata["array"]) is ElementArray:
        return ElementArray(metadata["array"]["positions_m"])
    return PlanarArray(**metadata["array"])


def stated_grid(metadata: dict[str, Any]) -> AngularGrid | None:
    """The grid that metadata.json states; None if it states none."""
    return AngularGrid(**metadata["grid"]) if "grid" in metadata else None


def can_fit(array: Array) -> bool:
    """Whether pictures are fitted with an array; for one of many elements or lags it would take too long."""
    return array.elements <= MOST_ELEMENTS and too_many_lags(array, MOST_FUNCTIONS) is None


def tells_little(beamformer: Beamformer) -> bool:
    """Whether other arrays explain pictures as well: under half of its lag functions exceed the rounding."""
    sizes = np.linalg.svd(LagSpace.of(beamformer).triangular, compute_uv=False)
    return bool((sizes > VISIBLE * sizes[0]).mean() < 0.5)


def examined(pictures: UInt8[np.ndarray, "K 90 360"]) -> Float[np.ndarray, "n 90 360"]:
    """The spectra of at most ``EXAMINED`` pictures, of those that have ``LEAST_LEVELS`` different grey levels."""
    wide = np.flatnonzero(np.ptp(pictures.reshape(len(pictures), -1), axis=1) >= LEAST_LEVELS - 1)
    chosen = [pictures[index] for index in evenly(wide, EXAMINED)]
    telling = [each for each in chosen if level_count(each) >= LEAST_LEVELS]
    return spectrum_of(np.stack(telling)) if telling else np.zeros((0, ROWS, COLUMNS), np.float32)


def level_count(picture: UInt8[np.ndarray, "90 360"]) -> int:
    return int(np.count_nonzero(np.bincount(picture.ravel(), minlength=256)))


def rounding(spectra: Float[np.ndarray, "K 90 360"]) -> float:
    """Median step between the levels that spectra have, grey levels of 255: 1 for 8 bits, 4 for 6 bits."""
    pictures = np.round(LARGEST_GREY * spectra).astype(np.uint8)
    return max(1.0, float(np.median([np.ptp(each) / max(level_count(each) - 1, 1) for each in pictures])))


def identify(
    pictures: UInt8[np.ndarray, "K 90 360"], array: Array | None = None, grid: AngularGrid | None = None
) -> Identification:
    """Take the array and the grid that metadata.json states, and fit the rest; an array among those of up to 4 × 4."""
    spectra = examined(pictures)
    stated = Beamformer(array or PlanarArray(), grid or AngularGrid())
    source: Source = "assumed" if array is None else "metadata"
    grid_source: Source = "assumed" if grid is None else "metadata"
    if not len(spectra) or not can_fit(stated.array):
        return Identification(stated, source, grid_source)
    if array is None or grid is None:
        grids = GRIDS if grid is None else (grid,)
        fits = fit_grids(spectra, grids) if array is None else fits_of(spectra, [Beamformer(array, g) for g in grids])
        (left, found), *others = fits
        if left < rounding(spectra) * EXPLAINED and all(other > CLEARLY * left for other, _ in others[:1]):
            if array is None:
                found, source = with_fewest_elements(spectra, found, "magnitude"), "fitted"
            grid_source = "fitted" if grid is None else "metadata"
            return Identification(found, source, grid_source, median_residual(spectra, found, "magnitude"))
    return Identification(stated, source, grid_source, median_residual(spectra, stated, "magnitude"))


def fits_of(
    spectra: Float[np.ndarray, "K 90 360"], tried: Sequence[Beamformer], scale: PictureScale = "magnitude"
) -> list[Fit]:
    """What each of some arrays with a grid leaves of spectra, and the array with the grid; the best one first."""
    return sorted(((median_residual(spectra, each, scale), each) for each in tried), key=itemgetter(0))


@threadpool_limits.wrap(1)  # several threads are much slower on such small matrices
def fit_grids(spectra: Float[np.ndarray, "K 90 360"], grids: Sequence[AngularGrid] = GRIDS) -> list[Fit]:
    """Fits of 4 × 4 elements with the best spacing on the two best of some grids; they take half a second."""
    coarse = coarsely(spectra, (4, 4), grids, ("magnitude",))["magnitude"]
    return fits_of(spectra, [with_best_spacing(spectra, near, "magnitude") for _, near in coarse[:2]])


def coarsely(
    spectra: Float[np.ndarray, "K 90 360"],
    shape: tuple[int, int],
    grids: Sequence[AngularGrid],
    scales: Sequence[PictureScale],
) -> Coarse:
    """The best spacing on each grid with what it leaves, for each scale; the best grid first."""
    left: Coarse = {scale: [] for scale in scales}
    for grid in grids:
        tried = [Beamformer(PlanarArray(*shape, float(spacing)), grid) for spacing in SPACINGS]
        residuals = [[median_residual(spectra, each, scale, steps=0) for scale in scales] for each in tried]
        for scale, of_spacings in zip(scales, zip(*residuals, strict=True), strict=True):
            best = int(np.argmin(of_spacings))
            left[scale].append((of_spacings[best], tried[best]))
    return {scale: sorted(fits, key=itemgetter(0)) for scale, fits in left.items()}


def with_best_spacing(spectra: Float[np.ndarray, "K 90 360"], near: Beamformer, scale: PictureScale) -> Beamformer:
    """A planar array with the spacing, near its own, that explains spectra best."""
    array = require_planar(near.array, "a search for the spacing")

    def spaced(spacing: float) -> Beamformer:
        return replace(near, array=replace(array, spacing=float(spacing)))

    spacing = minimize_scalar(
        lambda spacing: median_residual(spectra, spaced(spacing), scale),
        bounds=(array.spacing - SPACING_STEP, array.spacing + SPACING_STEP),
        method="bounded",
        options={"xatol": 1e-4},
    ).x
    return spaced(round(spacing, SPACING_DIGITS))


def with_fewest_elements(
    spectra: Float[np.ndarray, "K 90 360"], beamformer: Beamformer, scale: PictureScale
) -> Beamformer:
    """The part of an array with the fewest rows and columns that explains spectra as well as the whole."""
    array = require_planar(beamformer.array, "a search for smaller arrays")
    enough = min(rounding(spectra) * EXPLAINED, CLEARLY * median_residual(spectra, beamformer, scale))
    shapes = [(rows, columns) for rows in range(1, array.rows + 1) for columns in range(1, array.columns + 1)]
    for rows, columns in sorted(shapes[1:-1], key=math.prod):
        smaller = replace(beamformer, array=PlanarArray(rows, columns, array.spacing))
        if median_residual(spectra, smaller, scale) < enough:
            return smaller
    return beamformer
