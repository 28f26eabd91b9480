"""The search for the gateway's mirror images in known responses."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import torch
from jaxtyping import Complex, Float, Int
from scipy.linalg import cholesky, solve_triangular
from scipy.spatial.transform import Rotation

from learn.models.base import Report, SpectrumModel
from learn.models.images.image_strengths import Strengths, log_likelihood, most_likely
from learn.models.images.mirror_images import Images, gateway_and_first_images, image_waves, second_images, together
from simulate.dataset.dataset import Dataset

ITERATIONS, ROUGH = 30, 4
"""Iterations of ``most_likely`` for the images in one plane, and again with those in two; or for a likelihood alone."""

OF_REST, NUGGET = 2.0, 0.05
"""Length over which the rest is alike, wavelengths, and its nugget, as long as they are not fitted."""

IMAGES, REST = 0.7, 0.3
"""Shares of the power that the images and the rest have at the start of the search."""

WEAK, PERPENDICULAR, PARALLEL = 1e-3, 3e-3, 3e-4
"""Variances relative to the largest one: below which an image in one plane is left out before those in two are added,
and with which the images in two perpendicular and in two parallel planes start."""


def offsets_of(dataset: Dataset) -> Float[np.ndarray, "elements 3"]:
    """Offsets of the gateway's elements from the middle of the array, metres, world frame."""
    return Rotation.from_quat(dataset.gateway_orientation).apply(dataset.wavelength * dataset.array.positions)


def waves_of(images: Images, dataset: Dataset, known: Int[np.ndarray, " n"]) -> Complex[np.ndarray, "n elements J"]:
    """``image_waves`` of a dataset's gateway at some of its positions."""
    numbers = dataset.positions[known].astype(float), images.middles, images.signs, offsets_of(dataset)
    at, middles, signs, offsets = map(torch.from_numpy, numbers)
    real, imaginary = image_waves(at, middles, signs, offsets, torch.tensor(dataset.wavelength).double())
    return torch.complex(real, imaginary).numpy()


class ImageSearch:
    """Known responses, in which images in planes along the axes of their world frame are looked for.

    What images do not explain is correlated between near positions. Responses and waves are therefore multiplied by the
    inverse root of its covariance, as it is assumed, which makes it independent.
    """

    def __init__(self, dataset: Dataset, known: Int[np.ndarray, " n"]):
        assert dataset.responses is not None
        self._dataset, self._known = dataset, known
        positions = dataset.positions[known].astype(float)
        self._region = np.stack([positions.min(axis=0), positions.max(axis=0)])
        gateway = np.asarray(dataset.gateway_position, float)
        self._first = gateway_and_first_images(gateway, self._region, dataset.wavelength)
        apart = np.linalg.norm(positions[:, None] - positions, axis=-1) / dataset.wavelength
        alike = np.sinc(2 * apart) * np.exp(-apart / OF_REST) + NUGGET * np.eye(len(positions))
        self._root = cholesky(alike, lower=True)
        self._data = self._white(dataset.responses[known].astype(complex))[:, 0]
        self._power = float((np.abs(self._data) ** 2).mean())

    def likelihood(self) -> float:
        """Log-likelihood of each response, roughly, with the most likely images in one plane."""
        if not self._power:  # dark responses tell nothing
            return 0.0
        found = self._in_one_plane(ROUGH)
        return log_likelihood(self._of_first, self._data, found.variances, found.noise)

    def found(self, report: Report = SpectrumModel.report) -> tuple[Images, Complex[np.ndarray, " J"]]:
        """The images and their amplitudes: first those in one plane are looked for, then those in two."""
        report("mirror images", 0, 2)
        first, found = self._first, self._in_one_plane(ITERATIONS)
        if not found.variances.any():
            return first.of(found.variances > 0), np.zeros(0, complex)
        report("mirror images", 1, 2)
        perpendicular, parallel = second_images(first, found.variances, self._region, self._dataset.wavelength)
        strong = found.variances > WEAK * found.variances.max()
        images = together(first.of(strong), perpendicular, parallel)
        shares = np.repeat([PERPENDICULAR, PARALLEL], [len(perpendicular), len(parallel)])
        start = np.append(found.variances[strong], shares * found.variances.max())
        found = most_likely(self._waves(images), self._data, start, found.noise, ITERATIONS)
        used = found.variances > 0
        return images.of(used), found.amplitudes[used]

    def _in_one_plane(self, iterations: int) -> Strengths:
        if not self._power:
            nothing = np.zeros(len(self._first))
            return Strengths(nothing, 0.0, nothing.astype(complex))
        even = IMAGES * self._power / float((np.abs(self._of_first) ** 2).mean()) / len(self._first)
        start = np.full(len(self._first), even)
        return most_likely(self._of_first, self._data, start, REST * self._power, iterations)

    @cached_property
    def _of_first(self) -> Complex[np.ndarray, "N J"]:
        return self._waves(self._first)

    def _waves(self, images: Images) -> Complex[np.ndarray, "N J"]:
        return self._white(waves_of(images, self._dataset, self._known))

    def _white(self, values: Complex[np.ndarray, "n elements *J"]) -> Complex[np.ndarray, "N J"]:
        """Values without the correlation of what images do not explain, of all positions and elements in one column."""
        white = solve_triangular(self._root, values.reshape(len(values), -1), lower=True)
        return white.reshape(values.shape[0] * values.shape[1], -1)
