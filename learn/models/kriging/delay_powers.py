"""The power that arrives after each delay, fitted to responses over a band: a Gaussian process over frequency."""

from __future__ import annotations

import numpy as np
from jaxtyping import Complex, Float

FINER = 8  # delays of the profile, per subcarrier
STEPS = 300  # steps of the fit of the profile
LEAST_NOISE = 1e-8  # smallest power of the noise, as a share of the mean power of the responses


def fit_delay_powers(
    rows: Complex[np.ndarray, "n A N"], noise: float | None = None
) -> tuple[Float[np.ndarray, " M"], float]:
    """Fit powers of delays and of noise to responses by maximum likelihood.

    The covariance is Σ p f f^H + ν, with f = exp(−i 2π n τ) over subcarriers n and a grid of delays τ. Each step
    multiplies each power by the root of f^H R⁻¹ C R⁻¹ f / f^H R⁻¹ f, with the covariance R so far and that C of the
    responses, and the noise likewise. No step lowers the likelihood [stoica2012].
    """
    count = rows.shape[2]
    responses = rows.reshape(-1, count)
    paths = delay_paths(count, FINER * count)
    found = responses.T @ responses.conj() / max(len(responses), 1)
    power = np.full(FINER * count, 1.0 / (FINER * count))
    fitted = noise is None
    noise = max(float(np.linalg.eigvalsh(found)[0]) if noise is None else noise, LEAST_NOISE)
    for _ in range(STEPS):
        inverse = np.linalg.inv(profile_covariance(paths, power, noise))
        seen = inverse @ found @ inverse
        power = power * np.sqrt(_along(seen, paths) / _along(inverse, paths))
        if fitted:
            noise = max(noise * float(np.sqrt(max(np.trace(seen).real, 0) / np.trace(inverse).real)), LEAST_NOISE)
    return power, noise


def white_noise(rows: Complex[np.ndarray, "n A N"]) -> float:
    """Power of the noise that is independent between subcarriers, where the responses fill not all of the dimensions.

    Of the eigenvalues of the rows' covariance, the smallest ones that are alike are the noise. Their number is that of
    the shortest description [wax1985].
    """
    responses = rows.reshape(-1, rows.shape[2])
    values = np.linalg.eigvalsh(responses.T @ responses.conj() / max(len(responses), 1))
    values, count = np.maximum(values, LEAST_NOISE * LEAST_NOISE), len(responses)
    lengths = []
    for alike in range(1, len(values) + 1):  # so many of the smallest are noise
        unlike = len(values) - alike
        even = np.log(values[:alike].mean()) - np.log(values[:alike]).mean()
        lengths.append(count * alike * even + unlike * (len(values) + alike) * np.log(max(count, 2)) / 2)
    return max(float(values[: int(np.argmin(lengths)) + 1].mean()), LEAST_NOISE)


def delay_paths(count: int, delays: int) -> Complex[np.ndarray, "N M"]:
    """Responses f at N subcarriers of one path each of M delays, evenly spread over 1 / distance of subcarriers."""
    return np.exp(-2j * np.pi * np.outer(np.arange(count), np.arange(delays)) / delays)


def profile_covariance(
    paths: Complex[np.ndarray, "N M"], power: Float[np.ndarray, " M"], noise: float
) -> Complex[np.ndarray, "N N"]:
    """The covariance Σ p f f^H + ν of the subcarriers."""
    return (paths * power) @ paths.conj().T + noise * np.eye(len(paths))


def _along(matrix: Complex[np.ndarray, "N N"], paths: Complex[np.ndarray, "N M"]) -> Float[np.ndarray, " M"]:
    """f^H M f for each path."""
    return np.maximum(np.einsum("nm,nm->m", paths.conj(), matrix @ paths).real, np.finfo(float).tiny)
