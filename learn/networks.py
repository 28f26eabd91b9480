"""The residual feed-forward network that the static network, dynamic network and delta decoder are made of."""

from __future__ import annotations

from jaxtyping import Float
from torch import Tensor, nn


class ResidualFFN(nn.Module):
    """x ← W_in x, then ``layers`` times x ← x + GELU(W_l LayerNorm(x)), then W_out x.

    Args:
        inputs: number of inputs.
        outputs: number of outputs.
        width: hidden width (the paper: 128; 256 for BiSplat-WRF+).
        layers: number of residual layers (the paper: 4; 12 for BiSplat-WRF+).
    """

    def __init__(self, inputs: int, outputs: int, width: int, layers: int):
        super().__init__()
        self.inward = nn.Linear(inputs, width)
        self.hidden = nn.ModuleList(
            nn.Sequential(nn.LayerNorm(width), nn.Linear(width, width), nn.GELU()) for _ in range(layers)
        )
        self.outward = nn.Linear(width, outputs)

    def forward(self, x: Float[Tensor, "*batch inputs"]) -> Float[Tensor, "*batch outputs"]:
        x = self.inward(x)
        for layer in self.hidden:
            x = x + layer(x)
        return self.outward(x)
