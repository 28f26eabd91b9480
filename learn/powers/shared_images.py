"""Mirror images of several gateways in the planes of one room."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations, product

import numpy as np
import torch
from jaxtyping import Bool, Complex, Float, Int

from learn.models.images.mirror_images import APART, image_waves, plane_distances, strongest_apart


@dataclass(frozen=True)
class SharedImages:
    """Image j of each of G gateways is in the same planes."""

    middles: Float[np.ndarray, "G J 3"]  # positions of the images, metres, world frame
    sent: Bool[np.ndarray, "G J"]  # whether the gateway has this image. One behind the plane has none.
    # axis of the plane of each image, 0 to 2; −1 for the gateways themselves and images in two planes
    axes: Int[np.ndarray, " J"]
    planes: Float[np.ndarray, " J"]  # coordinate of the plane on this axis, metres

    def of(self, which: Bool[np.ndarray, " J"]) -> SharedImages:
        """Some of the images."""
        return SharedImages(self.middles[:, which], self.sent[:, which], self.axes[which], self.planes[which])

    def waves(self, positions: Float[np.ndarray, "n 3"], wavelength: float) -> Complex[np.ndarray, "G n J"]:
        """The spherical waves e^{−jkR}/R of the images, R in wavelengths."""
        at, length = torch.from_numpy(np.asarray(positions, float)), torch.tensor(wavelength, dtype=torch.float64)
        point = torch.zeros(1, 3, dtype=torch.float64)
        found = []
        for middles, sent in zip(self.middles, self.sent, strict=True):
            of = torch.from_numpy(middles)
            real, imaginary = image_waves(at, of, torch.ones_like(of), point, length)
            found.append(torch.complex(real, imaginary)[:, 0].numpy() * sent)
        return np.stack(found)


def together(*images: SharedImages) -> SharedImages:
    """All of several images."""
    return SharedImages(
        np.concatenate([each.middles for each in images], axis=1),
        np.concatenate([each.sent for each in images], axis=1),
        np.concatenate([each.axes for each in images]),
        np.concatenate([each.planes for each in images]),
    )


def images_in_one_plane(
    gateways: Float[np.ndarray, "G 3"], region: Float[np.ndarray, "2 3"], wavelength: float
) -> SharedImages:
    """The gateways themselves, and their images in planes beyond the transmitters, on all six sides.

    >>> images = images_in_one_plane(np.array([[0.0, 0, 0], [3, 0, 0]]), np.array([[1.0, 0, 0], [2, 1, 1]]), 0.3)
    >>> images.middles[:, 1].tolist(), images.sent[:, 1].tolist()  # the plane x = 2 m: one gateway is behind it
    ([[4.0, 0.0, 0.0], [1.0, 0.0, 0.0]], [True, False])
    """
    count = len(gateways)
    itself = np.array([-1]), np.zeros(1)
    found = [SharedImages(gateways[:, None], np.ones((count, 1), bool), *itself)]
    for axis, up in product(range(3), (1, -1)):
        planes = up * ((up * region[:, axis]).max() + plane_distances(wavelength))
        middles = np.repeat(gateways[:, None], len(planes), axis=1)
        middles[:, :, axis] = 2 * planes - gateways[:, axis, None]
        sent = up * planes > up * gateways[:, axis, None]
        found.append(SharedImages(middles, sent, np.full(len(planes), axis), planes))
    return together(*found)


def images_in_two_planes(
    gateways: Float[np.ndarray, "G 3"],
    first: SharedImages,
    strengths: Float[np.ndarray, " J"],
    region: Float[np.ndarray, "2 3"],
    wavelength: float,
) -> tuple[SharedImages, SharedImages]:
    """Images in two planes, of the strongest ones along each axis if they are perpendicular."""
    count = len(gateways)
    perpendicular, parallel = [], []
    strongest = []
    for axis in range(3):
        along = np.flatnonzero(first.axes == axis)
        strongest.append(along[strongest_apart(first.planes[along], strengths[along], APART * wavelength / 2)])
    for one, other in combinations(range(3), 2):
        for a, b in product(strongest[one], strongest[other]):
            middles = gateways.copy()
            middles[:, one], middles[:, other] = first.middles[:, a, one], first.middles[:, b, other]
            sent = first.sent[:, a] & first.sent[:, b]
            perpendicular.append(SharedImages(middles[:, None], sent[:, None], np.array([-1]), np.zeros(1)))
    for axis, up in product(range(3), (1, -1)):
        shifts = 2 * up * (np.ptp(region[:, axis]) + plane_distances(wavelength))
        middles = np.repeat(gateways[:, None], len(shifts), axis=1)
        middles[:, :, axis] += shifts
        nowhere = np.full(len(shifts), -1), np.zeros(len(shifts))
        parallel.append(SharedImages(middles, np.ones((count, len(shifts)), bool), *nowhere))
    none = first.of(np.zeros(len(first.planes), bool))
    return together(none, *perpendicular), together(*parallel)
