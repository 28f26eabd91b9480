"""How many more spectra a region needs for a score."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from learn.data.expected_score import Expected, Spacing, is_as_measured, score_curve
from scenes.files.errors import ParameterError, require_within
from scenes.scene.antennas import Gateway
from simulate.spectra.array import Array, PlanarArray


@dataclass(frozen=True)
class Needed:
    """Spectra that a score needs.

    Example:
        >>> print(Needed(120, Spacing(160, "volume", 20.0), Expected(0.91, 0.95, 0.97)).sentence())
        120 more spectra, 160 in all, promise a median SSIM of about 0.95 (0.91 to 0.97) from helmholtz: mean spacing...
    """

    more: int  # number of spectra beside the known ones
    spacing: Spacing  # of the known and the further positions together
    expected: Expected  # the score to expect from all of them

    def sentence(self) -> str:
        """The number and what it promises, in words."""
        low, middle, high = self.expected
        return (
            f"{self.more} more spectra, {self.spacing.known} in all, promise a median SSIM of about {middle:.2f} "
            f"({low:.2f} to {high:.2f}) from helmholtz: {self.spacing.sentence()}"
        )


def spectra_needed(
    target: float,
    region: Float[np.ndarray, "N 3"],
    known: Float[np.ndarray, "n 3"],
    wavelength: float,
    arrays: Iterable[Gateway | Array],
) -> Needed:
    """How many more spectra the median SSIM of ``helmholtz`` needs to reach a target.

    The numbers are those of positions drawn uniformly.
    """
    for array in arrays:
        planar = isinstance(array, PlanarArray) or (isinstance(array, Gateway) and array.elements is None)
        if not planar or not is_as_measured(array.rows, array.columns, array.spacing):  # type: ignore[union-attr]
            found = array.in_words if isinstance(array, Array) else array.array_in_words
            raise ParameterError(
                "target",
                f"expected an array of 4 × 4 elements half a wavelength apart, as the curve has it, found {found}",
            )
    whole, before = Spacing.between(region, wavelength), Spacing.between(known, wavelength)
    if whole is None:
        raise ParameterError("target", "expected ten positions or more that are half a wavelength apart, found fewer")
    if "path" in (whole.shape, before and before.shape):
        raise ParameterError("target", "expected positions that fill a region, as the curve has them, found a path")
    curve = score_curve(whole.shape)
    least, most = (float(each) for each in np.round(curve.middle[[0, -1]], 2))
    require_within(least, most, "a median SSIM that the curve of measured rooms has,", target=target)
    total = math.ceil(curve.density_for(target) * whole.size)
    if total <= len(known):
        already = f"{curve.at(len(known) / whole.size).middle:.2f}, which {len(known)} known spectra promise already"
        raise ParameterError("target", f"expected a score above {already}, found {target:g}")
    spacing = Spacing(total, whole.shape, whole.size)
    return Needed(total - len(known), spacing, curve.at(spacing.density))
