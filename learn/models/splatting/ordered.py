"""Primitives in depth order, as renderers take them."""

from __future__ import annotations

from typing import NamedTuple

from jaxtyping import Float
from torch import Tensor

Conic = tuple[Float[Tensor, "B N_p"], Float[Tensor, "B N_p"], Float[Tensor, "B N_p"]]
"""The entries a, b, c of the inverse covariances Σ⁻¹ = [[a, b], [b, c]] of primitives, per square degree."""


class Ordered(NamedTuple):
    """Primitives in depth order, nearest first, as renderers blend them."""

    azimuth: Float[Tensor, "*#B N_p"]  # φ_i, degrees
    elevation: Float[Tensor, "*#B N_p"]  # θ_i, degrees
    conic: Conic
    opacity: Float[Tensor, "B N_p"]  # o_i
    coefficient: Float[Tensor, "B N_p 2"]  # c_i (real, imaginary)

    def attributes(self) -> tuple[Float[Tensor, "B N_p"], ...]:
        """All numbers of the primitives, each for every transmitter."""
        centres = (axis.expand(self.opacity.shape) for axis in (self.azimuth, self.elevation))
        return *centres, *self.conic, self.opacity, *self.coefficient.unbind(-1)
