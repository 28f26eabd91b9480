"""The search for the gateway's mirror images in known responses, and how strong each of many waves is."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np
import torch
from jaxtyping import Complex, Float, Int, Num
from scipy.linalg import cho_factor, cho_solve, cholesky, solve_triangular
from scipy.spatial.transform import Rotation

from learn.models.base import Report, SpectrumModel
from learn.models.images.mirror_images import Images, gateway_and_first_images, image_waves, second_images, together
from simulate.dataset.dataset import Dataset

WEAKEST = 1e-6  # variance, relative to the largest one, below which a wave is left out

LEAST_POWER = 1e-9
"""Mean power of a wave, relative to the data's, below which it is left out, even if it is the strongest."""

LEAST_NOISE = 1e-6  # smallest variance of the noise, relative to the data's


class Strengths(NamedTuple):
    """What was found of J waves."""

    variances: Float[np.ndarray, " J"]  # γ of each wave, 0 if it is left out
    noise: float  # σ²
    amplitudes: Complex[np.ndarray, " J"]  # the expected x of each wave, given the data


def most_likely(
    waves: Complex[np.ndarray, "N J"],
    data: Complex[np.ndarray, " N"],
    start: Float[np.ndarray, " J"],
    noise: float,
    iterations: int,
) -> Strengths:
    """Find the strengths of waves in data: sparse Bayesian learning [tipping2001].

    The data are ``y = W x + n``. The amplitudes x_j are independent and Gaussian with the variances γ_j, and the noise
    n has the variance σ². So y has the covariance ``C = W diag(γ) Wᴴ + σ² I``. The γ that maximise its likelihood are
    mostly zero, so that few waves are left. Each iteration multiplies γ_j by ``|w_jᴴ C⁻¹ y| / √(w_jᴴ C⁻¹ w_j)``, which
    never lowers the likelihood [wipf2010], and sets σ² to what the waves leave.
    """
    power = float((np.abs(data) ** 2).mean())
    if not power:
        return Strengths(np.zeros(len(start)), 0.0, np.zeros(len(start), complex))
    left, variances = np.arange(len(start)), start
    for iteration in range(iterations + 1):
        powers = variances * (np.abs(waves) ** 2).mean(axis=0)
        strong = (variances > WEAKEST * variances.max()) & (powers > LEAST_POWER * power)
        if not strong.any():  # data that are no such waves
            return Strengths(np.zeros(len(start)), power, np.zeros(len(start), complex))
        left, variances, waves = left[strong], variances[strong], waves[:, strong]
        amplitudes, ratios = expected_amplitudes(waves, data, variances, noise)
        if iteration == iterations:
            break
        unexplained = float((np.abs(data - waves @ amplitudes) ** 2).sum())
        determined = float((variances * ratios).sum())  # number of amplitudes that the data determine
        noise = max(unexplained / max(len(data) - determined, 1.0), LEAST_NOISE * power)
        variances = np.abs(amplitudes) / np.sqrt(ratios)
    found, expected = np.zeros(len(start)), np.zeros(len(start), complex)
    found[left], expected[left] = variances, amplitudes
    return Strengths(found, noise, expected)


def log_likelihood(
    waves: Complex[np.ndarray, "N J"], data: Complex[np.ndarray, " N"], variances: Float[np.ndarray, " J"], noise: float
) -> float:
    """Log-likelihood of data that are waves with these variances and noise, without its constant, over N."""
    factor, lower = cho_factor((waves * variances) @ waves.conj().T + noise * np.eye(len(data)))
    explained = (data.conj() @ cho_solve((factor, lower), data)).real
    return float(-2 * np.log(np.diag(factor).real).mean() - explained / len(data))


def expected_amplitudes(
    waves: Num[np.ndarray, "N J"], data: Num[np.ndarray, " N"], variances: Float[np.ndarray, " J"], noise: float
) -> tuple[Num[np.ndarray, " J"], Float[np.ndarray, " J"]]:
    """The expected amplitudes γ Wᴴ C⁻¹ y, and w_jᴴ C⁻¹ w_j, by the smaller of two systems of equations."""
    if len(data) <= len(variances):
        factor = cho_factor((waves * variances) @ waves.conj().T + noise * np.eye(len(data)))
        ratios = (waves.conj() * cho_solve(factor, waves)).real.sum(axis=0)
        return variances * (waves.conj().T @ cho_solve(factor, data)), ratios
    roots = np.sqrt(variances)
    scaled = waves * roots
    inverse = cho_solve(cho_factor(scaled.conj().T @ scaled / noise + np.eye(len(roots))), np.eye(len(roots)))
    amplitudes = roots * (inverse @ (scaled.conj().T @ data)) / noise
    return amplitudes, np.maximum(1 - np.diag(inverse).real, 1e-12) / variances


ITERATIONS, ROUGH = 30, 4
"""Iterations of ``most_likely`` for the images in one plane, and again with those in two; or for a likelihood alone."""

OF_REST, NUGGET = 2.0, 0.05
"""Length over which the rest is alike, wavelengths, and its nugget, as long as they are not fitted."""

IMAGES, REST = 0.7, 0.3  # shares of the power that the images and the rest have at the start of the search

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

    Responses and waves are multiplied by the inverse root of the assumed covariance of what images do not explain.
    """

    def __init__(self, dataset: Dataset, known: Int[np.ndarray, " n"]):
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
