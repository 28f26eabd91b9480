"""Kriging of the element responses behind pictures, and their phases, by which all responses form one field.

A picture determines the responses y_n at a position up to a factor z_n and a flip y_m → y*_{MN−1−m}. Kriging predicts
them from the nearest others, a_n = Σ w* z y with the error variance v. The best factor and flip of one position, given
all others, maximise

    −|a_n − z y_n|² / v + 2 MN log |z|

(the last term is the Jacobian of the scaling). They are found for one position after another until the field no longer
changes.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Bool, Complex, Float, Int
from scipy.spatial import cKDTree

from learn.models.kriging.kriged_field import KrigedField
from simulate.dataset.dataset import Dataset
from simulate.spectra.element_array import uniform
from simulate.spectra.phase_retrieval import retrieve_responses
from simulate.spectra.spectrum import spectrum_of

Covariance = Callable[[Int[np.ndarray, " a"], Int[np.ndarray, " b"]], Complex[np.ndarray, "a b"]]
"""Function from the indices of known positions to the covariance κ between them, without noise."""

NEIGHBOURS = 48  # number of nearest other positions from which each position is predicted
FIRST_NEIGHBOURS = 24  # the same while the first factors are found

FEW, STARTS = 4, 4
"""Number of neighbours that decide which position is next, and number of positions from which the first factors are
found. The most likely result is kept."""

SWEEPS = 40  # largest number of passes over all positions
LEAST_CHANGE = 1e-3  # a pass is the last one if it changes the field by less than this, relative to its norm


def synchronised(
    responses: Complex[np.ndarray, "n elements"],
    positions: Float[np.ndarray, "n 3"],
    covariance: Covariance,
    nugget: float,
    flips: bool = True,
) -> Complex[np.ndarray, "n elements"]:
    """Responses with the factors and flips that most likely make them one field."""
    norm = np.linalg.norm(responses, axis=1, keepdims=True) / np.sqrt(responses.shape[1])
    either = np.stack([responses, flipped(responses) if flips else responses]) / np.where(norm > 0, norm, 1)
    _, near = cKDTree(positions).query(positions, [*range(1, min(NEIGHBOURS + 1, len(positions)) + 1)])
    others = [row[row != member][:NEIGHBOURS] for member, row in enumerate(near)]
    weights = [_weights(np.array([member]), row, covariance, nugget) for member, row in enumerate(others)]
    apart = [np.linalg.norm(positions[row] - positions[member], axis=-1) for member, row in enumerate(others)]
    densest = np.argsort([each[:FEW].sum() for each in apart])
    found = []
    for start in densest[:: max(1, len(densest) // STARTS)][:STARTS]:
        field = _outwards(int(start), either, others, apart, covariance, nugget)
        found.append(_swept(field, either, others, weights))
    _, field = max(found, key=lambda each: each[0])
    return field


def _swept(
    field: Complex[np.ndarray, "n elements"],
    either: Complex[np.ndarray, "2 n elements"],
    others: list[Int[np.ndarray, " k"]],
    weights: list[tuple[Complex[np.ndarray, " k"], float]],
) -> tuple[float, Complex[np.ndarray, "n elements"]]:
    """The best factors and flips, improved from given ones, and how likely they are (the sum of the terms above)."""
    order = np.random.default_rng(0).permutation(len(field))
    for _ in range(SWEEPS):
        before = field.copy()
        for member in order:
            weight, variance = weights[member]
            field[member] = _best(either[:, member], weight.conj() @ field[others[member]], variance)
        field /= np.sqrt(np.square(np.abs(field)).mean())
        if np.linalg.norm(field - before) < LEAST_CHANGE * np.linalg.norm(field):
            break
    likelihood = 0.0
    for member, (weight, variance) in enumerate(weights):
        error = field[member] - weight.conj() @ field[others[member]]
        likelihood += np.log(np.square(np.abs(field[member])).mean()) - np.square(np.abs(error)).mean() / variance
    return likelihood, field


def flipped(responses: Complex[np.ndarray, "*batch elements"]) -> Complex[np.ndarray, "*batch elements"]:
    """The other responses that have the same spectrum: y*_{MN−1−m}."""
    return responses[..., ::-1].conj()


def _outwards(
    start: int,
    either: Complex[np.ndarray, "2 n elements"],
    near: list[Int[np.ndarray, " k"]],
    apart: list[Float[np.ndarray, " k"]],
    covariance: Covariance,
    nugget: float,
) -> Complex[np.ndarray, "n elements"]:
    """First factors and flips, outwards from one position: next is always that with the nearest finished neighbours."""
    done: Bool[np.ndarray, " n"] = np.zeros(len(near), bool)
    closeness = np.full(len(near), -1.0)
    closeness[start] = np.inf
    field = either[0].copy()
    while not done.all():
        member = int(np.where(done, -np.inf, closeness).argmax())
        known = near[member][done[near[member]]][:FIRST_NEIGHBOURS]
        if len(known):
            weight, variance = _weights(np.array([member]), known, covariance, nugget)
            field[member] = _best(either[:, member], weight.conj() @ field[known], variance)
            field[member] /= np.sqrt(np.square(np.abs(field[member])).mean())  # only phases are found at first
        done[member] = True
        for other in near[member]:
            nearest = apart[other][done[near[other]]][:FEW]
            closeness[other] = (1 / np.maximum(nearest, 1e-3) ** 2).sum()
    return field


def _weights(
    member: Int[np.ndarray, " 1"], others: Int[np.ndarray, " k"], covariance: Covariance, nugget: float
) -> tuple[Complex[np.ndarray, " k"], float]:
    """Kriging weights of the others, and the variance of the error."""
    cross = covariance(others, member)[:, 0]
    weights = np.linalg.solve(covariance(others, others) + nugget * np.eye(len(others)), cross)
    return weights, float(1 + nugget - (weights.conj() @ cross).real)


def _best(
    either: Complex[np.ndarray, "2 elements"], predicted: Complex[np.ndarray, " elements"], variance: float
) -> Complex[np.ndarray, " elements"]:
    """The more likely of two responses of mean square magnitude 1, times its best factor."""
    products = either.conj() @ predicted
    chosen = int(np.abs(products).argmax())
    along = abs(products[chosen]) / len(predicted)
    # This maximises −MN (|z|² − 2 |z| along) / v + 2 MN log |z|.
    magnitude = (along + np.sqrt(along**2 + 4 * variance)) / 2
    phase = products[chosen] / abs(products[chosen]) if along > 0 else 1.0
    return magnitude * phase * either[chosen]


LEAST_RETRIEVED, MOST_RETRIEVED = 20, 1500
"""Smallest and largest number of known pictures behind which responses are looked for. Fewer do not determine the
phases, and each takes about 20 milliseconds."""

LEAST_NUGGETS = (0.03, 1e-3)
"""Least nugget of the covariance with which phases are found, for the first and the second time. With a smaller one,
early errors spread."""


def retrieved_responses(dataset: Dataset, known: Int[np.ndarray, " n"]) -> Complex[np.ndarray, "n elements"]:
    """Responses behind known pictures, each up to a factor and the flip: those in the dataset if it has them."""
    if "retrieved" in dataset.values and np.isfinite(dataset.retrieved[known]).all():
        return dataset.retrieved[known]
    return retrieve_responses(spectrum_of(dataset.pictures[known]), dataset.beamformer).responses


def with_contrast(dataset: Dataset, known: Int[np.ndarray, " n"]) -> Int[np.ndarray, " m"]:
    """The pictures with several grey levels; one of a single level contains nothing about the field."""
    return known[np.ptp(dataset.pictures[known], axis=(1, 2)) > 0]


def can_retrieve(dataset: Dataset, known: Int[np.ndarray, " n"]) -> bool:
    """Whether responses can be found behind known pictures: neither too few nor too many, of a uniform planar array."""
    if dataset.array.elements < 2 or len(known) > MOST_RETRIEVED or not_retrieved(dataset) is not None:
        return False
    return len(with_contrast(dataset, known)) >= LEAST_RETRIEVED


def not_retrieved(dataset: Dataset) -> str | None:
    """Why no responses are looked for behind the pictures of a dataset without any; None: they are, or it has some."""
    if uniform(dataset.array) is not None or "response" in dataset.values or "retrieved" in dataset.values:
        return None
    return (
        f"{dataset.folder}: no responses are looked for behind its pictures, since this needs a uniform planar array; "
        f"the dataset has {dataset.array.in_words}"
    )


def fit_to_pictures(
    field: KrigedField,
    of_spectra: KrigedField,
    responses: Complex[np.ndarray, "n elements"],
    dataset: Dataset,
    known: Int[np.ndarray, " n"],
) -> Complex[np.ndarray, "K elements"]:
    """Fit a field of responses to known pictures.

    The covariance of pictures, ``|κ|²``, shows from which directions waves come. With this κ, factors and flips are
    found that make the retrieved responses one field. Then κ is fitted to these, and both steps are repeated.
    """
    law, flips = of_spectra, uniform(dataset.array) is not None
    all_responses = np.zeros((len(dataset.positions), responses.shape[1]), complex)
    for least in LEAST_NUGGETS:
        positions = dataset.positions[known]
        responses = synchronised(responses, positions, _covariance(law), max(float(law.nugget), least), flips)
        all_responses[known] = responses
        field.fit(dataset.with_values(response=all_responses), known)
        law = field
    return all_responses


def _covariance(field: KrigedField) -> Covariance:
    """κ between the known positions of a fitted field."""
    places, times, directions, shares = (
        each.double().numpy() for each in (field.places, field.times, field.directions, field.shares)
    )
    waves = np.exp(2j * np.pi / float(field.wavelength) * places @ directions.T)
    length, drift = float(field.length), float(field.drift)

    def covariance(a: Int[np.ndarray, " a"], b: Int[np.ndarray, " b"]) -> Complex[np.ndarray, "a b"]:
        distance: Float[np.ndarray, "a b"] = np.linalg.norm(places[a][:, None] - places[b], axis=-1)
        apart = np.abs(times[a][:, None] - times[b])
        return (waves[a] * shares) @ waves[b].conj().T * np.exp(-distance / length - apart / drift)

    return covariance
