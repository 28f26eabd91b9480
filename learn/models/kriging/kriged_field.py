"""Kriging of element responses or spectra with a covariance that solves the Helmholtz equation."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import torch
from jaxtyping import Float, Inexact, Int
from torch import Tensor

from learn.models.base import Beamformed, BeamformingLayer, Cache, Region, SpectrumModel, part_of, runs_compiled
from learn.models.encoding import evenly_spread_directions
from learn.models.kriging.vecchia import FAR, fit_covariance
from learn.models.kriging.wave_covariance import Separations, between_rows, distances, leg_times, with_turned_rows
from learn.models.quadrature import Quadrature
from simulate.dataset.dataset import Dataset
from simulate.spectra.angular_grid import COLUMNS, ROWS
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import LARGEST_GREY

if TYPE_CHECKING:
    from learn.models.kriging.compiled_kriging import CompiledKriging

MOST_CACHED = 2000  # largest number of known spectra that are kept once they are computed, 260 MB
DIRECTIONS = 100  # number of directions of the plane waves, spread evenly over the sphere

Columns = Int[Tensor, " c"] | slice
EVERY = slice(None)


class KrigedField(SpectrumModel):
    """Interpolates every element's response as a random field over the transmitter's position (simple kriging).

    Waves from the directions u_j have random phases and the shares s_j of the power [cook1955]. They are valid over a
    length ℓ, and the scene changes over T spectra. So two responses have the covariance κ, and the prediction is y(r)::

        κ(Δ, τ) = Σ_j s_j e^{jk u_j·Δ} · e^(−|Δ|/ℓ − τ/T),   y(r) = κ(r)ᴴ (K + ν I)⁻¹ y_known

    Δ is the difference of two positions, and τ the number of spectra recorded between them. s_j, ℓ, T and the nugget ν
    maximise the likelihood [vecchia1988]. Spectra are interpolated about their mean with ``|κ|²``, the covariance of
    the power of a Gaussian field [reed1962].
    """

    neighbours = 32

    places: Tensor  # n known positions of the end that moves, metres, world frame
    times: Tensor  # index of each known spectrum in its dataset
    values: Tensor  # responses (real, imaginary), scaled to a mean square magnitude of 1, or 8-bit pictures; flattened
    mean: Tensor  # mean of ``values`` over the known spectra; zero for responses
    # where the samples of a known position lie relative to it, metres, world frame: here one offset of 0
    offsets: Tensor
    directions: Tensor  # unit vectors u_j, world frame
    shares: Tensor  # s_j, which add up to 1
    length: Tensor  # ℓ, metres
    drift: Tensor  # T, number of spectra
    nugget: Tensor  # ν

    def __init__(self, region: Region, beamformer: Beamformer, wavelength: float, of: Literal["responses", "spectra"]):
        super().__init__(region, wavelength)
        self.beamforming = BeamformingLayer(beamformer)
        self.of_responses = of == "responses"
        numbers = 2 * beamformer.array.elements if self.of_responses else ROWS * COLUMNS
        self.register_buffer("places", torch.zeros(0, 3))
        self.register_buffer("times", torch.zeros(0))
        self.register_buffer("values", torch.zeros(0, numbers))
        self.register_buffer("mean", torch.zeros(numbers))
        self._spectra: Cache[Tensor] = Cache()
        self.register_buffer("offsets", torch.zeros(1, 3), persistent=False)
        self._compiled: Cache[CompiledKriging] = Cache()
        # The export to ONNX replaces this solver.
        self.solve: Callable[[Tensor, Tensor], Tensor] = torch.linalg.solve
        self.register_buffer("directions", evenly_spread_directions(DIRECTIONS), persistent=False)
        self.register_buffer("shares", torch.full((DIRECTIONS,), 1 / DIRECTIONS))
        for name in ("length", "drift", "nugget"):
            self.register_buffer(name, torch.ones(()))

    def fit(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> str:
        """Keep the known spectra, and find the s, ℓ, T and ν of highest likelihood."""
        self.keep(dataset, np.unique(known))
        if len(self.places) > 1:  # a single spectrum does not determine a covariance
            self._maximise_likelihood()
        return f"length {self.length:.2f} m, drift {self.drift:.0f} spectra, nugget {self.nugget:.1e}"

    def keep(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> None:
        """Interpolate between these spectra from now on, with the same covariance."""
        self.places = torch.from_numpy(dataset.positions[known]).float()
        self.times = torch.from_numpy(known).float()
        if self.of_responses:
            responses = torch.from_numpy(dataset.responses[known])
            root_mean_square = responses.abs().square().mean().sqrt()
            if root_mean_square > 0:  # pictures of one grey level have responses of zero
                responses = responses / root_mean_square
            self.values = torch.view_as_real(responses).flatten(1)
            self.mean = torch.zeros(self.values.shape[1])
        else:
            self.values = torch.from_numpy(dataset.pictures[known]).flatten(1)
            self.mean = torch.from_numpy(dataset.pictures[known].mean(axis=0, dtype=np.float64).ravel()).float()

    def known_spectra(self, members: Int[Tensor, "*b n"]) -> Float[Tensor, "*b n 90 360"]:
        """Spectra at known positions."""
        values = self.values[members].float()
        return self._as_spectra(values.flatten(0, -2)).unflatten(0, members.shape)

    def all_known_spectra(self) -> Float[Tensor, "n 90 360"] | None:
        """Spectra at all known positions, which are computed once. None: there are too many to keep."""
        known = torch.arange(len(self.places))
        return None if len(known) > MOST_CACHED else self._spectra.of([self.values], lambda: self.known_spectra(known))

    def _as_spectra(self, values: Float[Tensor, "n C"]) -> Float[Tensor, "n 90 360"]:
        if self.of_responses:
            return self.beamforming(values.unflatten(-1, (-1, 2)))
        return (values / LARGEST_GREY).clamp(0, 1).unflatten(-1, (ROWS, COLUMNS))

    def _maximise_likelihood(self) -> None:
        what = "responses" if self.of_responses else "spectra"
        fit_covariance(self, self.neighbours, partial(self.report, f"covariance of {what}"))

    @property
    def first_length(self) -> float:
        """The length ℓ at which the search for the most likely one begins, metres."""
        return 10 * float(self.wavelength)

    def uncertainty(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, " B"]:
        """Kriging variance relative to the field's variance: about 0 at a known position, 1 far from all of them."""
        columns = slice(0, 2 * len(self.offsets))  # the variance does not depend on the values
        return self.interpolated(positions, columns=columns)[1]

    def _rows(self, members: Int[Tensor, "*b n"], columns: Columns = EVERY) -> Float[Tensor, "*b N C"]:
        """The rows that kriging sums with real weights: values minus the mean, and for responses also −jy."""
        values = self.values[:, columns][members].float() - self.mean[columns]
        values = values.unflatten(-1, (len(self.offsets), -1)).flatten(-3, -2)
        return with_turned_rows(values) if self.of_responses else values

    def products(self, members: Int[Tensor, " n"]) -> Inexact[Tensor, "n n"]:
        """Products ``y_a conj(y_b)`` of the values of members, minus the mean, averaged over the values."""
        values = self.values[members].float() - self.mean
        rows = torch.view_as_complex(values.unflatten(-1, (-1, 2))) if self.of_responses else values
        products = rows @ rows.mH / values.shape[1]
        return products.to(torch.complex128 if self.of_responses else torch.float64)

    def separations(self, a: Float[Tensor, "*b n 3"], b: Float[Tensor, "*b m 3"]) -> Separations:
        """The separations of places, from which ``kappa`` computes covariances."""
        return Separations(a, b, 2 * torch.pi / self.wavelength * self.directions.to(a.dtype).T)

    def kappa(
        self,
        separations: Separations,
        fading: Float[Tensor, "*b n m"],
        shares: Float[Tensor, " J"],
        length: Float[Tensor, ""],
    ) -> tuple[Float[Tensor, "*b n m"], Float[Tensor, "*b n m"] | None]:
        """Real and imaginary part of κ; for spectra ``|κ|²`` and None. ``fading`` is the drift's factor in it."""
        real, imaginary = separations.wave_sum(shares)
        fading = fading * self.fading(separations.distances, length)
        if not self.of_responses:
            return (real.square() + imaginary.square()) * fading, None
        return real * fading, imaginary * fading

    def covariance(
        self,
        a: Float[Tensor, "*b n 3"],
        b: Float[Tensor, "*b m 3"],
        fading: Float[Tensor, "*b n m"],
        shares: Float[Tensor, " J"],
        length: Float[Tensor, ""],
    ) -> Float[Tensor, "*b N M"]:
        """``kappa`` between the rows of places a and b."""
        real, imaginary = self.kappa(self.separations(a, b), fading, shares, length)
        return real if imaginary is None else between_rows(real, imaginary)

    def fading(self, separation: Tensor, scale: Tensor) -> Tensor:
        """The factor ``e^(−separation/scale)`` of κ in space or time; its square in ``|κ|²`` for spectra."""
        return torch.exp(-separation / scale * (1 if self.of_responses else 2))

    def expected_fading(
        self, positions: Float[Tensor, "B 3"], near: Int[Tensor, "B n"], left_out: Int[Tensor, " B"] | None = None
    ) -> Float[Tensor, "B n"]:
        """``fading`` between new and known positions, expected over the probable times of the new (``leg_times``)."""
        if len(self.places) - (left_out is not None) < 2:
            return torch.ones_like(near, dtype=positions.dtype)
        if left_out is None:
            times, probability = leg_times(positions, self.places, self.times)
        else:
            known = torch.arange(len(self.places), device=left_out.device)
            paths = [(self.places[kept], self.times[kept]) for kept in (known != each for each in left_out)]
            legs = [leg_times(here[None], *path) for here, path in zip(positions, paths, strict=True)]
            times, probability = (torch.cat(parts) for parts in zip(*legs, strict=True))
        time_between = (times[:, None, :] - self.times[near][:, :, None]).abs()
        return (self.fading(time_between, self.drift) * probability[:, None]).sum(dim=-1)

    def interpolated(
        self, positions: Float[Tensor, "B 3"], left_out: Int[Tensor, " B"] | None = None, columns: Columns = EVERY
    ) -> tuple[Float[Tensor, "B C"], Float[Tensor, " B"]]:
        """Interpolated values (flattened, in the units of ``values``), and their ``uncertainty``."""
        near, covariance, cross = self.around(positions, left_out)
        weights = self.solve(covariance + self.nugget * torch.eye(covariance.shape[-1], device=cross.device), cross)
        values = (weights.mT @ self._rows(near, columns)).flatten(1) + self.mean[columns]
        return values, (1 - (weights * cross).sum(dim=1)).mean(dim=-1).clamp(0, 1)

    def around(
        self, positions: Float[Tensor, "B 3"], left_out: Int[Tensor, " B"] | None = None, radius: float = 0.0
    ) -> tuple[Int[Tensor, "B n"], Float[Tensor, "B N N"], Float[Tensor, "B N M"]]:
        """The nearest known positions, the covariance of their samples, and that with the wanted ones.

        A position that is left out is left out with all known ones within a radius.
        """
        distance = distances(positions, self.places)
        if left_out is not None:
            distance = distance.index_put((torch.arange(len(positions)), left_out), -torch.ones(()))
            distance = torch.where(distance >= radius, distance, torch.inf)
        distance, near = distance.topk(min(self.neighbours, len(self.places)), largest=False)
        # Coordinates relative to the new position are small, and single precision suffices for them.
        places = self.places[near] - positions[:, None]
        if left_out is not None:  # what is left out is moved so far away that it says nothing
            away = FAR * torch.arange(1, near.shape[1] + 1)[None, :, None]
            places = torch.where(distance.isinf()[..., None], away, places)
        samples = (places[:, :, None] + self.offsets).flatten(1, 2)
        wanted = self.offsets.expand(samples.shape[0], -1, -1)
        times = self.times[near].repeat_interleave(len(self.offsets), dim=1)[..., None]
        fading = self.fading(distances(times, times), self.drift)
        covariance = self.covariance(samples, samples, fading, self.shares, self.length)
        fading = self.expected_fading(positions, near, left_out).repeat_interleave(len(self.offsets), dim=1)[..., None]
        cross = self.covariance(samples, wanted, fading, self.shares, self.length)[..., : len(self.offsets)]
        return near, covariance, cross

    def responses(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B elements 2"]:
        """Element responses y, if these are interpolated; by a compiled loop in inference mode on the CPU."""
        quick = self._compiled_for(positions)
        if quick is None:
            return self.interpolated(positions)[0].unflatten(-1, (-1, 2))
        return torch.view_as_real(torch.from_numpy(quick.responses(positions.numpy(), self.neighbours)))

    def _compiled_for(self, positions: Float[Tensor, "B 3"]) -> CompiledKriging | None:
        """What interpolates responses quickly. None: nothing does, or their gradient is needed."""
        if not runs_compiled(positions) or not self.of_responses:
            return None
        from learn.models.kriging.compiled_kriging import CompiledKriging  # compiles, which training does not need

        known = self.places, self.times, self.values, self.mean, self.directions, self.wavelength
        made_of = *known, self.shares, self.length, self.drift, self.nugget
        return self._compiled.of(made_of, lambda: CompiledKriging(self))

    def predict(
        self, positions: Float[Tensor, "B 3"]
    ) -> tuple[Float[Tensor, "B 90 360"], Float[Tensor, "B elements 2"] | None]:
        if not self.of_responses:
            return self(positions), None
        responses = self.responses(positions)
        return self.beamforming(responses), responses

    def beamformed(self) -> Beamformed | None:
        return Beamformed(self.responses, self.beamforming) if self.of_responses else None

    def forward(
        self, positions: Float[Tensor, "B 3"], left_out: Int[Tensor, " B"] | None = None
    ) -> Float[Tensor, "B 90 360"]:
        if self.of_responses and left_out is None:
            return self.beamforming(self.responses(positions))
        return self._as_spectra(self.interpolated(positions, left_out)[0])

    def coarse(self, positions: Float[Tensor, "B 3"], pixels: Quadrature) -> Float[Tensor, "B H W"]:
        if self.of_responses:
            return self.beamforming.coarse(self.responses(positions), pixels)
        columns = torch.from_numpy((pixels.rows[:, None] * COLUMNS + pixels.columns).ravel()).to(positions.device)
        values = self.interpolated(positions, columns=columns)[0]
        return (values / LARGEST_GREY).clamp(0, 1).unflatten(-1, (len(pixels.rows), len(pixels.columns)))

    def _load_from_state_dict(self, state_dict: Mapping[str, Tensor], prefix: str, *others: Any) -> None:
        """As for ``torch.nn.Module``, but for the number of known spectra that the file has."""
        numbers = part_of(state_dict, prefix)
        known = len(numbers["times"]) if numbers.get("times", torch.zeros(())).ndim else 0
        if not known:
            raise RuntimeError("no known spectra")
        for name in ("places", "times", "values"):
            shape = (known, *getattr(self, name).shape[1:])
            if name in numbers and numbers[name].shape != shape:  # checked before memory is allocated
                raise RuntimeError(f"{name} of shape {tuple(numbers[name].shape)} instead of {shape}")
            grey_levels = name == "values" and not self.of_responses
            setattr(self, name, torch.zeros(shape, dtype=torch.uint8 if grey_levels else torch.float32))
        super()._load_from_state_dict(state_dict, prefix, *others)
        if not (self.shares >= 0).all() or min(self.length, self.drift, self.nugget) <= 0:
            raise RuntimeError("a share below 0, or a length, drift or nugget that is not above 0")
