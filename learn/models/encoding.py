"""Encodings of coordinates: the paper's γ (GS-PE and TX-PE), and plane waves of the transmitter's position."""

from __future__ import annotations

from typing import Literal, get_args

import torch
from jaxtyping import Float
from torch import Tensor, nn

from scenes.files.errors import ParameterError, shown

EncodingKind = Literal["octaves", "waves"]

PRIMITIVE_ORDER = 8
"""L of GS-PE, large because the primitives' coordinates are learned precisely; it gives 3 · (2·8 + 1) = 51 numbers."""

TX_ORDER = 6
"""L of TX-PE, smaller because measured transmitter positions are imprecise; it gives 3 · (2·6 + 1) = 39 numbers."""


DIRECTIONS = 512
"""Number of directions of the plane waves. A field without sources in a ball of radius R has about (kR + 1)² degrees of
freedom. 512 directions are enough for a ball of 7 wavelengths across (2.3 m at 915 MHz)."""


def evenly_spread_directions(count: int) -> Float[Tensor, "count 3"]:
    """Unit vectors on a Fibonacci spiral; each represents the same solid angle."""
    index = torch.arange(count) + 0.5
    z, azimuth = 1 - 2 * index / count, torch.pi * (1 + 5**0.5) * index
    across = (1 - z.square()).sqrt()
    return torch.stack([across * azimuth.cos(), across * azimuth.sin(), z], dim=-1)


def positional_encoding(
    t: Float[Tensor, "*batch n"], order: int, lowest: float = torch.pi
) -> Float[Tensor, "*batch m"]:
    """γ(t) = [t, {sin(2^k π t)}, {cos(2^k π t)}], k = 0 … L−1, element-wise; π is the lowest."""
    frequencies = lowest * 2.0 ** torch.arange(order, device=t.device, dtype=t.dtype)
    angles = (frequencies[:, None] * t[..., None, :]).flatten(-2)
    return torch.cat([t, angles.sin(), angles.cos()], dim=-1)


class TransmitterEncoding(nn.Module):
    """Encodes the transmitter's position r as the input of a network.

    ``octaves`` is the paper's TX-PE, γ of the position scaled to −1…1; ``waves`` is cos and sin of ``k v_j·(r − r₀)``
    for directions v_j spread over the sphere, in which the responses at one frequency are nearly linear.
    """

    directions: Tensor

    def __init__(self, kind: EncodingKind, order: int = TX_ORDER):
        super().__init__()
        if kind not in get_args(EncodingKind):
            raise ParameterError(
                "encoding", f"expected one of {', '.join(get_args(EncodingKind))}, found {shown(kind)}"
            )
        self.kind, self.order = kind, order
        self.register_buffer("directions", evenly_spread_directions(DIRECTIONS), persistent=False)
        self.size = 2 * DIRECTIONS if kind == "waves" else 3 * (2 * order + 1)

    def forward(
        self, positions: Float[Tensor, "B 3"], region: Float[Tensor, "2 3"], wavelength: Float[Tensor, ""]
    ) -> Float[Tensor, "B size"]:
        """The encoding of positions in the ``region`` (min, max) of the training positions; all in metres."""
        low, high = region
        if self.kind == "octaves":
            return positional_encoding(2 * (positions - low) / (high - low) - 1, self.order)
        phase = 2 * torch.pi / wavelength * (positions - (low + high) / 2) @ self.directions.T
        return torch.cat([phase.cos(), phase.sin()], dim=-1)
