"""The weight of the corrected scene in the twin's prediction; kriging of the known responses alone has the other part.

If very many spectra are known, kriging of them predicts the field better than any description of the place. The weight
is therefore the one that best predicts known spectra from the others (stacking [wolpert1992]).
"""

from __future__ import annotations

import numpy as np
import torch
from jaxtyping import Float, UInt8
from torch import Tensor

from learn.data.metrics import ssim_of_each
from learn.models.base import BeamformingLayer
from learn.models.kriging.kriged_field import KrigedField
from simulate.spectra.spectrum import evenly, spectrum_of

TRUSTS = (1.0, 0.75, 0.5, 0.25, 0.0)
"""Candidates for the weight of the corrected scene."""

LEAST_KNOWN, LEFT_OUT = 100, 64
"""Number of known spectra below which the weight is 1, and largest number of them that are predicted from others."""


def enough_known(count: int) -> bool:
    """Whether so many known spectra can tell the weight. With fewer it is 1."""
    return count >= LEAST_KNOWN


def mixed(
    traced: Float[Tensor, "B elements 2"],
    rest: Float[Tensor, "B elements 2"],
    whole: Float[Tensor, "B elements 2"],
    trust: float,
    powers: tuple[Float[Tensor, ""], Float[Tensor, ""]],
) -> Float[Tensor, "B elements 2"]:
    """w (f + e) + (1 − w) a."""
    of_rest, of_whole = powers
    return trust * (traced + of_rest.sqrt() * rest) + (1 - trust) * of_whole.sqrt() * whole


def best_trust(
    traced: Float[Tensor, "n elements 2"],
    fields: tuple[KrigedField, KrigedField],
    powers: tuple[Float[Tensor, ""], Float[Tensor, ""]],
    pictures: UInt8[np.ndarray, "n 90 360"],
    beamforming: BeamformingLayer,
) -> float:
    """The w that best predicts known spectra from the others; the largest one if several are equally good.

    The left-out spectrum was also used to find θ. This hardly matters, since θ is a few numbers and the spectra are
    many.
    """
    if not enough_known(len(traced)):
        return 1.0
    left_out = torch.from_numpy(evenly(np.arange(len(traced)), LEFT_OUT))
    spectra = spectrum_of(pictures[left_out.numpy()])
    with torch.inference_mode():
        rest, whole = (
            field.interpolated(field.places[left_out], left_out)[0].unflatten(-1, (-1, 2)) for field in fields
        )
        scores = {}
        for trust in TRUSTS:
            found = beamforming(mixed(traced[left_out], rest, whole, trust, powers)).numpy()
            scores[trust] = float(ssim_of_each(found, spectra).mean())
    return max(scores, key=lambda trust: scores[trust])
