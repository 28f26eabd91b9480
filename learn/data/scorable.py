"""Which spectra can be scored: those of three elements or more that differ from direction to direction."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from scenes.files.errors import InputError
from scenes.files.plain_text import say
from simulate.dataset.dataset import Dataset
from simulate.spectra.array import LEAST_ELEMENTS, Array, PlanarArray, too_few_elements


def require_scorable(array: Array, place: str) -> None:
    """Refuse arrays of one or two elements, whose spectra every method predicts equally well."""
    why = too_few_elements(array)
    if why is not None:
        found = f"{array.rows} × {array.columns}" if isinstance(array, PlanarArray) else array.in_words
        raise InputError(
            f"{place}: expected an array of at least {LEAST_ELEMENTS} elements to score spectra, found {found}: {why}; "
            "train and predict work all the same, and compare --over-band scores responses over a band"
        )


def varies(
    spectra: UInt8[np.ndarray, "K 90 360"] | Float[np.ndarray, "K 90 360"],
) -> Bool[np.ndarray, " K"]:
    """Which spectra are not constant. A constant one, such as a black picture, shows no direction.

    >>> varies(np.stack([np.zeros((90, 360)), np.eye(90, 360)])).tolist()
    [False, True]
    """
    return np.ptp(spectra, axis=(1, 2)) > 0


def scorable(dataset: Dataset, test: Int[np.ndarray, " n"]) -> Int[np.ndarray, " K"]:
    """The test spectra that can be scored. How many cannot is said on stderr."""
    require_scorable(dataset.array, str(dataset.folder))
    told = varies(dataset.pictures[test])
    require_some(told, str(dataset.folder))
    return test[told]


def require_some(told: Bool[np.ndarray, " K"], place: str) -> None:
    """Say how many spectra are constant and therefore not scored."""
    if not told.any():
        raise InputError(f"{place}: expected test spectra that show a direction, found {len(told)} constant ones")
    if not told.all():
        say(
            f"{place}: {int((~told).sum())} of {len(told)} test spectra are constant (black pictures, for example), "
            "show no direction, and are left out of every score"
        )
