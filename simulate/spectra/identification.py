"""Which array and grid a folder's spectra were made with: stated by metadata.json, found by a fit, or assumed."""

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
"""Grey levels; an array that leaves less (root mean square) explains a picture, whose rounding alone leaves 0.29."""

CLEARLY = 1.5
"""A grid is only told from another one if the other leaves so many times more."""

LARGEST_SIZE = 8
"""Square arrays of up to so many elements along each side are tried where no 4 × 4 array explains the pictures."""

MOST_ELEMENTS = 144
"""Fits of larger arrays would take many seconds."""

METADATA_GRID = AngularGrid(elevation_first_deg=1.0)
"""Grid of folders whose metadata.json names none: those that version 0.1 simulated."""


@dataclass(frozen=True)
class Identification:
    """The array and the grid of a folder, and how they are known.

    Attributes:
        beamformer: the array and the grid.
        source: "metadata": metadata.json states them; "fitted": the pictures show them; "assumed": the pictures do
            not, and these are NeRF²'s, half a wavelength apart.
        residual: what the array leaves unexplained of the examined pictures, the median of their root mean square
            errors, grey levels of 255; None: there are no pictures, or the array is too large to fit.
    """

    beamformer: Beamformer = field(default_factory=Beamformer)
    source: Literal["metadata", "fitted", "assumed"] = "assumed"
    residual: float | None = None


def beamformer_of(metadata: dict[str, Any]) -> Beamformer | None:
    """The array and the grid that metadata.json states; None: it names no array.

    Args:
        metadata: content of metadata.json, from ``read_metadata_file``.
    """
    if "array" not in metadata:
        return None
    grid = AngularGrid(**metadata["grid"]) if "grid" in metadata else METADATA_GRID
    return Beamformer(PlanarArray(**metadata["array"]), grid)


def identify(pictures: UInt8[np.ndarray, "K 90 360"], stated: Beamformer | None) -> Identification:
    """Take the array and the grid that metadata.json states, or find those of a 4 × 4 array from the pictures.

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
    """The smallest square array that explains pictures that no 4 × 4 array can have measured; None: none found.

    Args:
        pictures: 8-bit pictures.
    """
    spectra = spectrum_of(evenly(pictures, EXAMINED))
    # Upwards: a larger array with a smaller spacing explains the pictures of a smaller one, too.
    fits = (fit_grids(spectra, size, size, GRIDS[:2])[0] for size in range(5, LARGEST_SIZE + 1))
    return next((fit for fit in fits if fit.median_residual < EXPLAINED), None)
