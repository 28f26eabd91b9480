"""The responses of every element on a lattice over the transmitter's region, and between the lattice points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Complex, Float
from scipy.interpolate import NdBSpline, make_interp_spline

from scenes.files.errors import InputError
from scenes.files.input_file import MEGABYTE
from scenes.files.npz_file import Expected, read_npz, write_arrays
from simulate.spectra.band import Band, interpolated

ORDER = 5  # Degree of the splines between lattice points. It is lower if there are too few points.

OF_POINTS = 0.95  # Share of the points to which the stated interpolation error refers

LARGEST_FIELD = 4000 * MEGABYTE  # Most bytes of a stored field: 31 million points of a 4 × 4 array

OF_BAND = "band_"  # How the names of a band's arrays begin in the file

LOST = 2  # Number of points at each end where ``undo_mean_of_edges`` is wrong

MARGIN = 6 + LOST  # Cells of the solver around the region. The stored field has ``LOST`` fewer.


@dataclass(frozen=True)
class FieldBand:
    """Element responses on the lattice over a band, or at single further frequencies."""

    solved: Float[np.ndarray, " F"]  # frequencies at which they are known, Hz
    # frequencies of the subcarriers, to which they are interpolated, Hz; single ones are those of ``solved``
    frequencies: Float[np.ndarray, " subcarriers"]
    delay: float  # a typical delay, seconds, which is taken out before the interpolation
    values: Complex[np.ndarray, "F elements nx ny nz"]  # element responses at the points


def together(bands: Sequence[FieldBand | None]) -> FieldBand | None:
    """The bands of several elements as one; None if there are none."""
    known = [band for band in bands if band is not None]
    if len(known) < len(bands):
        return None
    return replace(known[0], values=np.concatenate([band.values for band in known], axis=1))


@dataclass(frozen=True)
class StoredField:
    origin: Float[np.ndarray, " 3"]  # first lattice point, metres, world frame
    spacing: float  # distance between neighbouring points, metres
    values: Complex[np.ndarray, "elements nx ny nz"]  # element responses at the points
    unsettled: Float[np.ndarray, " elements"]  # estimated change of each field still to come, relative to the field
    steps: int  # largest number of time steps of any element
    # root mean square error between points, relative to that of the field, dB, over the share ``OF_POINTS`` of points
    # where it is smallest; nan if unknown. At the other points, near and inside objects, the field is not smooth.
    interpolation_error_db: float = float("nan")
    band: FieldBand | None = None  # the responses over a band; None if only those of the carrier are known

    @property
    def region(self) -> Float[np.ndarray, "2 3"]:
        """Lowest and highest corner of the box in which the field is known, metres, world frame."""
        return np.stack([self.origin, self.origin + self.spacing * (np.array(self.values.shape[1:]) - 1)])

    def responses(self, positions: Float[np.ndarray, "K 3"]) -> Complex[np.ndarray, "K elements"]:
        """Element responses to a transmitter at each position, complex64, by quintic splines."""
        return self._splines(self._places(positions)).astype(np.complex64)

    def band_responses(
        self, positions: Float[np.ndarray, "K 3"], band: Band
    ) -> Complex[np.ndarray, "K elements subcarriers"]:
        """Element responses to a transmitter at each position at the subcarriers of the band that was solved."""
        known, places = self.band, self._places(positions)
        assert known is not None and len(known.frequencies) == band.subcarriers
        found = np.stack([splines(places) for splines in self._band_splines], axis=-1)
        return interpolated(known.solved, found, known.frequencies, known.delay).astype(np.complex64)

    def _places(self, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, "K 3"]:
        """Positions in units of the spacing from the origin."""
        where = ((positions - self.origin) / self.spacing).T
        outside = (where < 0).any(axis=0) | (where > np.array(self.values.shape[1:])[:, None] - 1).any(axis=0)
        if outside.any():
            number = int(np.flatnonzero(outside)[0])
            low, high = self.region
            raise InputError(
                f"position {number + 1}: expected a place within {low.round(3).tolist()} to {high.round(3).tolist()} "
                f"m, where the field is known, found {positions[number].round(3).tolist()}"
            )
        return where.T

    @cached_property
    def _splines(self) -> NdBSpline:
        return _splines_of(self.values)

    @cached_property
    def _band_splines(self) -> list[NdBSpline]:
        return [] if self.band is None else [_splines_of(values) for values in self.band.values]

    def thinned(self, every: int) -> StoredField:
        """The field at every n-th point along each axis. Its interpolation error is that in the region."""
        coarse = replace(self, spacing=every * self.spacing, values=self.values[:, ::every, ::every, ::every].copy())
        if self.band is not None:
            band = replace(self.band, values=self.band.values[:, :, ::every, ::every, ::every].copy())
            coarse = replace(coarse, band=band)
        inner = [np.arange(MARGIN - LOST, size - MARGIN + LOST) for size in self.values.shape[1:]]
        points = np.stack(np.meshgrid(*inner, indexing="ij"), axis=-1).reshape(-1, 3)
        points = points[(points % every != 0).any(axis=1)]
        truth = self.values[:, points[:, 0], points[:, 1], points[:, 2]].T
        error = coarse.responses(self.origin + self.spacing * points) - truth
        squared = np.square(np.abs(error)).sum(axis=1)
        least = squared[squared <= np.quantile(squared, OF_POINTS)].mean()
        return replace(
            coarse, interpolation_error_db=10 * np.log10(least / np.square(np.abs(truth)).sum(axis=1).mean())
        )

    def by_frequency(self, own: float) -> dict[float, StoredField]:
        """The field at each single frequency of a run, in Hz; ``own`` is that of ``values``."""
        found = {own: replace(self, band=None)}
        for frequency, values in () if self.band is None else zip(self.band.solved, self.band.values, strict=True):
            there = replace(found[own], values=values)
            error = there.thinned(2).interpolation_error_db
            found[float(frequency)] = replace(there, interpolation_error_db=error)
        return found

    def write(self, path: Path) -> None:
        """Write to an npz archive."""
        band = {} if self.band is None else {OF_BAND + name: np.asarray(each) for name, each in vars(self.band).items()}
        own = {each.name: np.asarray(getattr(self, each.name)) for each in fields(self) if each.name != "band"}
        write_arrays(path, band | own | {"values": self.values.astype(np.complex64)})


def _splines_of(values: Complex[np.ndarray, "elements nx ny nz"]) -> NdBSpline:
    """Splines of all elements as functions of the place, in units of the spacing from the origin."""
    knots, degrees, coefficients = [], [], np.moveaxis(values, 0, -1).astype(complex)
    for axis in range(3):
        points = np.arange(coefficients.shape[axis])
        along = make_interp_spline(points, np.moveaxis(coefficients, axis, 0), min(ORDER, len(points) - 1))
        knots.append(along.t)
        degrees.append(along.k)
        coefficients = np.moveaxis(along.c, 0, axis)
    return NdBSpline(tuple(knots), coefficients, tuple(degrees))


def read_stored_field(path: Path) -> StoredField:
    numbers = ("spacing", "steps", "interpolation_error_db")
    expected = {
        "origin": Expected("the first point's place", "f", (3,)),
        "values": Expected("responses of elements at a lattice's points", "c", (None, None, None, None)),
        "unsettled": Expected("a number for each element", "f", (None,)),
        **{name: Expected("one number", "f") for name in numbers},
        OF_BAND + "solved": Expected("frequencies at which a band was solved", "f", (None,), optional=True),
        OF_BAND + "frequencies": Expected("frequencies of the subcarriers", "f", (None,), optional=True),
        OF_BAND + "delay": Expected("one number", "f", optional=True),
        OF_BAND + "values": Expected("responses over a band", "c", (None,) * 5, optional=True),
    }
    found = read_npz(path, "the stored field of a full-wave run", expected, LARGEST_FIELD)
    values, unsettled, origin = found["values"], found["unsettled"], found["origin"]
    if len(unsettled) != len(values) or min(values.shape) < 1:
        raise InputError(f"{path}: expected elements and points, found {len(unsettled)} and shape {values.shape}")
    finite = all(np.isfinite(found[name]).all() for name in found if name != "interpolation_error_db")
    if not (finite and found["spacing"] > 0):
        raise InputError(f"{path}: expected a spacing above 0 and finite numbers, found others")
    spacing, steps, error_db = (float(found[name]) for name in numbers)
    return StoredField(origin, spacing, values, unsettled, int(steps), error_db, _band_of(found, path))


def _band_of(found: Mapping[str, np.ndarray], path: Path) -> FieldBand | None:
    """The band of a stored field, if its file has one."""
    parts = {name[len(OF_BAND) :]: each for name, each in found.items() if name.startswith(OF_BAND)}
    if not parts:
        return None
    names = [each.name for each in fields(FieldBand)]
    missing = [name for name in names if name not in parts]
    if missing or parts["values"].shape != (len(parts["solved"]), *found["values"].shape):
        raise InputError(f"{path}: expected the field at each frequency of its band, found other arrays")
    return FieldBand(parts["solved"], parts["frequencies"], float(parts["delay"]), parts["values"])


def undo_mean_of_edges(field: Complex[np.ndarray, "nx ny nz"], axis: int) -> Complex[np.ndarray, "nx ny nz"]:
    """Undo the averaging by which a solver moves a field component from the edges of a cell to its middle.

    The mean of two neighbours multiplies a wave of phase step θ by cos(θ/2), whose inverse is 1 − δ²/8 + 3δ⁴/128 − …
    with the second difference δ² = −4 sin²(θ/2). It is applied along both axes across the component.
    """
    for across in {0, 1, 2} - {axis}:
        second = _second_difference(field, across)
        field = field - second / 8 + 3 / 128 * _second_difference(second, across)
    return field


def _second_difference(field: Complex[np.ndarray, "nx ny nz"], axis: int) -> Complex[np.ndarray, "nx ny nz"]:
    """Second difference along an axis; zero at the ends."""
    result = np.zeros_like(field)
    moved, source = np.moveaxis(result, axis, 0), np.moveaxis(field, axis, 0)
    moved[1:-1] = source[2:] - 2 * source[1:-1] + source[:-2]
    return result
