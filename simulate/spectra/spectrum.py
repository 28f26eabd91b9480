"""A spatial spectrum as a picture: min–max normalisation and 8 bits. Also an even choice of a few values of many."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from jaxtyping import Float, Shaped, UInt8

from scenes.files.errors import ParameterError, shown
from simulate.spectra.angular_grid import COLUMNS, ROWS

LARGEST_GREY = 255  # Grey level of an 8-bit picture that stands for the value 1

PictureScale = Literal["magnitude", "power", "decibels"]
"""What the grey levels of a picture stand for: the magnitude of a spectrum, its power, or its power in decibels."""

SCALES: tuple[PictureScale, ...] = get_args(PictureScale)


def normalise(spectrum: Float[np.ndarray, "*batch 90 360"]) -> Float[np.ndarray, "*batch 90 360"]:
    """Min–max normalise each spectrum to 0…1, as in NeRF² pictures; a constant spectrum becomes zero."""
    low = spectrum.min(axis=(-2, -1), keepdims=True)
    span = spectrum.max(axis=(-2, -1), keepdims=True) - low
    return (spectrum - low) / np.where(span > 0, span, 1)


def picture(spectrum: Float[np.ndarray, "*batch 90 360"]) -> UInt8[np.ndarray, "*batch 90 360"]:
    """The 8-bit grey NeRF² picture of a magnitude spectrum."""
    return grey_levels(normalise(spectrum))


def grey_levels(spectrum: Float[np.ndarray, "*batch 90 360"]) -> UInt8[np.ndarray, "*batch 90 360"]:
    return np.round(np.clip(spectrum, 0, 1) * LARGEST_GREY).astype(np.uint8)


def spectrum_of(picture: UInt8[np.ndarray, "*batch 90 360"]) -> Float[np.ndarray, "*batch 90 360"]:
    """The normalised spectrum of an 8-bit picture: picture / 255, float32."""
    return picture / np.float32(LARGEST_GREY)


def check_spectra(parameter: str, spectra: Float[np.ndarray, "*batch 90 360"]) -> Float[np.ndarray, "*batch 90 360"]:
    if np.ma.isMaskedArray(spectra):
        raise ParameterError(parameter, f"expected spectra of {ROWS} x {COLUMNS}, found a masked array")
    try:
        spectra = np.asarray(spectra)
    except ValueError:  # rows of different lengths
        raise ParameterError(parameter, f"expected spectra of {ROWS} x {COLUMNS}, found {shown(spectra)}") from None
    if spectra.shape[-2:] != (ROWS, COLUMNS):
        raise ParameterError(parameter, f"expected spectra of {ROWS} x {COLUMNS}, found shape {spectra.shape}")
    if not np.issubdtype(spectra.dtype, np.floating):
        raise ParameterError(parameter, f"expected numbers from 0 to 1 (grey levels / 255), found {spectra.dtype}")
    return spectra


def check_stack(parameter: str, spectra: Float[np.ndarray, "K 90 360"]) -> Float[np.ndarray, "K 90 360"]:
    """Check spectra that a user gave, as ``check_spectra``, which must be a stack of finite ones."""
    stack = check_spectra(parameter, spectra)
    if stack.ndim != 3 or not len(stack):
        raise ParameterError(parameter, f"expected spectra [K, {ROWS}, {COLUMNS}], found shape {stack.shape}")
    if not np.isfinite(stack).all():
        raise ParameterError(parameter, "expected finite numbers from 0 to 1, found others")
    return stack


def check_pictures(
    parameter: str, pictures: UInt8[np.ndarray, "K 90 360"] | Float[np.ndarray, "K 90 360"]
) -> UInt8[np.ndarray, "K 90 360"] | Float[np.ndarray, "K 90 360"]:
    """Check a stack of pictures, grey levels 0…255, or of spectra, 0…1."""
    if not (isinstance(pictures, np.ndarray) and pictures.dtype == np.uint8) or np.ma.isMaskedArray(pictures):
        return check_stack(parameter, pictures)
    if pictures.ndim != 3 or pictures.shape[1:] != (ROWS, COLUMNS) or not len(pictures):
        raise ParameterError(parameter, f"expected pictures [K, {ROWS}, {COLUMNS}], found shape {pictures.shape}")
    return pictures


def evenly(values: Shaped[np.ndarray, "n *shape"], most: int) -> Shaped[np.ndarray, "m *shape"]:
    """At most ``most`` of the values, spread evenly over all of them."""
    return values[np.unique(np.linspace(0, len(values) - 1, min(most, len(values))).astype(int))]


def magnitudes(
    spectra: Float[np.ndarray, "K 90 360"], scale: PictureScale, decibels: Float[np.ndarray, " K"] | None = None
) -> Float[np.ndarray, "K 90 360"]:
    """Turn pictures of a scale into normalised magnitudes."""
    if scale == "magnitude":
        return spectra
    if scale == "power":
        return np.sqrt(spectra)
    assert decibels is not None
    return normalise(10 ** ((spectra - 1) * decibels[:, None, None] / 20))
