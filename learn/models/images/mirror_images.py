"""Mirror images of the gateway in planes along the axes of the world frame, and the waves of these images."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations, product

import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor

STEP, GROWTH, FAR = 0.375, 10.0, 9.0
"""Distances of neighbouring planes, wavelengths: ``STEP`` at the gateway, twice as much ``GROWTH`` wavelengths beyond,
where a change of the distance changes the waves less. The last plane is ``FAR`` metres from the nearest possible one.
"""

STRONGEST, APART = 5, 1.0
"""Number of planes along each axis whose images are mirrored again, and the least distance of these images from each
other, wavelengths: an image between two planes of the grid is strong in both."""


@dataclass(frozen=True)
class Images:
    """Images of the gateway's array.

    A plane mirrors one coordinate of an image, two perpendicular ones mirror two, and two parallel ones shift it.
    """

    middles: Float[np.ndarray, "J 3"]  # the middle of each image, metres, world frame
    signs: Float[np.ndarray, "J 3"]  # −1 where a coordinate of the array is mirrored, otherwise 1

    def __len__(self) -> int:
        return len(self.middles)

    def of(self, which: Bool[np.ndarray, " J"]) -> Images:
        """Some of the images."""
        return Images(self.middles[which], self.signs[which])


def image_waves(
    positions: Float[Tensor, "n 3"],
    middles: Float[Tensor, "J 3"],
    signs: Float[Tensor, "J 3"],
    offsets: Float[Tensor, "elements 3"],
    wavelength: Float[Tensor, ""],
) -> tuple[Float[Tensor, "n elements J"], Float[Tensor, "n elements J"]]:
    """The spherical waves e^{−jkR}/R from the elements of each image, R in wavelengths: real and imaginary parts."""
    elements = middles + signs * offsets[:, None]
    away = torch.linalg.vector_norm(positions[:, None, None] - elements, dim=-1) / wavelength
    magnitudes, phases = 1 / away.clamp_min(STEP), -2 * torch.pi * away
    return magnitudes * torch.cos(phases), magnitudes * torch.sin(phases)


def together(*images: Images) -> Images:
    """All of several images."""
    return Images(np.concatenate([each.middles for each in images]), np.concatenate([each.signs for each in images]))


def gateway_and_first_images(
    gateway: Float[np.ndarray, " 3"], region: Float[np.ndarray, "2 3"], wavelength: float
) -> Images:
    """The gateway itself, and its images in planes beyond itself and the transmitters, on all six sides."""
    found = [Images(gateway[None], np.ones((1, 3)))]
    for axis, up in product(range(3), (1, -1)):
        ends = up * np.array([gateway[axis], *region[:, axis]])
        planes = up * (ends.max() + plane_distances(wavelength))
        middles = np.tile(gateway, (len(planes), 1))
        middles[:, axis] = 2 * planes - gateway[axis]
        signs = np.ones_like(middles)
        signs[:, axis] = -1
        found.append(Images(middles, signs))
    return together(*found)


def second_images(
    first: Images, strengths: Float[np.ndarray, " J"], region: Float[np.ndarray, "2 3"], wavelength: float
) -> tuple[Images, Images]:
    """Images in two planes, of the strongest ones along each axis if they are perpendicular."""
    gateway = first.middles[0]
    strongest = []
    for axis in range(3):
        along = first.signs[:, axis] < 0
        places = first.middles[along, axis]
        strongest.append(places[strongest_apart(places, strengths[along], APART * wavelength)])
    perpendicular, parallel = [], []
    for one, other in combinations(range(3), 2):
        for a, b in product(strongest[one], strongest[other]):
            middle, sign = gateway.copy(), np.ones(3)
            middle[[one, other]], sign[[one, other]] = (a, b), -1
            perpendicular.append(Images(middle[None], sign[None]))
    for axis, up in product(range(3), (1, -1)):
        extent = np.ptp([gateway[axis], *region[:, axis]])
        middles = np.tile(gateway, (len(plane_distances(wavelength)), 1))
        middles[:, axis] += up * 2 * (extent + plane_distances(wavelength))
        parallel.append(Images(middles, np.ones_like(middles)))
    none = Images(np.zeros((0, 3)), np.zeros((0, 3)))
    return together(none, *perpendicular), together(*parallel)


def plane_distances(wavelength: float) -> Float[np.ndarray, " P"]:
    """Distances of planes from the nearest possible one, metres: denser in front."""
    growth = GROWTH * wavelength
    count = int(growth / (STEP * wavelength) * np.log1p(FAR / growth))
    return growth * np.expm1(np.arange(count) * STEP * wavelength / growth)


def strongest_apart(
    coordinates: Float[np.ndarray, " n"], strengths: Float[np.ndarray, " n"], apart: float
) -> list[int]:
    """Indices of the strongest of some points on an axis, which are more than ``apart`` from each other."""
    chosen: list[int] = []
    for index in np.argsort(-strengths, kind="stable").tolist():
        if strengths[index] > 0 and all(abs(coordinates[index] - coordinates[other]) > apart for other in chosen):
            chosen.append(index)
    return chosen[:STRONGEST]
