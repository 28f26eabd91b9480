"""Waves of the gateway's mirror images in the planes of a room, and kriging of the rest."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import torch
from jaxtyping import Complex, Float, Int
from scipy.linalg import cholesky, solve_triangular
from scipy.spatial.transform import Rotation
from torch import Tensor

from learn.models.capabilities import PredictsResponses
from learn.models.image_strengths import most_likely
from learn.models.kriged_field import KrigedField
from learn.models.mirror_images import Images, gateway_and_first_images, second_images, together
from scenes.files.errors import InputError
from simulate.dataset.dataset_folder import Dataset
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import evenly

FITTED_ON = 128
"""Largest number of known spectra, evenly spread, in which the images are found."""

ITERATIONS = 30
"""Iterations of ``most_likely`` for the images in one plane, and again with those in two."""

OF_REST, NUGGET = 2.0, 0.05
"""Length over which the rest is alike, wavelengths, and its nugget, as long as they are not fitted."""

IMAGES, REST = 0.7, 0.3
"""Shares of the power that the images and the rest have at the start of the search."""

WEAK, PERPENDICULAR, PARALLEL = 1e-3, 3e-3, 3e-4
"""Variances relative to the largest one: below which an image in one plane is left out before those in two are added,
and with which the images in two perpendicular and in two parallel planes start."""


class ImageField(PredictsResponses):
    """Adds up waves of the gateway and of its mirror images, and adds kriging of what these do not explain.

    A wall that reflects a wave makes it look as if it came from a mirror image of its source. By reciprocity, the
    gateway's images in the planes of a room send spherical waves to the transmitter. Element m at offset d_m has in the
    image with the middle c_j and the signs S_j of its coordinates the place ``c_j + S_j d_m``, so its response is::

        y_m(r) = Σ_j x_j e^{−jk R}/R + e_m(r),   R = |r − c_j − S_j d_m|

    One amplitude x_j thus explains all elements at all positions. j runs over the gateway itself and its images in
    planes at hundreds of distances, and then over those in two planes, of which the second repeat the strongest of the
    first. ``most_likely`` finds the strengths of them all; most are zero. ``KrigedField`` interpolates the rest e.
    Nothing is told of the room but the directions of its walls: they are assumed to lie along the axes of the world
    frame. Other surfaces are left to the rest.

    Args:
        region: as for ``SpectrumModel``; this model does not use it.
        beamformer: the dataset's array and grid.
        wavelength: metres.

    Attributes:
        images: the gateway and its images that have an amplitude; none before ``fit``.
        amplitudes: x_j, for distances in wavelengths.
        rest: the field that interpolates e.
        power: mean of ``|e|²`` over the known spectra and elements.
    """

    def __init__(self, region: Float[np.ndarray, "2 3"], beamformer: Beamformer, wavelength: float):
        super().__init__(region, beamformer, wavelength)
        self._offsets = wavelength * beamformer.array.positions
        self.images = Images(np.zeros((0, 3)), np.zeros((0, 3)))
        self.amplitudes: Complex[np.ndarray, " J"] = np.zeros(0, complex)
        self.rest = KrigedField(region, beamformer, wavelength, "responses")
        self.power = 0.0

    def responses(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B elements 2"]:
        """Element responses y (real, imaginary), in the units of the known ones.

        Args:
            positions: transmitter positions, metres, world frame.
        """
        waves = self._waves(self.images, positions.cpu().numpy().astype(float)) @ self.amplitudes
        explained = torch.view_as_real(torch.from_numpy(waves)).to(positions)
        return explained + self.power**0.5 * self.rest.responses(positions)

    def fit(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> str:
        """Find the images in the known responses, and fit the covariance of the rest.

        Args:
            dataset: a dataset with responses.
            known: indices of the spectra to fit to.

        Returns:
            The share of the power that the images explain, as a sentence for the user.

        Raises:
            InputError: the dataset has no responses, or its receiver moves.
        """
        if dataset.responses is None:
            raise InputError(f"{dataset.folder}: expected element responses, which the images explain, found pictures")
        known = np.unique(known)
        self._offsets = Rotation.from_quat(dataset.gateway_orientation).apply(self._offsets)
        responses = dataset.responses[known].astype(complex)
        self._find_images(dataset, evenly(known, FITTED_ON))
        rest = responses - self._waves(self.images, dataset.positions[known]) @ self.amplitudes
        everywhere = np.zeros_like(dataset.responses)
        everywhere[known] = rest
        self.power = float((np.abs(everywhere[known]) ** 2).mean())
        self.rest.report = self.report  # type: ignore[method-assign]
        self.rest.fit(replace(dataset, responses=everywhere), known)
        explained = 1 - self.power / max(float((np.abs(responses) ** 2).mean()), 1e-300)
        return f"the gateway and {max(len(self.images) - 1, 0)} images of it explain {explained:.0%} of the power"

    def _waves(
        self, images: Images, positions: Float[np.ndarray, "n 3"]
    ) -> Complex[np.ndarray, "n elements J"]:
        return images.waves(positions, self._offsets, float(self.wavelength))

    def _find_images(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> None:
        """Set ``images`` and ``amplitudes``: first those in one plane, then those in two."""
        assert dataset.responses is not None
        positions, wavelength = dataset.positions[known], float(self.wavelength)
        gateway = np.asarray(dataset.gateway_position, float)
        region = np.stack([positions.min(axis=0), positions.max(axis=0)])
        white = self._whitened(positions)
        data = white(dataset.responses[known].astype(complex)).ravel()
        if not data.any():
            return

        def waves(images: Images) -> Complex[np.ndarray, "N J"]:
            return white(self._waves(images, positions)).reshape(len(data), -1)

        power = float((np.abs(data) ** 2).mean())
        self.report("mirror images", 0, 2)
        first = gateway_and_first_images(gateway, region, wavelength)
        of_first = waves(first)
        even = np.full(len(first), IMAGES * power / float((np.abs(of_first) ** 2).mean()) / len(first))
        found = most_likely(of_first, data, even, REST * power, ITERATIONS)
        self.report("mirror images", 1, 2)
        perpendicular, parallel = second_images(first, found.variances, region, wavelength)
        strong = found.variances > WEAK * found.variances.max()
        images = together(first.of(strong), perpendicular, parallel)
        shares = np.repeat([PERPENDICULAR, PARALLEL], [len(perpendicular), len(parallel)])
        start = np.append(found.variances[strong], shares * found.variances.max())
        found = most_likely(waves(images), data, start, found.noise, ITERATIONS)
        used = found.variances > 0
        self.images, self.amplitudes = images.of(used), found.amplitudes[used]

    def _whitened(
        self, positions: Float[np.ndarray, "n 3"]
    ) -> Callable[[Complex[np.ndarray, "n *shape"]], Complex[np.ndarray, "n *shape"]]:
        """The function that makes values with the covariance of the rest, as it is assumed, independent."""
        apart = np.linalg.norm(positions[:, None] - positions, axis=-1) / float(self.wavelength)
        alike = np.sinc(2 * apart) * np.exp(-apart / OF_REST) + NUGGET * np.eye(len(positions))
        root = cholesky(alike, lower=True)
        return lambda values: solve_triangular(root, values.reshape(len(values), -1), lower=True).reshape(values.shape)
