"""Arrays of so few elements that their spectra tell nothing, or hardly anything, of directions."""

from __future__ import annotations

from simulate.spectra.array import Array

LEAST_ELEMENTS = 3
"""With fewer elements than this, scores of spectra mean nothing."""


def too_few_elements(array: Array) -> str | None:
    """What is wrong with the spectra of an array of one or two elements. None: the array has more.

    One element has the same magnitude in all directions, so that its normalised spectrum is zero everywhere. The
    spectrum of two elements is a single cosine, which nearly every prediction resembles.

    >>> from simulate.spectra.array import PlanarArray
    >>> too_few_elements(PlanarArray(1, 1))
    'the spectrum of a single element is the same at every position and in every direction'
    >>> too_few_elements(PlanarArray()) is None
    True
    """
    if array.elements >= LEAST_ELEMENTS:
        return None
    if array.elements == 1:
        return "the spectrum of a single element is the same at every position and in every direction"
    return "the spectra of two elements are single fringes, which all look alike"
