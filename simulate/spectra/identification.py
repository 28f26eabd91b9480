"""The array and the grid of a folder's spectra: stated in metadata.json, found by a fit, or assumed."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from jaxtyping import UInt8

from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.lags import EXAMINED, GRIDS, LagFit, fit_grids, fit_lags
from simulate.spectra.spectrum import evenly, spectrum_of

EXPLAINED = 0.6
"""Grey levels. An array explains a picture if it leaves a smaller root mean square error; rounding leaves 0.29."""

CLEARLY = 1.5
"""The best grid is accepted only if the second best leaves more than this many times its error."""

LARGEST_SIZE = 8
"""Most elements along a side of the square arrays to try where no 4 × 4 array explains the pictures."""

MOST_ELEMENTS = 144
"""Number of elements above which no fit is made, since it would take many seconds."""

METADATA_GRID = AngularGrid(elevation_first_deg=1.0)
"""Grid of folders whose metadata.json states an array but no grid: version 0.1 simulated them."""


@dataclass(frozen=True)
class Identification:
    """The array and the grid of a folder, and how they are known.

    Attributes:
        beamformer: the array and the grid.
        source: "metadata" if metadata.json states them, "fitted" if the pictures show them, otherwise "assumed". Then
            they are 4 × 4 elements half a wavelength apart, on NeRF²'s grid.
        residual: median of the root mean square errors that the array leaves on the examined pictures, grey levels of
            255; None if there are no pictures, or if the array is too large to fit.
    """

    beamformer: Beamformer = field(default_factory=Beamformer)
    source: Literal["metadata", "fitted", "assumed"] = "assumed"
    residual: float | None = None


def beamformer_of(metadata: dict[str, Any]) -> Beamformer | None:
    """The array and the grid that metadata.json states; None if it states no array.

    Args:
        metadata: content of metadata.json, from ``read_metadata_file``.
    """
    if "array" not in metadata:
        return None
    grid = AngularGrid(**metadata["grid"]) if "grid" in metadata else METADATA_GRID
    return Beamformer(PlanarArray(**metadata["array"]), grid)


def identify(pictures: UInt8[np.ndarray, "K 90 360"], stated: Beamformer | None) -> Identification:
    """Take the array and the grid that metadata.json states, or find those of a 4 × 4 array by a fit to the pictures.

    Args:
        pictures: 8-bit pictures.
        stated: from ``beamformer_of``.
    """
    if not len(pictures):
        return Identification(stated or Beamformer(), "metadata" if stated else "assumed", None)
    spectra = spectrum_of(evenly(pictures, EXAMINED))
    if stated is not None:
        small = stated.array.elements <= MOST_ELEMENTS
        return Identification(stated, "metadata", fit_lags(spectra, stated).median_residual if small else None)
    best, second = fit_grids(spectra)
    if best.median_residual < EXPLAINED and second.median_residual > CLEARLY * best.median_residual:
        return Identification(best.beamformer, "fitted", best.median_residual)
    assumed = Beamformer()
    return Identification(assumed, "assumed", fit_lags(spectra, assumed).median_residual)


def larger_array(pictures: UInt8[np.ndarray, "K 90 360"]) -> LagFit | None:
    """The smallest square array larger than 4 × 4 that explains the pictures; None if there is none.

    Args:
        pictures: 8-bit pictures.
    """
    spectra = spectrum_of(evenly(pictures, EXAMINED))
    # Smallest first, since a larger array with a smaller spacing explains the pictures of a smaller one, too.
    fits = (fit_grids(spectra, size, size, GRIDS[:2])[0] for size in range(5, LARGEST_SIZE + 1))
    return next((fit for fit in fits if fit.median_residual < EXPLAINED), None)
