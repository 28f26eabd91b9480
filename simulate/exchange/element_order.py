"""How the elements of a recording are numbered and which way its phases turn, told by transmitters in line of sight.

If the numbering or the sign of the phase is another one, the strongest directions are turned or mirrored. Where many
transmitters are in sight, only one reading makes them point at the transmitters.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float
from scipy.spatial.transform import Rotation

from scenes.scene.antennas import Gateway
from simulate.dataset.bearings import FARTHER, POINTS
from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.array import Array, PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import evenly

EXAMINED = 200
"""Most positions whose strongest direction is looked at."""

APART = 10.0
"""Degrees by which every other reading must be farther from the transmitters."""

OWN = 0.75
"""The strongest directions must be nearer their own transmitters than those of other rows, by this factor. If they are
not, positions and responses of different rows belong together, or none do."""


class Order(NamedTuple):
    """How to read responses."""

    columns_first: bool = False  # elements are numbered along y first, then along x
    conjugated: bool = False  # the phase rises with the distance

    def read(self, responses: Complex[np.ndarray, "K elements"], array: Array) -> Complex[np.ndarray, "K elements"]:
        """Responses in our order, x first, with phases that fall with the distance."""
        if self.columns_first and isinstance(array, PlanarArray):
            responses = responses.reshape(-1, array.columns, array.rows).swapaxes(1, 2).reshape(responses.shape)
        return responses.conj() if self.conjugated else responses


class Told(NamedTuple):
    """An order, and how it is known."""

    order: Order  # how to read the responses
    error: float  # median angle between the strongest directions and the transmitters, degrees
    error_otherwise: float  # that of the next best order
    clear: bool  # whether the strongest directions decide


def told_by_sight(
    responses: Complex[np.ndarray, "K elements"],
    positions: Float[np.ndarray, "K 3"],
    gateway: Gateway,
    array: Array,
    columns_first: bool | None = None,
    conjugated: bool | None = None,
) -> Told:
    """The order in which the strongest directions are nearest the transmitters."""
    chosen = evenly(np.arange(len(positions)), EXAMINED)
    towards = Rotation.from_quat(gateway.orientation).inv().apply(positions[chosen] - np.asarray(gateway.position))
    towards /= np.linalg.norm(towards, axis=1, keepdims=True).clip(1e-9)
    grid = AngularGrid()
    beamformer = Beamformer(array, grid)
    orders = [
        Order(first, sign)
        for first in ((False, True) if columns_first is None else (columns_first,))
        for sign in ((False, True) if conjugated is None else (conjugated,))
    ]
    if array.is_line or not isinstance(array, PlanarArray):  # which have one order
        orders = [order for order in orders if not order.columns_first] or orders
    errors, errors_elsewhere = [], []
    elsewhere = np.roll(towards, len(towards) // 2, axis=0)
    for order in orders:
        read = order.read(responses[chosen], array)
        strongest = np.stack([grid.dominant_direction(beamformer.spectrum(each)) for each in read])
        errors.append(float(np.median(array.angle_between(strongest, towards))))
        errors_elsewhere.append(float(np.median(array.angle_between(strongest, elsewhere))))
    least, *others = sorted(errors)
    clear = least < POINTS and all(other > max(FARTHER * least, least + APART) for other in others)
    if np.median(array.angle_between(towards, elsewhere)) > APART:  # the rows do differ in direction
        clear = clear and least < OWN * errors_elsewhere[errors.index(least)]
    taken = errors.index(least) if clear else 0
    otherwise = min((error for number, error in enumerate(errors) if number != taken), default=np.inf)
    return Told(orders[taken], errors[taken], otherwise, clear)
