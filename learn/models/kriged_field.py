"""Kriging of element responses or spectra with a covariance that solves the Helmholtz equation."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import torch
from jaxtyping import Float, Int
from scipy.spatial.transform import Rotation
from torch import Tensor

from learn.models.base import Beamformed, BeamformingLayer, SpectrumModel, runs_compiled
from learn.models.geometry import distances, evenly_spread_directions
from learn.models.kept import Kept
from learn.models.leg_times import leg_times
from learn.models.quadrature import Quadrature
from learn.models.vecchia import fit_covariance
from simulate.dataset.dataset import Dataset
from simulate.spectra.angular_grid import COLUMNS, ROWS
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import LARGEST_GREY

if TYPE_CHECKING:
    from learn.models.quick_kriging import QuickKriging

DIRECTIONS = 100
"""Number of directions of the plane waves, spread evenly over the sphere."""

SAMPLES = 256
"""Number of nearest samples of one field from which a prediction is made, in whole arrays."""

KEPT = 2000
"""Largest number of known spectra that are kept once they are computed, 260 MB."""

Columns = Int[Tensor, " c"] | slice
EVERY = slice(None)


class KrigedField(SpectrumModel):
    """Interpolates every element's response as a random field over the transmitter's position (simple kriging).

    By reciprocity, y_m(r) is the field at r of a source at element m. In the air around the transmitter this field
    solves ∇²y + k²y = 0, so it is a sum of plane waves. The model makes three assumptions:

    - The waves from direction u_j have random phases and the share s_j of the power.
    - A plane wave is valid over a length ℓ, which shadow edges and curved wavefronts limit.
    - The scene changes over T spectra while it is measured (people, doors, the tag's orientation).

    Two responses then have the covariance κ. The prediction from the nearest known positions is y(r)::

        κ(Δ, τ) = Σ_j s_j e^{jk u_j·Δ} · e^(−|Δ|/ℓ − τ/T),   y(r) = κ(r)ᴴ (K + ν I)⁻¹ y_known

    Δ is the difference of two positions, and τ the number of spectra recorded between them, in the dataset's order. The
    τ of a new position is unknown. The position is assumed to lie on the path between two consecutive known positions,
    and nearer legs of this path are more probable (``expected_fading``).

    The shares s_j, the length ℓ, the drift T and the nugget ν (noise variance relative to the field's variance)
    maximise the likelihood [vecchia1988]. A penalty pulls the shares a little towards equal ones, for which the sum
    is ``sin(k|Δ|) / k|Δ|`` [cook1955]. A simulated scene does not change; the fit then finds a T so large that
    ``e^(−τ/T)`` is 1.

    If the receiver moves, all elements at all known places of the array sample one field, that of the fixed
    transmitter: y_m(r) = y(r + d_m), with the offset d_m of element m from the middle of the array. Kriging from all
    these samples tells more than kriging each element's response by itself.

    If a dataset has no responses, its spectra are interpolated about their mean with the covariance ``|κ|²``, which is
    that of the power ``|y|²`` of a Gaussian field [reed1962].

    Args:
        region: as for ``SpectrumModel``; this model does not use it.
        beamformer: the dataset's array and grid.
        wavelength: metres.
        of: what is interpolated: "responses", "spectra", or one "field" that all elements sample.

    Attributes:
        places: n known positions of the end that moves, metres, world frame.
        offsets: d_m, metres, world frame, if one field is interpolated; otherwise one offset of 0.
        times: index of each known spectrum in its dataset.
        values: responses (real, imaginary), scaled to a mean square magnitude of 1, or 8-bit pictures; flattened.
        mean: mean of ``values`` over the known spectra; zero for responses.
        directions: unit vectors u_j, world frame.
        shares: s_j, which add up to 1.
        length: ℓ, metres.
        drift: T, number of spectra.
        nugget: ν.
        of_responses: whether element responses or one field are interpolated; otherwise spectra are.
        neighbours: number of nearest known positions from which a prediction is made.
        solve: solver of the kriging equations, from (matrices, right-hand sides) to solutions.
    """

    neighbours = 32

    places: Tensor
    offsets: Tensor
    times: Tensor
    values: Tensor
    mean: Tensor
    directions: Tensor
    shares: Tensor
    length: Tensor
    drift: Tensor
    nugget: Tensor

    def __init__(
        self,
        region: Float[np.ndarray, "2 3"],
        beamformer: Beamformer,
        wavelength: float,
        of: Literal["responses", "spectra", "field"],
    ):
        super().__init__(region, wavelength)
        self.beamforming = BeamformingLayer(beamformer)
        self.of_responses = of != "spectra"
        self._grid = beamformer.grid
        self._elements: Float[np.ndarray, "elements 3"] = float(self.wavelength) * beamformer.array.positions
        numbers = 2 * len(self._elements) if self.of_responses else ROWS * COLUMNS
        self._of_field = of == "field"
        self.register_buffer("offsets", torch.zeros(len(self._elements) if self._of_field else 1, 3), self._of_field)
        if self._of_field:
            self.neighbours = max(2, SAMPLES // len(self._elements))
        self.register_buffer("places", torch.zeros(0, 3))
        self.register_buffer("times", torch.zeros(0))
        self.register_buffer("values", torch.zeros(0, numbers))
        self.register_buffer("mean", torch.zeros(numbers))
        self._quick: Kept[QuickKriging] = Kept()
        self._spectra: Kept[Tensor] = Kept()
        # The export to ONNX replaces this solver.
        self.solve: Callable[[Tensor, Tensor], Tensor] = torch.linalg.solve
        self.register_buffer("directions", evenly_spread_directions(DIRECTIONS), persistent=False)
        self.register_buffer("shares", torch.full((DIRECTIONS,), 1 / DIRECTIONS))
        for name in ("length", "drift", "nugget"):
            self.register_buffer(name, torch.ones(()))

    def fit(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> str:
        """Keep the known spectra, and find the s, ℓ, T and ν of highest likelihood.

        Args:
            dataset: a dataset; it must have responses if these are interpolated.
            known: indices of the spectra to interpolate.

        Returns:
            What was found, as a sentence for the user.
        """
        self.keep(dataset, np.unique(known))
        if len(self.places) > 1:  # a single spectrum does not determine a covariance
            what = "responses" if self.of_responses else "spectra"
            field = self._of_samples() if self._of_field else self
            fit_covariance(field, field.neighbours, partial(self.report, f"covariance of {what}"))
            for name in ("shares", "length", "drift", "nugget"):
                setattr(self, name, getattr(field, name))
        return f"length {self.length:.2f} m, drift {self.drift:.0f} spectra, nugget {self.nugget:.1e}"

    def _of_samples(self) -> KrigedField:
        """The same field as sampled by a single element, which stands at all places of the elements in turn."""
        single = Beamformer(PlanarArray(1, 1), self._grid)
        found = KrigedField(self.region.numpy(), single, float(self.wavelength), "responses")
        found.places = (self.places[:, None] + self.offsets).flatten(0, 1)
        found.times = self.times.repeat_interleave(len(self.offsets))
        found.values, found.mean = self.values.reshape(-1, 2), torch.zeros(2)
        return found

    @property
    def first_length(self) -> float:
        """The length ℓ at which the search for the most likely one begins, metres."""
        return 10 * float(self.wavelength)

    def uncertainty(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, " B"]:
        """Kriging variance relative to the field's variance: about 0 at a known position, 1 far from all of them."""
        columns = slice(0, 2 * len(self.offsets))  # the variance does not depend on the values
        return self.interpolated(positions, columns=columns)[1]

    def keep(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> None:
        """Interpolate between these spectra from now on, with the same covariance.

        Args:
            dataset: as for ``fit``.
            known: indices of the spectra to interpolate, ascending.
        """
        self.places = torch.from_numpy(dataset.positions[known]).float()
        self.times = torch.from_numpy(known).float()
        if self._of_field:
            offsets = Rotation.from_quat(dataset.gateway_orientation).apply(self._elements)
            self.offsets = torch.from_numpy(offsets).float()
        if self.of_responses:
            assert dataset.responses is not None
            responses = torch.from_numpy(dataset.responses[known])
            root_mean_square = responses.abs().square().mean().sqrt()
            if root_mean_square > 0:  # pictures of one grey level have responses of zero
                responses = responses / root_mean_square
            self.values = torch.view_as_real(responses).flatten(1)
            self.mean = torch.zeros(self.values.shape[1])
        else:
            self.values = torch.from_numpy(dataset.pictures[known]).flatten(1)
            self.mean = torch.from_numpy(dataset.pictures[known].mean(axis=0, dtype=np.float64).ravel()).float()

    def _rows(self, members: Int[Tensor, "*b n"], columns: Columns = EVERY) -> Float[Tensor, "*b N C"]:
        """The rows that kriging sums with real weights: the samples' values minus the mean, and for responses also −jy.

        A member has a sample for each of ``offsets``.

        The product of y with a conjugated complex weight w is then a sum with the real weights Re w for y and Im w for
        −jy.
        """
        values = self.values[:, columns][members].float() - self.mean[columns]
        values = values.unflatten(-1, (len(self.offsets), -1)).flatten(-3, -2)
        if not self.of_responses:
            return values
        real, imaginary = values.unflatten(-1, (-1, 2)).unbind(-1)
        return torch.cat([values, torch.stack([imaginary, -real], dim=-1).flatten(-2)], dim=-2)

    def products(self, member: Int[Tensor, ""], neighbours: Int[Tensor, " n"]) -> Float[Tensor, "N N"]:
        """Products of the rows of a member and its neighbours, averaged over the values, for the likelihood."""
        rows = torch.cat([self._rows(member[None])[:1], self._rows(neighbours)])
        return (rows @ rows.T).double() / rows.shape[1]

    def covariance(
        self,
        a: Float[Tensor, "*b n 3"],
        b: Float[Tensor, "*b m 3"],
        fading: Float[Tensor, "*b n m"],
        shares: Float[Tensor, " J"],
        length: Float[Tensor, ""],
    ) -> Float[Tensor, "*b N M"]:
        """κ (for spectra ``|κ|²``) between the rows of places a and b. ``fading`` is the drift's factor in it."""
        wavenumbers = 2 * torch.pi / self.wavelength * self.directions.to(a.dtype).T
        phase_a, phase_b = a @ wavenumbers, b @ wavenumbers
        cosine, sine = phase_b.cos().mT, phase_b.sin().mT
        real = (shares * phase_a.cos()) @ cosine + (shares * phase_a.sin()) @ sine
        imaginary = (shares * phase_a.sin()) @ cosine - (shares * phase_a.cos()) @ sine
        fading = fading * self.fading(distances(a, b), length)
        if not self.of_responses:
            return (real.square() + imaginary.square()) * fading
        real, imaginary = real * fading, imaginary * fading
        return torch.cat([torch.cat([real, -imaginary], dim=-1), torch.cat([imaginary, real], dim=-1)], dim=-2)

    def fading(self, separation: Tensor, scale: Tensor) -> Tensor:
        """The factor ``e^(−separation/scale)`` of κ (its square in ``|κ|²`` for spectra), for a separation in space or
        time.
        """
        return torch.exp(-separation / scale * (1 if self.of_responses else 2))

    def expected_fading(self, positions: Float[Tensor, "B 3"], near: Int[Tensor, "B n"]) -> Float[Tensor, "B n"]:
        """Expected factor ``e^(−τ/T)`` of κ (its square in ``|κ|²`` for spectra) between new and known positions.

        The time of a new position is unknown; ``leg_times`` tells the probable ones.

        Args:
            positions: new positions, metres, world frame.
            near: indices of known positions, for each new position.
        """
        if len(self.places) < 2:
            return torch.ones_like(near, dtype=positions.dtype)
        times, probability = leg_times(positions, self.places, self.times)
        time_between = (times[:, None, :] - self.times[near][:, :, None]).abs()
        return (self.fading(time_between, self.drift) * probability[:, None]).sum(dim=-1)

    def interpolated(
        self, positions: Float[Tensor, "B 3"], left_out: Int[Tensor, " B"] | None = None, columns: Columns = EVERY
    ) -> tuple[Float[Tensor, "B C"], Float[Tensor, " B"]]:
        """Interpolated values (flattened, in the units of ``values``), and their ``uncertainty``.

        Args:
            positions: transmitter positions, metres, world frame.
            left_out: for each position the index of a known spectrum that must not be used.
            columns: indices of the values, of all C.
        """
        distance = distances(positions, self.places)
        if left_out is not None:
            distance = distance.index_put((torch.arange(len(positions)), left_out), torch.tensor(torch.inf))
        distance, near = distance.topk(min(self.neighbours, len(self.places) - (left_out is not None)), largest=False)
        # Coordinates relative to the new position are small, and single precision suffices for them.
        samples = ((self.places[near] - positions[:, None])[:, :, None] + self.offsets).flatten(1, 2)
        wanted = self.offsets.expand(samples.shape[0], -1, -1)
        times = self.times[near].repeat_interleave(len(self.offsets), dim=1)[..., None]
        fading = self.fading(distances(times, times), self.drift)
        covariance = self.covariance(samples, samples, fading, self.shares, self.length)
        covariance = covariance + self.nugget * torch.eye(covariance.shape[-1], device=covariance.device)
        fading = self.expected_fading(positions, near).repeat_interleave(len(self.offsets), dim=1)[..., None]
        cross_covariance = self.covariance(samples, wanted, fading, self.shares, self.length)[..., : len(self.offsets)]
        weights = self.solve(covariance, cross_covariance)
        values = (weights.mT @ self._rows(near, columns)).flatten(1) + self.mean[columns]
        return values, (1 - (weights * cross_covariance).sum(dim=1)).mean(dim=-1).clamp(0, 1)

    def responses(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B elements 2"]:
        """Element responses y (real, imaginary), up to one common factor; only if responses are interpolated.

        In inference mode on the CPU, a compiled loop computes them (``QuickKriging``).
        """
        quick = self._quickly(positions)
        if quick is None:
            return self.interpolated(positions)[0].unflatten(-1, (-1, 2))
        return torch.view_as_real(torch.from_numpy(quick.responses(positions.numpy(), self.neighbours)))

    def _quickly(self, positions: Float[Tensor, "B 3"]) -> QuickKriging | None:
        """What interpolates responses quickly. None: nothing does, or their gradient is needed."""
        if not runs_compiled(positions) or not self.of_responses or self._of_field:
            return None
        from learn.models.quick_kriging import QuickKriging  # compiles, which training does not need

        known = self.places, self.times, self.values, self.mean, self.directions, self.wavelength
        made_of = *known, self.shares, self.length, self.drift, self.nugget
        return self._quick.of(made_of, lambda: QuickKriging(*made_of))

    def predict(
        self, positions: Float[Tensor, "B 3"]
    ) -> tuple[Float[Tensor, "B 90 360"], Float[Tensor, "B elements 2"] | None]:
        """Predict spectra, and the responses from which they are computed if these are interpolated.

        Args:
            positions: transmitter positions, metres, world frame.
        """
        if not self.of_responses:
            return self(positions), None
        responses = self.responses(positions)
        return self.beamforming(responses), responses

    def beamformed(self) -> Beamformed | None:
        """As for ``SpectrumModel``; not of one field, whose large covariances many positions at once would not fit."""
        return Beamformed(self.responses, self.beamforming) if self.of_responses and not self._of_field else None

    def forward(
        self, positions: Float[Tensor, "B 3"], left_out: Int[Tensor, " B"] | None = None
    ) -> Float[Tensor, "B 90 360"]:
        """Predicted spectrum: that of the interpolated responses, or the interpolated spectrum.

        Args:
            positions: transmitter positions, metres, world frame.
            left_out: as for ``interpolated``.
        """
        if self.of_responses and left_out is None:
            return self.beamforming(self.responses(positions))
        return self._as_spectra(self.interpolated(positions, left_out)[0])

    def coarse(self, positions: Float[Tensor, "B 3"], pixels: Quadrature) -> Float[Tensor, "B H W"]:
        """As for ``SpectrumModel``; of spectra only these pixels are interpolated."""
        if self.of_responses:
            return self.beamforming.coarse(self.responses(positions), pixels)
        columns = torch.from_numpy((pixels.rows[:, None] * COLUMNS + pixels.columns).ravel()).to(positions.device)
        values = self.interpolated(positions, columns=columns)[0]
        return (values / LARGEST_GREY).clamp(0, 1).unflatten(-1, (len(pixels.rows), len(pixels.columns)))

    def known_spectra(self, members: Int[Tensor, "*b n"]) -> Float[Tensor, "*b n 90 360"]:
        """Spectra at known positions.

        Args:
            members: indices into ``places``.
        """
        values = self.values[members].float()
        return self._as_spectra(values.flatten(0, -2)).unflatten(0, members.shape)

    def all_known_spectra(self) -> Float[Tensor, "n 90 360"] | None:
        """Spectra at all known positions, which are computed once. None: there are too many to keep."""
        known = torch.arange(len(self.places))
        return None if len(known) > KEPT else self._spectra.of([self.values], lambda: self.known_spectra(known))

    def _as_spectra(self, values: Float[Tensor, "n C"]) -> Float[Tensor, "n 90 360"]:
        if self.of_responses:
            return self.beamforming(values.unflatten(-1, (-1, 2)))
        return (values / LARGEST_GREY).clamp(0, 1).unflatten(-1, (ROWS, COLUMNS))

    def load_state_dict(self, state_dict: Mapping[str, Any], strict: bool = True, assign: bool = False) -> Any:
        """As ``torch.nn.Module.load_state_dict``, but for the number of known spectra that the file has.

        Raises:
            RuntimeError: also if the buffers do not fit together, or hold values that no fit finds.
        """
        known = len(state_dict["times"]) if state_dict.get("times", torch.zeros(())).ndim else 0
        if not known:
            raise RuntimeError("no known spectra")
        for name in ("places", "times", "values"):
            shape = (known, *getattr(self, name).shape[1:])
            if name in state_dict and state_dict[name].shape != shape:  # checked before memory is allocated
                raise RuntimeError(f"{name} of shape {tuple(state_dict[name].shape)} instead of {shape}")
            grey_levels = name == "values" and not self.of_responses
            setattr(self, name, torch.zeros(shape, dtype=torch.uint8 if grey_levels else torch.float32))
        loaded = super().load_state_dict(state_dict, strict, assign)
        if not (self.shares >= 0).all() or min(self.length, self.drift, self.nugget) <= 0:
            raise RuntimeError("a share below 0, or a length, drift or nugget that is not above 0")
        return loaded
