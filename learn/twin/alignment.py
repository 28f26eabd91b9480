"""Alignment of measured responses with the phase and scale of traced ones, and the difference that remains."""

from __future__ import annotations

import numpy as np
from jaxtyping import Complex


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
