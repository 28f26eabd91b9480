"""The covariance of a sum of plane waves with random phases, and kriging of complex values in real numbers.

The export to ONNX has no complex numbers. So a complex value y is kriged as two real rows, y and −jy, each of which is
a pair (real, imaginary). With the complex weight w, ``conj(w) y`` is the sum of both with the real weights Re w and
Im w. A Hermitian covariance then becomes a symmetric matrix of twice the size.
"""

from __future__ import annotations

from functools import cached_property

import torch
from jaxtyping import Float
from torch import Tensor

from learn.models.geometry import distances


class Separations:
    """The separations Δ = a − b of places, as covariances need them. What does not depend on a fit is computed once.

    >>> wave, shares = Separations(torch.zeros(1, 3), torch.ones(1, 3), torch.eye(3)), torch.tensor([1.0, 0, 0])
    >>> [round(float(each), 2) for each in wave.wave_sum(shares)]  # e^{−j}
    [0.54, -0.84]
    """

    def __init__(self, a: Float[Tensor, "*b n 3"], b: Float[Tensor, "*b m 3"], wavenumbers: Float[Tensor, "3 J"]):
        self.distances: Float[Tensor, "*b n m"] = distances(a, b)
        self._a, self._b, self._wavenumbers = a, b, wavenumbers

    @cached_property  # only some covariances have waves
    def _parts(self) -> tuple[Float[Tensor, "*b n 2*J"], Float[Tensor, "*b 2*J 2*m"]]:
        """The factors whose products, summed over the waves, are the real parts of e^{jk u_j·Δ}, then the imaginary."""
        phase_a, phase_b = self._a @ self._wavenumbers, self._b @ self._wavenumbers
        of_a = torch.cat([phase_a.cos(), phase_a.sin()], dim=-1)
        cosine, sine = phase_b.cos().mT, phase_b.sin().mT
        return of_a, torch.cat([torch.cat([cosine, -sine], dim=-1), torch.cat([sine, cosine], dim=-1)], dim=-2)

    def wave_sum(self, shares: Float[Tensor, " J"]) -> tuple[Float[Tensor, "*b n m"], Float[Tensor, "*b n m"]]:
        """Real and imaginary part of ``Σ_j s_j e^{jk u_j·Δ}``."""
        of_a, of_b = self._parts
        real, imaginary = ((of_a * torch.cat([shares, shares])) @ of_b).chunk(2, dim=-1)
        return real, imaginary


def between_rows(real: Float[Tensor, "*b n m"], imaginary: Float[Tensor, "*b n m"]) -> Float[Tensor, "*b 2*n 2*m"]:
    """The covariance between the rows y and −jy of complex values, from that of the values."""
    return torch.cat([torch.cat([real, -imaginary], dim=-1), torch.cat([imaginary, real], dim=-1)], dim=-2)


def with_turned_rows(values: Float[Tensor, "*b n C"]) -> Float[Tensor, "*b 2*n C"]:
    """The rows y of complex values (real, imaginary; flattened), and below them −jy."""
    real, imaginary = values.unflatten(-1, (-1, 2)).unbind(-1)
    return torch.cat([values, torch.stack([imaginary, -real], dim=-1).flatten(-2)], dim=-2)
