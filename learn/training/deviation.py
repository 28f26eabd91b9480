"""The standard deviation of a predicted spectrum's values: how far a prediction may be off.

A model is fitted to the training part. Its errors on the validation part then tell how far its predictions are off,
whatever the model (split conformal prediction [papadopoulos2002]). If the model computes a variance of its own, as
kriging does, predictions with a large variance get a larger deviation.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
from jaxtyping import Float
from msgspec import Meta, Struct

LEAST_VALIDATED = 10
"""Least number of validation spectra; fewer say too little about the errors."""

SHARE, NORMAL = 0.9, 1.6449
"""Share of the errors that lie within ``NORMAL`` standard deviations, as in a normal distribution."""

LEAST = 0.5 / 255
"""Half a grey level: pictures are rounded to whole ones."""

EVERY = 5
"""Only pixels of every so many rows and columns are compared; nearer ones have similar errors."""

SHARES = (0.0, 0.25, 0.5, 0.75, 0.95)
"""Candidates for the share of the mean squared error that grows with the model's own variance."""

MOST = 1000.0
"""Largest coefficient of a deviation."""
Coefficient = Annotated[float, Meta(ge=0, le=MOST)]


class Deviation(Struct, frozen=True):
    """The deviation ``σ(r)² = c² + g² u(r)``, with the model's relative variance u at the position r, if any.

    Attributes:
        constant: c, in the units of a spectrum 0…1.
        growth: g, in the same units.
        spectra: number of validation spectra to which c and g were fitted; 0 in runs of older versions: unknown.
    """

    constant: Coefficient
    growth: Coefficient
    spectra: Annotated[int, Meta(ge=0)] = 0

    def at(self, variance: Float[np.ndarray, " K"] | None, count: int) -> Float[np.ndarray, " K"]:
        """Standard deviation σ at K positions.

        Args:
            variance: u at the positions. None: the model computes none, and u is 0.
            count: K.

        >>> Deviation(0.03, 0.4).at(np.array([0.0, 0.01]), 2).tolist()
        [0.03, 0.05]
        """
        return np.sqrt(self.constant**2 + self.growth**2 * (np.zeros(count) if variance is None else variance))


def pixel_errors(
    prediction: Float[np.ndarray, "K 90 360"], truth: Float[np.ndarray, "K 90 360"]
) -> Float[np.ndarray, "K P"]:
    """True minus predicted values of every ``EVERY``th row and column.

    (The value in the dominant direction alone would say little, since it is nearly always 1 in normalised spectra.)

    Args:
        prediction: predicted spectra, 0…1.
        truth: true spectra, 0…1.

    >>> pixel_errors(np.zeros((2, 90, 360)), np.ones((2, 90, 360))).shape
    (2, 1296)
    """
    return (truth[:, ::EVERY, ::EVERY] - prediction[:, ::EVERY, ::EVERY]).reshape(len(truth), -1).astype(float)


def fit_deviation(error: Float[np.ndarray, "K P"], variance: Float[np.ndarray, " K"] | None) -> Deviation | None:
    """The c and g with which the errors are most likely, scaled so that ``SHARE`` of them lie within ``NORMAL`` σ.

    Args:
        error: result of ``pixel_errors`` for spectra to which the model was not fitted.
        variance: u at their positions. None: the model computes none.

    Returns:
        The deviation. None: there are fewer spectra than ``LEAST_VALIDATED``.

    >>> draws = np.random.default_rng(0).normal(size=(20, 500))
    >>> fit_deviation(0.2 * draws, None).at(None, 1).round(2).tolist()
    [0.2]
    """
    if len(error) < LEAST_VALIDATED:
        return None
    mean = 0.0 if variance is None else float(variance.mean())
    shapes = [Deviation(1.0, 0.0)]
    if variance is not None and mean > 0:
        shapes = [Deviation((1 - share) ** 0.5, (share / mean) ** 0.5) for share in SHARES]
    likelihoods, scaled = [], []
    for shape in shapes:
        sigma = np.maximum(shape.at(variance, len(error)), 1e-6)
        ratios = np.abs(error) / sigma[:, None]
        size = max(float(np.sqrt(np.mean(ratios**2))), 1e-6)
        likelihoods.append(-np.log(sigma).mean() - np.log(size))
        scale = float(np.quantile(ratios, SHARE)) / NORMAL
        constant, growth = min(max(scale * shape.constant, LEAST), MOST), min(scale * shape.growth, MOST)
        scaled.append(Deviation(constant, growth, len(error)))
    return scaled[int(np.argmax(likelihoods))]
