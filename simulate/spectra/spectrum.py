"""A spatial spectrum as a picture: min–max normalisation and 8 bits."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, UInt8

LARGEST_GREY = 255
"""Grey level of an 8-bit picture that stands for 1."""


def normalise(spectrum: Float[np.ndarray, "*batch 90 360"]) -> Float[np.ndarray, "*batch 90 360"]:
    """Min–max normalise each spectrum to 0…1, as NeRF² pictures are; a constant spectrum becomes zero.

    All spectra of datasets are normalised here. Models are trained and scored on spectra normalised in this way.

    Args:
        spectrum: magnitude, any unit.

    Returns:
        The normalised spectrum.
    """
    low = spectrum.min(axis=(-2, -1), keepdims=True)
    span = spectrum.max(axis=(-2, -1), keepdims=True) - low
    return (spectrum - low) / np.where(span > 0, span, 1)


def picture(spectrum: Float[np.ndarray, "*batch 90 360"]) -> UInt8[np.ndarray, "*batch 90 360"]:
    """8-bit grey NeRF² picture of a magnitude spectrum.

    Args:
        spectrum: magnitude, any unit; it is normalised first.

    Returns:
        Grey levels, rows and columns as in the spectrum.
    """
    return np.round(normalise(spectrum) * LARGEST_GREY).astype(np.uint8)


def spectrum_of(picture: UInt8[np.ndarray, "*batch 90 360"]) -> Float[np.ndarray, "*batch 90 360"]:
    """The normalised spectrum that an 8-bit picture holds: picture / 255, float32.

    Args:
        picture: 8-bit grey levels.

    Returns:
        Numbers from 0 to 1.

    >>> spectrum_of(np.array([[0, 255]], np.uint8)).tolist()
    [[0.0, 1.0]]
    """
    return picture / np.float32(LARGEST_GREY)
