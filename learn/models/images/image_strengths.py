"""How strong each of many waves is: the variances of their amplitudes with the highest likelihood."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Num
from scipy.linalg import cho_factor, cho_solve

WEAKEST = 1e-6
"""Variance, relative to the largest one, below which a wave is left out."""

LEAST_POWER = 1e-9
"""Mean power of a wave, relative to the data's, below which it is left out, even if it is the strongest."""

LEAST_NOISE = 1e-6
"""Smallest variance of the noise, relative to the data's."""


class Strengths(NamedTuple):
    """What was found of J waves."""

    variances: Float[np.ndarray, " J"]  # γ of each wave, 0 if it is left out
    noise: float  # σ²
    amplitudes: Complex[np.ndarray, " J"]  # the expected x of each wave, given the data


def most_likely(
    waves: Complex[np.ndarray, "N J"],
    data: Complex[np.ndarray, " N"],
    start: Float[np.ndarray, " J"],
    noise: float,
    iterations: int,
) -> Strengths:
    """Find the strengths of waves in data: sparse Bayesian learning [tipping2001].

    The data are ``y = W x + n``. The amplitudes x_j are independent and Gaussian with the variances γ_j, and the noise
    n has the variance σ². So y has the covariance ``C = W diag(γ) Wᴴ + σ² I``. The γ that maximise its likelihood are
    mostly zero, so that few waves are left. Each iteration multiplies γ_j by ``|w_jᴴ C⁻¹ y| / √(w_jᴴ C⁻¹ w_j)``, which
    never lowers the likelihood [wipf2010], and sets σ² to what the waves leave.

    >>> waves = np.linalg.qr(np.random.default_rng(0).normal(size=(8, 4)))[0].astype(complex)
    >>> found = most_likely(waves, 3 * waves[:, 0], np.full(4, 0.1), 0.1, iterations=50)
    >>> found.amplitudes.real.round(2).tolist()
    [3.0, 0.0, 0.0, 0.0]
    """
    power = float((np.abs(data) ** 2).mean())
    if not power:
        return Strengths(np.zeros(len(start)), 0.0, np.zeros(len(start), complex))
    left, variances = np.arange(len(start)), start
    for iteration in range(iterations + 1):
        powers = variances * (np.abs(waves) ** 2).mean(axis=0)
        strong = (variances > WEAKEST * variances.max()) & (powers > LEAST_POWER * power)
        if not strong.any():  # data that are no such waves
            return Strengths(np.zeros(len(start)), power, np.zeros(len(start), complex))
        left, variances, waves = left[strong], variances[strong], waves[:, strong]
        amplitudes, ratios = expected_amplitudes(waves, data, variances, noise)
        if iteration == iterations:
            break
        unexplained = float((np.abs(data - waves @ amplitudes) ** 2).sum())
        determined = float((variances * ratios).sum())  # number of amplitudes that the data determine
        noise = max(unexplained / max(len(data) - determined, 1.0), LEAST_NOISE * power)
        variances = np.abs(amplitudes) / np.sqrt(ratios)
    found, expected = np.zeros(len(start)), np.zeros(len(start), complex)
    found[left], expected[left] = variances, amplitudes
    return Strengths(found, noise, expected)


def log_likelihood(
    waves: Complex[np.ndarray, "N J"], data: Complex[np.ndarray, " N"], variances: Float[np.ndarray, " J"], noise: float
) -> float:
    """Log-likelihood of data that are waves with these variances and noise, without its constant, over N.

    >>> log_likelihood(np.zeros((2, 1), complex), np.ones(2, complex), np.zeros(1), noise=1.0)
    -1.0
    """
    factor, lower = cho_factor((waves * variances) @ waves.conj().T + noise * np.eye(len(data)))
    explained = (data.conj() @ cho_solve((factor, lower), data)).real
    return float(-2 * np.log(np.diag(factor).real).mean() - explained / len(data))


def expected_amplitudes(
    waves: Num[np.ndarray, "N J"], data: Num[np.ndarray, " N"], variances: Float[np.ndarray, " J"], noise: float
) -> tuple[Num[np.ndarray, " J"], Float[np.ndarray, " J"]]:
    """The expected amplitudes γ Wᴴ C⁻¹ y, and w_jᴴ C⁻¹ w_j, by the smaller of two systems of equations.

    >>> amplitudes, ratios = expected_amplitudes(np.eye(2), np.array([2.0, 0.0]), np.ones(2), noise=1.0)
    >>> amplitudes.round(3).tolist(), ratios.round(3).tolist()
    ([1.0, 0.0], [0.5, 0.5])
    """
    if len(data) <= len(variances):
        factor = cho_factor((waves * variances) @ waves.conj().T + noise * np.eye(len(data)))
        ratios = (waves.conj() * cho_solve(factor, waves)).real.sum(axis=0)
        return variances * (waves.conj().T @ cho_solve(factor, data)), ratios
    roots = np.sqrt(variances)
    scaled = waves * roots
    inverse = cho_solve(cho_factor(scaled.conj().T @ scaled / noise + np.eye(len(roots))), np.eye(len(roots)))
    amplitudes = roots * (inverse @ (scaled.conj().T @ data)) / noise
    return amplitudes, np.maximum(1 - np.diag(inverse).real, 1e-12) / variances
