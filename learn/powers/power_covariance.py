"""The covariance of received powers in dB over the position: slow change of the local mean, fading, and noise.

Fading is the interference of paths. Where many of them arrive, the response y is about a circular complex Gaussian
field [cook1955]. The logarithms of two powers |y|² whose responses have the correlation κ then have the covariance
(10 / ln 10)² Li₂(|κ|²) with the dilogarithm Li₂. For by the formula of Hille and Hardy, the joint density of two such
powers u, v of mean 1 is exp(−u − v) Σ |κ|²ᵏ L_k(u) L_k(v), with Laguerre polynomials L_k. The mean of ln(u) L_k(u) is
−1 / k, so the covariance of ln u and ln v is Σ |κ|²ᵏ / k² over k ≥ 1. A single power deviates by 5.57 dB.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial.distance import cdist
from scipy.special import spence

FADING_DB = 10 / np.log(10) * np.pi / np.sqrt(6)
"""Standard deviation of the power of a circular complex Gaussian response, dB."""

LARGEST_CORRELATION = 1 - 1e-12
"""Keeps ln(1 − |κ|²) finite where two positions are the same."""


def fading_covariance(squared: Float[np.ndarray, "*shape"]) -> Float[np.ndarray, "*shape"]:
    """Covariance of two powers in dB, (10 / ln 10)² Li₂(|κ|²), as a share of the variance of each.

    >>> fading_covariance(np.array([0.0, 0.5, 1.0])).round(3).tolist()
    [0.0, 0.354, 1.0]
    """
    return spence(1 - squared) / (np.pi**2 / 6)  # scipy's spence(z) is Li₂(1 − z)


def squared_separations(here: Float[np.ndarray, "n 3"], there: Float[np.ndarray, "m 3"]) -> Float[np.ndarray, "3 n m"]:
    """Squared separations of positions along each axis, square metres."""
    return np.square(here.T[:, :, None] - there.T[:, None, :])


@dataclass(frozen=True)
class PowerCovariance:
    """Parts of a variance of 1 and their lengths.

    |κ|² is a Gaussian of the separation. The sinc² of waves from all directions [cook1955] with a length for each axis,
    in its place, predicted powers of a simulated office no better.
    """

    # of slow change, fading and noise; their sum is 1. With a line of sight, the share of fading is smaller.
    shares: Float[np.ndarray, " 3"]
    slow: Float[np.ndarray, " 3"]  # lengths of a Matérn covariance of order 3/2 along x, y, z, metres
    # lengths along x, y, z over which |κ|² falls to 1 / e, as a Gaussian of the separation, metres
    fading: Float[np.ndarray, " 3"]

    @classmethod
    def of(cls, unbounded: Float[np.ndarray, " 8"]) -> PowerCovariance:
        """From numbers of any size: logarithms of two shares relative to that of noise, and of the six lengths."""
        shares = np.exp(np.append(unbounded[:2], 0.0) - max(0.0, *unbounded[:2]))
        return cls(shares / shares.sum(), np.exp(unbounded[2:5]), np.exp(unbounded[5:]))

    def __call__(self, here: Float[np.ndarray, "n 3"], there: Float[np.ndarray, "m 3"]) -> Float[np.ndarray, "n m"]:
        """Covariance between powers at different positions, metres."""
        distance = np.sqrt(3) * cdist(here / self.slow, there / self.slow)
        squared = np.exp(-cdist(here / self.fading, there / self.fading, "sqeuclidean"))
        return self.shares[0] * (1 + distance) * np.exp(-distance) + self.shares[1] * fading_covariance(squared)

    def with_gradient(
        self, separations: Float[np.ndarray, "3 n n"]
    ) -> tuple[Float[np.ndarray, "n n"], list[Float[np.ndarray, "n n"]]]:
        """Covariance of the known powers, with their noise, and its derivatives by the arguments of ``of``."""
        distance = np.sqrt(3 * np.tensordot(self.slow**-2.0, separations, 1))
        decay = np.exp(-distance)
        squared = np.minimum(np.exp(-np.tensordot(self.fading**-2.0, separations, 1)), LARGEST_CORRELATION)
        parts = [(1 + distance) * decay, fading_covariance(squared), np.eye(len(decay))]
        whole = np.tensordot(self.shares, parts, 1)
        by_share = [share * (part - whole) for share, part in zip(self.shares[:2], parts[:2], strict=True)]
        by_slow = 3 * self.shares[0] * decay * separations / np.square(self.slow)[:, None, None]
        steep = -2 * self.shares[1] * np.log1p(-squared) / (np.pi**2 / 6)
        by_fading = steep * separations / np.square(self.fading)[:, None, None]
        return whole, [*by_share, *by_slow, *by_fading]
