"""Complex gains of chains of interactions: how much stronger and later each chain is than traced.

If a description is a little wrong, ray tracing mainly gets the amplitude and the phase of each chain wrong, and by the
same factor all over the region. Examples are a reflection at a wall of another permittivity, and an edge that is a
little rounded.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Complex
from scipy.optimize import minimize_scalar

from learn.models.base import Report, SpectrumModel


def aligned_to(
    measured: Complex[np.ndarray, "K M"], traced: Complex[np.ndarray, "K M"], phases_known: bool, flips: bool
) -> tuple[Complex[np.ndarray, "K M"], complex]:
    """Measured responses in the phase and scale of traced ones, and their common gain.

    If phases are known, all responses share one complex gain, that of least squares. Otherwise the responses of each
    position get the phase that is closest to that of the traced ones, and their root mean square. With ``flips``, they
    are also flipped where this brings them closer.
    """
    if phases_known:
        gain = complex((traced.conj() * measured).sum() / (np.abs(traced) ** 2).sum())
        return measured / gain, gain
    flipped = measured[:, ::-1].conj()
    products = [(each.conj() * traced).sum(axis=1) for each in (measured, flipped)]
    turned = flips & (np.abs(products[1]) > np.abs(products[0]))
    chosen, product = np.where(turned[:, None], flipped, measured), np.where(turned, products[1], products[0])
    size, expected = np.linalg.norm(chosen, axis=1), np.linalg.norm(traced, axis=1)
    scale = np.divide(expected, size, out=np.zeros_like(size), where=size > 0)  # a picture of one level has none
    return chosen * (scale * np.exp(1j * np.angle(product)))[:, None], 1.0


def without_own_phase(
    values: Complex[np.ndarray, "K M *n"], traced: Complex[np.ndarray, "K M"], phases_known: bool
) -> Complex[np.ndarray, "K M *n"]:
    """Values without the part that a separate phase and scale of each position would change."""
    if phases_known:
        return values
    size = np.linalg.norm(traced, axis=1, keepdims=True)
    unit = np.divide(traced, size, out=np.zeros_like(traced), where=size > 0)  # there may be positions without a path
    along = np.einsum("km,km...->k...", unit.conj(), values)
    return values - np.einsum("km,k...->km...", unit, along)


def unexplained(rest: Complex[np.ndarray, "K M"], aligned: Complex[np.ndarray, "K M"]) -> float:
    """Share of the power of measured responses that the traced ones do not explain."""
    return float((np.abs(rest) ** 2).sum() / (np.abs(aligned) ** 2).sum())


MOST = 1000  # Largest number of chains with a gain; these are the strongest ones

RATIOS = (1e-6, 1e6)  # Bounds of the search for τ²/ν, for responses with a mean power of 1

NEGLIGIBLE = 1e-12
"""Eigenvalues that are smaller than this, relative to the largest one, are rounding errors."""


ALIGNED = 3
"""Number of rounds. Each round gives the measured responses the phases of those predicted with the gains so far, and
then fits the gains again."""

FOLDS = 4
"""Number of parts into which the known spectra are divided. For each part, gains are found from the other parts."""


def aligned_gains(
    by_chain: Complex[np.ndarray, "K M chains"],
    traced: Complex[np.ndarray, "K M"],
    measured: Complex[np.ndarray, "K M"],
    phases_known: bool,
    flips: bool,
    report: Report = SpectrumModel.report,
) -> tuple[Complex[np.ndarray, " chains"], Complex[np.ndarray, "K M"]]:
    """Gains of chains, from measured responses that have a common gain or separate phases."""
    gains, aligned = np.zeros(by_chain.shape[-1], complex), measured
    for turn in range(ALIGNED):
        report("gains of chains", turn, ALIGNED)
        aligned, _ = aligned_to(measured, traced + by_chain @ gains, phases_known, flips)
        gains = chain_gains(by_chain, aligned - traced)
    held_out = traced.copy()
    folds = min(FOLDS, len(traced))
    for fold in range(folds if len(traced) > 1 else 0):
        report("gains without each part", fold, folds)
        part = np.arange(len(traced)) % folds == fold
        without = chain_gains(by_chain[~part], (aligned - traced)[~part])
        held_out[part] = traced[part] + by_chain[part] @ without
    return gains, held_out


def chain_gains(
    by_chain: Complex[np.ndarray, "K M chains"], left: Complex[np.ndarray, "K M"]
) -> Complex[np.ndarray, " chains"]:
    """The gains g_c in Σ_c g_c a_c + ε, which models the difference between measured and traced responses.

    The a_c are the traced responses of each chain. The g_c are assumed to be independent draws from a normal
    distribution of variance τ², and ε to be white noise of variance ν. g is the posterior mean (ridge regression), with
    the τ² and ν of highest marginal likelihood [mackay1992].

    >>> generator = np.random.default_rng(0)
    >>> a = generator.normal(size=(20, 16, 30, 2)) @ [1, 1j]
    >>> g = 0.3 * generator.normal(size=(30, 2)) @ [1, 1j]
    >>> float(np.abs(chain_gains(a, a @ g) - g).max()) < 1e-3
    True
    """
    power = (np.abs(by_chain) ** 2).sum(axis=(0, 1), dtype=float)
    chosen = np.argsort(-power)[:MOST]
    matrix = by_chain[..., chosen].reshape(left.size, -1).astype(complex)
    mean_power = (np.abs(matrix.sum(axis=1)) ** 2).mean()
    gains = np.zeros(by_chain.shape[-1], complex)
    if not (mean_power > 0 and left.any()):
        return gains
    values, vectors = np.linalg.eigh(matrix.conj().T @ matrix / mean_power)
    kept = values > NEGLIGIBLE * values[-1]
    values, vectors = values[kept], vectors[:, kept]
    towards = vectors.conj().T @ (matrix.conj().T @ left.ravel()) / mean_power
    explained = np.abs(towards) ** 2 / values
    total = float((np.abs(left) ** 2).sum() / mean_power)

    def noise(ratio: float) -> float:
        """The most likely ν for a ratio τ²/ν."""
        return (total - float((explained * ratio * values / (1 + ratio * values)).sum())) / left.size

    def unlikely(logarithm: float) -> float:
        """−log of the marginal likelihood, up to a constant."""
        ratio = np.exp(logarithm)
        return left.size * np.log(max(noise(ratio), NEGLIGIBLE)) + float(np.log1p(ratio * values).sum())

    ratio = np.exp(minimize_scalar(unlikely, bounds=np.log(RATIOS), method="bounded").x)
    gains[chosen] = vectors @ (ratio / (1 + ratio * values) * towards)
    return gains
