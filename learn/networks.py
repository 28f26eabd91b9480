"""The residual feed-forward network that the static network, dynamic network and delta decoder are made of."""

from __future__ import annotations

from jaxtyping import Float
from torch import Tensor, nn


class LinearOfParts(nn.Linear):
    """W [x_1; x_2; …] + b of parts that broadcast against each other: b + Σ_k W_k x_k.

    The same as ``nn.Linear`` of their concatenation, but what all transmitters (or all primitives) have in common is
    multiplied once instead of once for each.
    """

    def forward(self, *parts: Float[Tensor, "*#batch _inputs"]) -> Float[Tensor, "*batch outputs"]:
        first, *others = self.weight.split([part.shape[-1] for part in parts], dim=1)
        result = nn.functional.linear(parts[0], first, self.bias)
        for part, weight in zip(parts[1:], others, strict=True):
            result = result + nn.functional.linear(part, weight)
        return result


class ResidualFFN(nn.Module):
    """x ← W_in x, then ``layers`` times x ← x + GELU(W_l LayerNorm(x)), then W_out x.

    Args:
        inputs: number of inputs, of all parts together.
        outputs: number of outputs.
        width: hidden width (the paper: 128; 256 for BiSplat-WRF+).
        layers: number of residual layers (the paper: 4; 12 for BiSplat-WRF+).
    """

    def __init__(self, inputs: int, outputs: int, width: int, layers: int):
        super().__init__()
        self.inward = LinearOfParts(inputs, width)
        self.hidden = nn.ModuleList(
            nn.Sequential(nn.LayerNorm(width), nn.Linear(width, width), nn.GELU()) for _ in range(layers)
        )
        self.outward = nn.Linear(width, outputs)

    def forward(self, *parts: Float[Tensor, "*#batch _inputs"]) -> Float[Tensor, "*batch outputs"]:
        x = self.inward(*parts)
        for layer in self.hidden:
            x = x + layer(x)
        return self.outward(x)
