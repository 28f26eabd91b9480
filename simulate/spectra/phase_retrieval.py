"""The element responses behind a spectrum, found by phase retrieval.

A magnitude spectrum determines the responses y of a planar array up to a common phase and the flip y_m -> y*_{MN−1−m}.
Both leave all lags R_Δ = Σ_{m−n=Δ} y_m y_n* unchanged. Apart from these two, the autocorrelation of a finite
two-dimensional sequence determines the sequence [hayes1982].

The Levenberg–Marquardt method finds y from random starts in two stages. The first is a small problem: it fits the lags
of y to those of the spectrum. The second refines y so that |A y| is the spectrum itself at some hundred directions.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float

from scenes.files.errors import require_instance, require_seed
from simulate.spectra.angular_grid import COLUMNS
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.lags import fit_lags, lag_vectors
from simulate.spectra.spectrum import LARGEST_GREY, check_stack

STARTS, ROUNDS = 8, 16
"""Random starts per round, and the largest number of rounds. Spectra that failed are tried again in the next round."""

GOOD = 0.5
"""Grey levels. A spectrum is done when its root mean square error is smaller than this."""

LAG_STEPS, POLISHING_STEPS = 40, 8
"""Steps of the Levenberg–Marquardt method in the two stages."""

DIRECTIONS = 700
"""Number of pixels, evenly spread over the hemisphere, that the second stage uses."""

AT_ONCE = 100
"""Spectra per batch. This bounds the memory."""

Residual = Callable[[Float[np.ndarray, "B n"]], tuple[Float[np.ndarray, "B m"], Float[np.ndarray, "B m n"]]]
"""A function of B vectors of unknowns that returns their residuals and the derivatives of these."""


@dataclass(frozen=True)
class Retrieval:
    """Responses retrieved from K spectra.

    Attributes:
        responses: complex element responses, up to a common phase and the flip, [K, elements]; in units in which the
            spectrum's span is 1.
        residual: root mean square error of the spectrum that these responses make, grey levels of 255, [K]. Above
            ``GOOD`` (0.5) the retrieval is doubtful.
    """

    responses: Complex[np.ndarray, "K elements"]
    residual: Float[np.ndarray, " K"]


def retrieve_responses(spectra: Float[np.ndarray, "K 90 360"], beamformer: Beamformer, seed: int = 0) -> Retrieval:
    """Find the complex element responses behind normalised spectra (phase retrieval).

    A magnitude spectrum determines the responses y of a planar array up to a common phase and the flip
    ``y_m -> conj(y_{MN−1−m})`` [hayes1982]. So the responses of one spectrum can be used, but phases of two spectra
    cannot be compared. The Levenberg–Marquardt method finds the responses from random starts.

    Args:
        spectra: K min–max normalised spectra, 0…1, [K, 90, 360].
        beamformer: the array that measured the spectra, and their grid.
        seed: seed of the random starts.

    Returns:
        A ``Retrieval`` with two arrays: ``responses``, complex, [K, elements], in units in which the spectrum's span is
        1; and ``residual``, the root mean square error of the spectrum that these responses make, grey levels of 255,
        [K]. The rounding to 8 bits leaves about 0.3; above 0.5 the retrieval is doubtful.

    Raises:
        ParameterError: the spectra are not a stack of finite numbers from 0 to 1, or the seed is not valid.

    Example:
        >>> import bisplat
        >>> dataset = bisplat.read_dataset("data/lab")
        >>> found = bisplat.retrieve_responses(dataset.spectra[:2], dataset.beamformer)
        >>> found.responses.shape, bool((found.residual < 0.5).all())
        ((2, 16), True)
    """
    require_instance(Beamformer, beamformer=beamformer)
    require_seed(seed=seed)
    spectra = check_stack("spectra", spectra)
    generator = np.random.default_rng(seed)
    array = beamformer.array
    steering, row, column = _some_directions(beamformer)
    responses = np.zeros((len(spectra), array.elements), complex)
    residual = np.full(len(spectra), np.inf)
    for first in range(0, len(spectra), AT_ONCE):
        batch = slice(first, first + AT_ONCE)
        fitted = fit_lags(spectra[batch], beamformer)
        values = spectra[batch][:, row, column].astype(np.float64)
        for _ in range(ROUNDS):
            missing = np.flatnonzero(residual[batch] > GOOD)
            if not len(missing):
                break
            found = _from_lags(fitted.lags[missing], array, generator)
            found, error = _polished(found, fitted.offset[missing], values[missing], steering)
            better = error < residual[batch][missing]
            responses[first + missing[better]], residual[first + missing[better]] = found[better], error[better]
    return Retrieval(responses, residual)


def _some_directions(beamformer: Beamformer) -> tuple[Complex[np.ndarray, "P elements"], np.ndarray, np.ndarray]:
    """Steering vectors of pixels spread evenly over the hemisphere, with the pixels' rows and columns."""
    index = np.arange(DIRECTIONS) + 0.5
    elevation, azimuth = np.degrees(np.arcsin(index / DIRECTIONS)), np.degrees(np.pi * (1 + 5**0.5) * index) % 360
    grid = beamformer.grid
    row = np.abs(grid.elevations_deg - elevation[:, None]).argmin(axis=1)
    column = np.round(azimuth / grid.azimuth_step_deg).astype(int) % COLUMNS
    row, column = np.unique(np.stack([row, column]), axis=1)
    return beamformer.steering[row, column], row, column


def _from_lags(
    lags: Complex[np.ndarray, "K L"], array: PlanarArray, generator: np.random.Generator
) -> Complex[np.ndarray, "K elements"]:
    """Responses with these lags: the best result of several random starts."""
    count, elements = len(lags), array.elements
    x, y = np.arange(elements) % array.columns, np.arange(elements) // array.columns
    difference = np.stack([x[:, None] - x, y[:, None] - y], axis=-1)  # from element n to element m
    pairs = (difference == lag_vectors(array)[:, None, None]).all(axis=-1).astype(float)  # [L, m, n]
    wanted = np.repeat(lags, STARTS, axis=0)

    def residual(unknowns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        responses = unknowns[:, :elements] + 1j * unknowns[:, elements:]
        # R_Δ = Σ_mn P_Δmn y_m y_n*, and its derivatives by y_m and y_n*
        by_y = (responses.conj() @ pairs.reshape(-1, elements).T).reshape(len(responses), -1, elements)
        by_conjugate = (responses @ pairs.transpose(0, 2, 1).reshape(-1, elements).T).reshape(by_y.shape)
        error = (by_y * responses[:, None]).sum(axis=-1) - wanted
        derivative = np.concatenate([by_y + by_conjugate, 1j * (by_y - by_conjugate)], axis=-1)
        return _as_real(error), _as_real(derivative.transpose(0, 2, 1)).transpose(0, 2, 1)

    power = np.repeat(np.abs(lags[:, 0]), STARTS)[:, None]
    start = generator.standard_normal((count * STARTS, 2 * elements)) * np.sqrt(power / (2 * elements))
    unknowns, cost = _levenberg_marquardt(residual, start, LAG_STEPS)
    best = cost.reshape(count, STARTS).argmin(axis=1) + STARTS * np.arange(count)
    return unknowns[best, :elements] + 1j * unknowns[best, elements:]


def _as_real(lags: Complex[np.ndarray, "*shape L"]) -> Float[np.ndarray, "*shape F"]:
    """Real parts, then imaginary parts; the lag zero is real."""
    return np.concatenate([lags.real, lags.imag[..., 1:]], axis=-1)


def _polished(
    responses: Complex[np.ndarray, "K elements"],
    offset: Float[np.ndarray, " K"],
    values: Float[np.ndarray, "K P"],
    steering: Complex[np.ndarray, "P elements"],
) -> tuple[Complex[np.ndarray, "K elements"], Float[np.ndarray, " K"]]:
    """Responses with |A y| = p + b, from good starts, and their root mean square errors, grey levels."""
    elements = responses.shape[1]

    def residual(unknowns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        field = (unknowns[:, :elements] + 1j * unknowns[:, elements:-1]) @ steering.T
        magnitude = np.abs(field)
        towards = (field.conj() / np.maximum(magnitude, 1e-12))[..., None] * steering
        derivative = np.concatenate([towards.real, -towards.imag, np.full((*field.shape, 1), -1.0)], axis=-1)
        return magnitude - values - unknowns[:, -1:], derivative

    start = np.concatenate([responses.real, responses.imag, offset[:, None]], axis=1)
    unknowns, cost = _levenberg_marquardt(residual, start, POLISHING_STEPS)
    error = LARGEST_GREY * np.sqrt(cost / values.shape[1])
    return unknowns[:, :elements] + 1j * unknowns[:, elements:-1], error


def _levenberg_marquardt(
    residual: Residual, start: Float[np.ndarray, "B n"], steps: int
) -> tuple[Float[np.ndarray, "B n"], Float[np.ndarray, " B"]]:
    """Minimise B sums of squares at once, and return the unknowns and the sums; a step that raises a sum is undone."""
    unknowns, damping = start, np.full(len(start), 0.1)
    error, derivative = residual(unknowns)
    cost = (error**2).sum(axis=1)
    identity = np.eye(start.shape[1])
    for _ in range(steps):
        normal = derivative.transpose(0, 2, 1) @ derivative
        scale = damping * np.trace(normal, axis1=1, axis2=2) / len(identity) + 1e-30
        gradient = (derivative.transpose(0, 2, 1) @ error[..., None])[..., 0]
        step = np.linalg.solve(normal + scale[:, None, None] * identity, -gradient[..., None])[..., 0]
        new_error, new_derivative = residual(unknowns + step)
        new_cost = (new_error**2).sum(axis=1)
        lower = new_cost < cost
        unknowns = np.where(lower[:, None], unknowns + step, unknowns)
        error, cost = np.where(lower[:, None], new_error, error), np.where(lower, new_cost, cost)
        derivative = np.where(lower[:, None, None], new_derivative, derivative)
        damping = np.where(lower, 0.3 * damping, 4 * damping).clip(1e-9, 1e9)
    return unknowns, cost
