"""Find received powers that cannot be powers in dBm, and say what they look like."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

NOT_RECEIVED = -100.0
"""dBm; stands in gateway_rssi.csv where nothing was received. NeRF² and GSRF leave such entries out."""

STRONGEST = 60.0
"""dBm; largest power that is believed: 1 kW at the receiver."""


def fault_of_powers(powers: Float[np.ndarray, "K G"], stated: bool = False) -> str | None:
    """A sentence on powers that cannot be in dBm; None if they can.

    >>> fault_of_powers(np.array([[-60.0, -71.5]])) is None
    True
    >>> fault_of_powers(np.array([[2e-7, 3e-9]]))
    'expected powers in dBm, found 3e-09 to 2e-07, which look like linear powers: take 10 log10 of milliwatts'
    >>> fault_of_powers(np.array([[60.0, 71.5]]))
    'expected powers in dBm, found 60 to 71.5, all positive: is the minus sign missing?'
    """
    received = powers[~np.isnan(powers)]
    if not received.size:
        return None
    low, high = received.min(), received.max()
    if low >= 0 and high > 0 and not stated:
        found = f"expected powers in dBm, found {low:.4g} to {high:.4g}"
        if high <= 1:
            return f"{found}, which look like linear powers: take 10 log10 of milliwatts"
        return f"{found}, all positive: is the minus sign missing?"
    if high > STRONGEST:
        row, column = np.argwhere(powers == high)[0]
        found = f"expected powers of at most {STRONGEST:g} dBm, found {high:.4g} at position {row}, gateway {column}"
        # UJIIndoorLoc marks so that nothing was received.
        return f"{found}; if it means that nothing was received, put {NOT_RECEIVED:g} there" if high == 100 else found
    return None
