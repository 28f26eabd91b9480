"""How far a prediction may be off: the standard deviation of a spectrum in its dominant direction.

A model is fitted to the training part; its errors on the validation part then tell how far its predictions are off,
whatever the model (split conformal prediction, Papadopoulos et al. 2002). Where the model computes a variance of its
own (kriging does), predictions of a large variance are given larger deviations.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
from jaxtyping import Float
from msgspec import Meta, Struct

LEAST_VALIDATED = 10
"""Number of validation spectra; fewer say too little about the errors."""

SHARE, NORMAL = 0.9, 1.6449
"""Share of the errors that lie within ``NORMAL`` standard deviations, as those of a normal distribution do."""

LEAST = 1 / 255
"""One grey level: pictures are rounded to it."""

SHARES = (0.0, 0.25, 0.5, 0.75, 0.95)
"""Of the mean squared error, what grows with the model's own variance: these are tried."""

MOST = 1000.0
Coefficient = Annotated[float, Meta(ge=0, le=MOST)]


class Deviation(Struct, frozen=True):
    """σ(r)² = c² + g² u(r), with the model's relative variance u at the position r; without one u is 0.

    Attributes:
        constant: c, in units in which the spectrum is 0…1.
        growth: g, in the same units.
    """

    constant: Coefficient
    growth: Coefficient

    def at(self, variance: Float[np.ndarray, " K"] | None, count: int) -> Float[np.ndarray, " K"]:
        """Standard deviation σ at K positions.

        Args:
            variance: u at the positions; None: the model computes none.
            count: K.

        >>> Deviation(0.03, 0.4).at(np.array([0.0, 0.01]), 2).tolist()
        [0.03, 0.05]
        """
        return np.sqrt(self.constant**2 + self.growth**2 * (np.zeros(count) if variance is None else variance))


def dominant_error(
    prediction: Float[np.ndarray, "K 90 360"], truth: Float[np.ndarray, "K 90 360"]
) -> Float[np.ndarray, " K"]:
    """True minus predicted value in the direction in which each predicted spectrum is largest.

    Args:
        prediction: predicted spectra, 0…1.
        truth: true spectra, 0…1.

    >>> prediction, truth = np.zeros((2, 1, 90, 360))
    >>> prediction[0, 10, 20], truth[0, 10, 20] = 1.0, 0.75
    >>> dominant_error(prediction, truth).tolist()
    [-0.25]
    """
    flat = prediction.reshape(len(prediction), -1)
    where = np.arange(len(flat)), flat.argmax(axis=1)
    return (truth.reshape(len(truth), -1)[where] - flat[where]).astype(float)


def fit_deviation(error: Float[np.ndarray, " K"], variance: Float[np.ndarray, " K"] | None) -> Deviation | None:
    """The c and g by which the errors are most likely, scaled so that ``SHARE`` of them lie within ``NORMAL`` σ.

    Args:
        error: of ``dominant_error`` on spectra that the model was not fitted to.
        variance: u at their positions; None: the model computes none.

    Returns:
        None if there are fewer errors than ``LEAST_VALIDATED``.

    >>> draws = np.random.default_rng(0).normal(size=2000)
    >>> fit_deviation(0.2 * draws, None).at(None, 1).round(2).tolist()
    [0.2]
    """
    if len(error) < LEAST_VALIDATED:
        return None
    mean = 0.0 if variance is None else float(variance.mean())
    shapes = [Deviation(1.0, 0.0)]
    if variance is not None and mean > 0:
        shapes = [Deviation((1 - share) ** 0.5, (share / mean) ** 0.5) for share in SHARES]
    rank = min(len(error), int(np.ceil(SHARE * (len(error) + 1)))) - 1
    likelihoods, scaled = [], []
    for shape in shapes:
        sigma = np.maximum(shape.at(variance, len(error)), 1e-6)
        size = max(float(np.sqrt(np.mean((error / sigma) ** 2))), 1e-6)
        likelihoods.append(-np.log(sigma).mean() - np.log(size))
        scale = float(np.sort(np.abs(error) / sigma)[rank]) / NORMAL
        scaled.append(Deviation(min(max(scale * shape.constant, LEAST), MOST), min(scale * shape.growth, MOST)))
    return scaled[int(np.argmax(likelihoods))]
