"""How far responses over a band are off at known positions that are predicted from the others."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from jaxtyping import Complex, Float, Int
from torch import Tensor

from learn.models.kriging.deviation_curve import normal_curve, rising_curve, size_of
from simulate.spectra.spectrum import evenly

LEFT_OUT = 48
"""Largest number of known positions, evenly spread, that are predicted from the others."""

RADII = (0.0, 0.25, 0.5, 1.0, 2.0, 4.0)
"""Known positions nearer than each of these radii are left out with them, wavelengths."""

LEAST_LEFT = 8
"""A prediction from fewer positions than this tells nothing, unless no more are known."""

LEAST_KNOWN = 3
"""With fewer known positions, the covariance tells the deviations."""

FOLDS, FOLDED = 5, 300
"""If few positions are known, a covariance fitted to all of them predicts them too well. They are then divided into
parts, and each part is predicted with a covariance fitted without it. There are FOLDED // n parts for n known
positions, at most FOLDS; if these are fewer than 2, the covariance is not fitted again."""

FITTED = "shares", "length", "drift", "nugget", "noises"
"""What the fit of the covariance sets."""


class Field(Protocol):
    """What is needed of a field of responses over a band; ``BandField`` describes each."""

    places: Tensor
    wavelength: Tensor
    level: Tensor
    noise: float

    def fit_covariance(self, used: Int[np.ndarray, " n"]) -> None: ...

    def with_variance(
        self, positions: Float[np.ndarray, "K 3"], left_out: Int[np.ndarray, " K"] | None, radius: float
    ) -> tuple[Complex[np.ndarray, "K elements subcarriers"], Float[np.ndarray, " K"]]: ...


def left_out_curve(
    field: Field, responses: Complex[np.ndarray, "n elements subcarriers"]
) -> tuple[Float[np.ndarray, " k"], Float[np.ndarray, " k"]]:
    """The deviations of a field over its kriging variance, as for ``rising_curve``.

    Known positions are predicted from others near and far. So the curve is right between them and beside them, however
    near to one another they are.
    """
    count = len(responses)
    if count < LEAST_KNOWN:
        return normal_curve(field.noise)
    members, folds, told = evenly(np.arange(count), LEFT_OUT), min(FOLDS, FOLDED // count), []
    fitted = [getattr(field, name) for name in FITTED]
    for fold in range(folds if folds > 1 else 0):
        field.fit_covariance(np.flatnonzero(np.arange(count) % folds != fold))
        part = members[members % folds == fold]
        if len(part):
            told.append(_left_out(field, part, responses))
    for name, each in zip(FITTED, fitted, strict=True):
        setattr(field, name, each)
    told = told or [_left_out(field, members, responses)]
    variance, errors = (np.concatenate(each) for each in zip(*told, strict=True))
    return rising_curve(variance, errors, np.sqrt(field.noise / 2), float(size_of(responses.view(float).ravel())))


def _left_out(
    field: Field, members: Int[np.ndarray, " n"], responses: Complex[np.ndarray, "N elements subcarriers"]
) -> tuple[Float[np.ndarray, " m"], Float[np.ndarray, "m P"]]:
    """Variances and errors (real and imaginary parts) of known positions predicted from those beyond each radius."""
    places, variances, errors = field.places.numpy(), [], []
    distance = np.linalg.norm(places[members][:, None] - places, axis=2)
    distance[np.arange(len(members)), members] = -1
    for radius in np.array(RADII) * float(field.wavelength):
        some = members[np.count_nonzero(distance >= radius, axis=1) >= min(LEAST_LEFT, len(places) - 1)]
        if len(some):
            found, variance = field.with_variance(places[some], some, radius)
            error = found / float(field.level) - responses[some]
            variances.append(variance)
            errors.append(error.reshape(len(error), -1).view(float))
    return np.concatenate(variances), np.concatenate(errors)
