"""The residual feed-forward network of the paper, and one with a skip, by which other authors deform Gaussians."""

from __future__ import annotations

from typing import NamedTuple

from jaxtyping import Float
from torch import Tensor, nn


class Interpolated(NamedTuple):
    """Features of primitives, ``f'_i = Σ_j w_ij g'_j``, stored as weights and values until they are needed."""

    weights: Float[Tensor, "N_p N_c"]  # interpolation weights w_ij; each row adds up to 1
    values: Float[Tensor, "B N_c width"]  # features g'_j of the grid points


Part = Float[Tensor, "*#batch _inputs"] | Interpolated


class LinearOfParts(nn.Linear):
    """Linear layer ``W [x_1; x_2; …] + b = b + Σ_k W_k x_k`` whose inputs x_k broadcast against each other.

    An input that all transmitters (or all primitives) share is multiplied only once, and an ``Interpolated`` one at the
    grid points, which are fewer than the primitives.
    """

    def forward(self, *parts: Part) -> Float[Tensor, "*batch outputs"]:
        values = [part.values if isinstance(part, Interpolated) else part for part in parts]
        weights = self.weight.split([value.shape[-1] for value in values], dim=1)
        total: Tensor | None = None
        for part, value, weight in zip(parts, values, weights, strict=True):
            # The first product includes the bias; interpolation keeps it, since rows of the weights add up to 1.
            product = nn.functional.linear(value, weight, self.bias if total is None else None)
            product = part.weights @ product if isinstance(part, Interpolated) else product
            total = product if total is None else total + product
        assert total is not None
        return total


class ResidualFFN(nn.Module):
    """x ← W_in x, then ``layers`` times x ← x + GELU(W_l LayerNorm(x)), then W_out x."""

    def __init__(self, inputs: int, outputs: int, width: int, layers: int):
        super().__init__()
        self.inward = LinearOfParts(inputs, width)
        self.hidden = nn.ModuleList(
            nn.Sequential(nn.LayerNorm(width), nn.Linear(width, width), nn.GELU()) for _ in range(layers)
        )
        self.outward = nn.Linear(width, outputs)

    def forward(self, *parts: Part) -> Float[Tensor, "*batch outputs"]:
        return self.outward(self.features(*parts))

    def features(self, *parts: Part) -> Float[Tensor, "*batch width"]:
        """x before W_out."""
        x = self.inward(*parts)
        for layer in self.hidden:
            x = x + layer(x)
        return x


class SkipNetwork(nn.Module):
    """Linear layers, each with a ReLU after it; one of them sees the inputs again. Subclasses add the heads."""

    def __init__(self, inputs: int, width: int, layers: int, again: int):
        super().__init__()
        self.again = again
        self.layers = nn.ModuleList(
            LinearOfParts(inputs if layer == 0 else width + inputs if layer == again else width, width)
            for layer in range(layers)
        )

    def features(self, *parts: Part) -> Float[Tensor, "*batch width"]:
        """What the last layer makes of the inputs, which broadcast against each other."""
        x = self.layers[0](*parts).relu()
        for number, layer in enumerate(self.layers[1:], start=1):
            x = (layer(*parts, x) if number == self.again else layer(x)).relu()
        return x
