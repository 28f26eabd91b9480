"""The standard deviation of a predicted spectrum's values: how far a prediction may be off.

It grows with the distance from the known positions. Known spectra tell by how much: each is predicted once more from
those that are farther away than a radius. Validation spectra, to which the model was not
fitted, then set the scale (split conformal prediction [papadopoulos2002]).
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated, Literal

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from msgspec import Meta, Struct
from msgspec.structs import replace
from scipy.optimize import brentq, isotonic_regression
from scipy.spatial import cKDTree

from learn.models.base import SpectrumModel
from learn.models.kriging.deviation_curve import NORMAL, SHARE, size_of
from learn.models.kriging.kriged_field import KrigedField
from learn.training.prediction import predict, uncertainty
from simulate.dataset.dataset import Dataset
from simulate.spectra.spectrum import evenly, spectrum_of

LEAST_VALIDATED = 10  # Least number of validation spectra; fewer say too little about the errors

LEAST = 0.5 / 255  # Half a grey level: pictures are rounded to whole ones

EVERY = 5  # Only pixels of every so many rows and columns are compared; nearer ones have similar errors

KNOTS = 12  # Number of points of the curve of errors over distance or variance

REACH_LEAST = 2.0
"""A position is beyond all knowledge if it is at least this far from every known one, wavelengths, and farther than the
diagonal of their bounding box."""

MOST = 1000.0  # Largest coefficient of a deviation
Coefficient = Annotated[float, Meta(ge=0, le=MOST)]


class Deviation(Struct, frozen=True):
    """The deviation ``σ(r)² = min(c² + g² e(a(r))², s²)``.

    e is the curve of errors over a gap, which known spectra tell. Its argument a is the model's own relative variance
    at the position r, or the distance to the nearest known position.
    """

    constant: Coefficient  # c, in the units of a spectrum 0…1
    growth: Coefficient  # g; 0 without a curve
    spectra: Annotated[int, Meta(ge=0)]  # number of validation spectra that told c and g
    # what a is: "variance" (relative, 0…1) or "distance" (wavelengths)
    over: Literal["variance", "distance"] = "variance"
    gaps: list[Annotated[float, Meta(ge=0)]] = []  # values a of the curve's points, ascending
    errors: list[Coefficient] = []  # values e there, ascending, in the units of a spectrum
    nothing: Coefficient = MOST  # s, the deviation of knowing nothing about a position

    def at(self, gap: Float[np.ndarray, " K"] | None, count: int) -> Float[np.ndarray, " K"]:
        """Standard deviation σ at K positions."""
        a = np.zeros(count) if gap is None else gap
        squared = np.interp(a, self.gaps, np.square(self.errors)) if self.gaps else a
        return np.minimum(np.sqrt(self.constant**2 + self.growth**2 * squared), self.nothing)

    def facts(self) -> str:
        """The deviation in one sentence, for the user who trains."""
        near, far = self.at(np.array([self.gaps[1] if self.gaps else 0.0, np.inf]), 2)
        return (
            f"{self.spectra} validation spectra and gaps among the known ones tell how far predictions are off: "
            f"standard deviation {near:.3f} between known positions, {far:.3f} far from all"
        )


class Gaps(Struct, frozen=True):
    """Errors of known spectra that are predicted from those farther away than a radius, and what they depend on."""

    over: Literal["variance", "distance"]  # what ``gap`` is, as for ``Deviation``
    gap: Float[np.ndarray, " n"]  # [n] relative variance, or distance to the nearest used position (wavelengths)
    # [n] deviation of each predicted spectrum: the size that holds ``SHARE`` of its errors, over ``NORMAL``
    error: Float[np.ndarray, " n"]

    def curve(self) -> tuple[list[float], list[float]]:
        """Gaps and errors of at most ``KNOTS`` points of a curve that begins at 0 and never falls."""
        order = np.argsort(self.gap, kind="stable")
        groups = [part for part in np.array_split(order, min(KNOTS, len(np.unique(self.gap)))) if len(part)]
        gaps = np.array([self.gap[part].mean() for part in groups])
        errors = np.exp([np.log(np.maximum(self.error[part], LEAST)).mean() for part in groups])
        rising = isotonic_regression(errors).x
        return [0.0, *gaps.round(6).tolist()], [0.0, *rising.round(6).tolist()]


def pixel_errors(
    prediction: Float[np.ndarray, "K 90 360"], truth: Float[np.ndarray, "K 90 360"]
) -> Float[np.ndarray, "K P"]:
    """True minus predicted values of every ``EVERY``th row and column."""
    return (truth[:, ::EVERY, ::EVERY] - prediction[:, ::EVERY, ::EVERY]).reshape(len(truth), -1).astype(float)


def nearest_known(
    known: Float[np.ndarray, "n 3"], positions: Float[np.ndarray, "K 3"], wavelength: float
) -> Float[np.ndarray, " K"]:
    """Distance from each position to the nearest known one, wavelengths."""
    return cKDTree(known).query(positions)[0] / wavelength


def reach(known: Float[np.ndarray, "n 3"], wavelength: float) -> float:
    """Distance from the nearest known position beyond which nothing is known, wavelengths."""
    return max(REACH_LEAST, float(np.linalg.norm(np.ptp(known, axis=0))) / wavelength)


def fit_deviation(
    error: Float[np.ndarray, "K P"],
    gap: Float[np.ndarray, " K"] | None,
    over: Literal["variance", "distance"] = "variance",
    curve: tuple[list[float], list[float]] | None = None,
    nothing: float = MOST,
) -> Deviation | None:
    """The deviation of which ``SHARE`` of the errors lie within ``NORMAL`` σ.

    If the model's own errors over gaps are known, g is their scale, and c is 0. The errors of another model, which
    stands for this one, are taken as they are, and c is what this model adds to them. If it is better than the other
    one, the curve is lower as far as the validation spectra reach, and unchanged from twice that distance on.
    """
    if len(error) < LEAST_VALIDATED:
        return None
    if gap is None or curve is None:
        return Deviation(_within(float(size_of(error.ravel()))), 0.0, len(error))
    nothing = max(nothing, LEAST)
    stated = Deviation(0.0, 1.0, len(error), over, *curve, nothing)
    expected = np.maximum(np.sqrt(np.interp(gap, stated.gaps, np.square(stated.errors))), LEAST)[:, None]
    growth = float(size_of((np.abs(error) / expected).ravel()))
    if over == "variance":
        return _towards_nothing(replace(stated, constant=LEAST, growth=min(growth, MOST)))
    if growth <= 1:
        told = [float(gap.max()), max(2 * float(gap.max()), 1e-3)]
        gaps = np.union1d(stated.gaps, np.round(told, 6))
        errors = np.sqrt(np.interp(gaps, stated.gaps, np.square(stated.errors))) * np.interp(gaps, told, [growth, 1])
        return _towards_nothing(replace(stated, constant=LEAST, gaps=gaps.tolist(), errors=errors.round(6).tolist()))

    def share_outside(constant: float) -> float:
        return float(np.mean(np.abs(error) > NORMAL * np.sqrt(constant**2 + expected**2)))

    largest = float(np.abs(error).max())
    constant = brentq(lambda c: share_outside(c) - (1 - SHARE), 0.0, largest, xtol=1e-4)
    return _towards_nothing(replace(stated, constant=_within(float(constant))))


def _towards_nothing(found: Deviation) -> Deviation:
    """Let the curve end at the deviation of knowing nothing: at variance 1, or a wavelength beyond the largest gap."""
    end = found.gaps[-1] + 1.0 if found.over == "distance" else 1.0
    if end <= found.gaps[-1]:
        return found
    most = max(found.nothing / max(found.growth, LEAST), found.errors[-1])
    return replace(found, gaps=[*found.gaps, end], errors=[*found.errors, min(most, MOST)])


def _within(coefficient: float) -> float:
    return min(max(coefficient, LEAST), MOST)


RADII = (0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 5.0)  # Radii within which known spectra are left out, wavelengths

MEMBERS = 30  # Number of known spectra that are predicted for each radius

LEAST_LEFT = 8  # A prediction from fewer spectra than this tells nothing

REFERENCE = 400  # Largest number of spectra of the field that stands for a model without one of its own

UNRELATED = 1.0  # Spectra at least this far apart are unrelated, wavelengths


def errors_over_gaps(model: SpectrumModel, dataset: Dataset, train: Int[np.ndarray, " n"]) -> Gaps | None:
    """Predict known spectra from those that are farther away than a radius, and measure the errors.

    Kriging stands for a model that does not interpolate, which would have to be trained again for each radius.
    """
    if len(train) <= LEAST_LEFT:
        return None
    own = interpolates(model) and uncertainty(model, dataset.positions[train[:1]]) is not None
    if not own:
        train = evenly(train, REFERENCE)
        region, beamformer = model.region.cpu().numpy(), dataset.beamformer
        of: Literal["responses", "spectra"] = "spectra" if "response" not in dataset.values else "responses"
        model = KrigedField(region, beamformer, dataset.wavelength, of)
        model.fit(dataset, train)
    positions, wavelength = dataset.positions[train], dataset.wavelength
    members = evenly(np.arange(len(train)), MEMBERS)
    truth = spectrum_of(dataset.pictures[train[members]])
    found: list[tuple[float, float]] = []
    for radius in RADII:
        for member, true in zip(members, truth, strict=True):
            place = positions[member : member + 1]
            distance = np.linalg.norm(positions - place, axis=1)
            kept = distance > radius * wavelength + 1e-9
            if np.count_nonzero(kept) < LEAST_LEFT:
                continue
            with _without(model, place, radius * wavelength + 1e-9):
                error = size_of(pixel_errors(predict(model, place).spectra, true[None]))
                own_variance = uncertainty(model, place) if own else None
            gap = distance[kept].min() / wavelength if own_variance is None else own_variance[0]
            found.append((float(gap), float(error[0])))
    if not found:
        return None
    gap, error = np.array(found).T
    return Gaps("variance" if own else "distance", gap, error)


def knowing_nothing(
    prediction: Float[np.ndarray, "V 90 360"],
    places: Float[np.ndarray, "V 3"],
    dataset: Dataset,
    train: Int[np.ndarray, " n"],
) -> float:
    """The deviation of predictions from spectra that they have nothing to do with."""
    train = evenly(train, 4 * MEMBERS)
    truth = spectrum_of(dataset.pictures[train])
    sizes = []
    for spectrum, place in zip(prediction, places, strict=True):
        distance = np.linalg.norm(dataset.positions[train] - place, axis=1)
        far = np.flatnonzero(distance >= min(UNRELATED * dataset.wavelength, distance.max()))
        sizes.append(size_of(pixel_errors(np.broadcast_to(spectrum, truth[far].shape), truth[far]).ravel()))
    return float(np.sqrt(np.mean(np.square(sizes))))


def interpolates(model: SpectrumModel) -> bool:
    """Whether a model interpolates known spectra, so that it can do so without some of them."""
    return bool(_fields(model))


def _fields(model: SpectrumModel) -> list[KrigedField]:
    return [each for each in model.modules() if isinstance(each, KrigedField) and len(each.places)]


@contextmanager
def _without(model: SpectrumModel, place: Float[np.ndarray, "1 3"], radius: float) -> Iterator[None]:
    """Let a model interpolate without the known spectra within a radius of a place (metres) for a moment."""
    fields = _fields(model)
    before = [(field.places, field.times, field.values) for field in fields]
    try:
        for field, each in zip(fields, before, strict=True):
            centre = torch.from_numpy(place).to(field.places)
            kept: Bool[torch.Tensor, " n"] = torch.linalg.vector_norm(field.places - centre, dim=1) > radius
            field.places, field.times, field.values = (buffer[kept] for buffer in each)
        yield
    finally:
        for field, (places, times, values) in zip(fields, before, strict=True):
            field.places, field.times, field.values = places, times, values
