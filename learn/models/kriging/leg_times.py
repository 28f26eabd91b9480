"""When a new position was passed: the legs of the path along which known spectra were measured."""

from __future__ import annotations

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

STRAY, STRAY_LEAST = 0.2, 1e-3
"""Standard deviation of the path from the straight line between consecutive known positions: a fraction of the line's
length, plus a minimum in metres."""

LEGS = 64
"""Number of most probable legs over which a prediction averages. A leg is the path between two consecutive known
positions."""


def leg_times(
    positions: Float[Tensor, "B 3"], places: Float[Tensor, "n 3"], times: Float[Tensor, " n"]
) -> tuple[Float[Tensor, "B L"], Float[Tensor, "B L"]]:
    """When new positions may have been passed on the path through known ones.

    A position is assumed to lie on one of the legs between consecutive known positions. The probability of a leg is its
    duration times the density, at the position, of a three-dimensional normal distribution around the leg's straight
    line.
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
