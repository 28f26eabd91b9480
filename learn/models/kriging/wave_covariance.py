"""The covariance of a sum of plane waves with random phases, and when a new position was passed.

The export to ONNX has no complex numbers. So a complex value y is kriged as two real rows, y and −jy, each of which is
a pair (real, imaginary). With the complex weight w, ``conj(w) y`` is the sum of both with the real weights Re w and
Im w. A Hermitian covariance then becomes a symmetric matrix of twice the size.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor


def distances(a: Float[Tensor, "*b n d"], b: Float[Tensor, "*b m d"]) -> Float[Tensor, "*b n m"]:
    """Distances between points, from differences: the faster method of torch.cdist is exact only to millimetres."""
    return torch.linalg.vector_norm(a[..., :, None, :] - b[..., None, :, :], dim=-1)


class Separations:
    """The separations Δ = a − b of places, as covariances need them. What does not depend on a fit is computed once."""

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


STRAY, STRAY_LEAST = 0.2, 1e-3
"""Standard deviation of the path from the straight line between consecutive known positions: a fraction of the line's
length, plus a minimum in metres."""

LEGS = 64
"""Number of most probable legs over which a prediction averages. A leg is the path between two consecutive known
positions."""


def leg_times(
    positions: Float[Tensor, "B 3"], places: Float[Tensor, "n 3"], times: Float[Tensor, " n"]
) -> tuple[Float[Tensor, "B L"], Float[Tensor, "B L"]]:
    """When new positions may have been passed on the legs between consecutive known ones, and how probable each is.

    The probability of a leg is its duration times the density, at the position, of a three-dimensional normal
    distribution around the leg's straight line.
    """
    legs, leg_duration = places.diff(dim=0), times.diff()
    from_leg_start = positions[:, None] - places[:-1]
    leg_fraction = ((from_leg_start * legs).sum(dim=-1) / legs.square().sum(dim=-1).clamp_min(1e-12)).clamp(0, 1)
    leg_length = torch.linalg.vector_norm(legs, dim=-1)
    deviation = STRAY * leg_length + STRAY_LEAST
    # Integral of the unnormalised density: a tube around the leg and half a ball at each of its ends.
    tube_volume = 2 * torch.pi * leg_length * deviation**2 + (2 * torch.pi) ** 1.5 * deviation**3
    distance = torch.linalg.vector_norm(from_leg_start - leg_fraction[..., None] * legs, dim=-1) / deviation
    log_probability = leg_duration.log() - distance.square() / 2 - tube_volume.log()
    log_probability, leg = log_probability.topk(min(LEGS, len(legs)), dim=1)
    return times[leg] + leg_fraction.gather(1, leg) * leg_duration[leg], log_probability.softmax(dim=1)


def leg_shapes(places: Float[np.ndarray, "n 3"], times: Float[np.ndarray, " n"]) -> Float[np.ndarray, "L 7"]:
    """What ``leg_times`` needs of each leg, computed once for a compiled loop over positions."""
    vectors, duration = np.diff(places, axis=0), np.diff(times)
    squared = np.square(vectors).sum(axis=1)
    length = np.sqrt(squared)
    deviation = STRAY * length + STRAY_LEAST
    volume = 2 * np.pi * length * deviation**2 + (2 * np.pi) ** 1.5 * deviation**3
    with np.errstate(divide="ignore"):  # two spectra of one time
        density = np.log(duration / volume)
    return np.column_stack([vectors, 1 / np.maximum(squared, 1e-12), duration, 0.5 / deviation**2, density])
