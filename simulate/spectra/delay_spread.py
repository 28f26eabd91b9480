"""The delay spread of responses over a band."""

from __future__ import annotations

import numpy as np
from jaxtyping import Complex, Float


def delay_spread(responses: Complex[np.ndarray, "K elements subcarriers"], bandwidth: float) -> Float[np.ndarray, " K"]:
    """Root mean square delay spread of each row, seconds; 0 for a row of zeros.

    It is that of the power over the delays, between the places of an inverse Fourier transform of the subcarriers, all
    elements together. It is no finer than 1 / bandwidth.

    >>> two_paths = 1 + np.exp(-2j * np.pi * np.arange(16) * 4 / 16)  # the second arrives 4 / bandwidth later
    >>> float((1e9 * delay_spread(two_paths[None, None], 16e6)).round(3)[0])
    125.0
    """
    power = np.square(np.abs(np.fft.ifft(responses, axis=-1))).sum(axis=1)
    count = power.shape[1]
    # Delays are counted from the strongest one, since they are only known up to a multiple of the whole period.
    steps = (np.arange(count) + count // 2) % count - count // 2
    from_strongest = (power.argmax(axis=1)[:, None] + np.arange(count)) % count
    around = np.take_along_axis(power, from_strongest, axis=1)
    whole = around.sum(axis=1, keepdims=True)
    share = around / np.where(whole > 0, whole, 1)
    mean = share @ steps
    return np.sqrt((share * np.square(steps - mean[:, None])).sum(axis=1)) / bandwidth
