"""Positional encoding γ of coordinates (the paper's GS-PE and TX-PE)."""

from __future__ import annotations

import torch
from jaxtyping import Float
from torch import Tensor

PRIMITIVE_ORDER = 8
"""L of GS-PE, large because the primitives' coordinates are learned precisely; it gives 3 · (2·8 + 1) = 51 numbers."""

TX_ORDER = 6
"""L of TX-PE, smaller because measured transmitter positions are imprecise; it gives 3 · (2·6 + 1) = 39 numbers."""


def positional_encoding(t: Float[Tensor, "*batch 3"], order: int) -> Float[Tensor, "*batch encoded"]:
    """γ(t) = [t, {sin(2^k π t)}, {cos(2^k π t)}], k = 0 … L−1, element-wise.

    Args:
        t: coordinates, scaled to about −1…1.
        order: number of octaves L.

    Returns:
        3 · (2L + 1) numbers per coordinate vector.

    >>> positional_encoding(torch.zeros(3), 2).tolist()
    [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]
    """
    frequencies = torch.pi * 2.0 ** torch.arange(order, device=t.device, dtype=t.dtype)
    angles = (frequencies[:, None] * t[..., None, :]).flatten(-2)
    return torch.cat([t, angles.sin(), angles.cos()], dim=-1)
