"""Kriging under the Helmholtz equation: what the known spectra say about the places between them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import torch
from jaxtyping import Float, Int
from scipy.optimize import minimize
from torch import Tensor

from learn.models.base import Beamformer, SpectrumModel
from learn.splits import evenly
from simulate.angular_grid import AZIMUTHS_DEG, ELEVATIONS_DEG
from simulate.array import PlanarArray
from simulate.dataset import Dataset
from simulate.spectrum import LARGEST_GREY

NEIGHBOURS = 32
"""Known positions a prediction is made from, the nearest."""

FITTED_ON = 200
"""Terms of the likelihood, evenly spread over the order of the known positions."""

FAR = 1e6
"""Metres. A known position with fewer than ``NEIGHBOURS`` others before it gets stand-ins this far away, whose
covariance with everything is zero."""

DIRECTIONS = 100
"""Directions of the plane waves, spread evenly over the sphere."""

EVENNESS = 0.03
"""Weight of the penalty −mean(log s_j) beside the mean log-likelihood: directions on which the spectra give no evidence
keep equal shares."""

ITERATIONS = 60
"""Largest number of iterations of the likelihood's optimiser."""

STRAY, STRAY_LEAST = 0.2, 1e-3
"""Standard deviation of the transmitter's path from the straight line between consecutive known positions: a share of
the line's length, plus a minimum in metres."""

LEGS = 64
"""A leg is the path between two consecutive known positions; a prediction averages over so many likeliest legs."""

DRIFT_MOST = 1e9
"""Upper bound of the drift T, in spectra; a larger T would not change any prediction."""

NUGGET_LEAST = 1e-6
"""Share of the variance; keeps two spectra of one position apart."""


class HelmholtzField(SpectrumModel):
    """Every element's response as a random field over the transmitter's position, interpolated (simple kriging).

    By reciprocity y_m(r) is the field at r of a source at element m: around the transmitter, where nothing is but
    air, it solves ∇²y + k²y = 0 and is a sum of plane waves. If the waves from direction u_j bring the share s_j of
    the power and have random phases, if a wave is valid over a length ℓ (edges of shadows, curvature), and the place
    changes over T spectra while it is measured (people, doors, the tag's attitude), two responses have the covariance

        κ(Δ, τ) = Σ_j s_j e^{jk u_j·Δ} · e^(−|Δ|/ℓ − τ/T),   y(r) = κ(r)ᴴ (K + ν I)⁻¹ y_known

    over the nearest known positions. Δ is the difference of two positions, τ how many spectra were recorded between
    them, in the dataset's order. When an asked position would have been recorded is not known; it is taken to lie on
    the path between two consecutive known positions; legs of the path that pass nearer are likelier
    (``expected_fading``).

    The shares s_j, the length ℓ, the drift T and the nugget ν (the share of the variance that is noise) are those of
    highest likelihood (Vecchia 1988), the shares pulled a little towards waves from all sides alike, for which the sum
    is sin(k|Δ|) / k|Δ| (Cook et al. 1955). Simulated places do not change; for them T is found to be so large that
    the factor e^(−τ/T) is 1.

    Where a dataset has pictures alone, these are interpolated about their mean under |κ|², the covariance of the power
    |y|² of a Gaussian field (Reed 1962).

    Args:
        region: as ``SpectrumModel``; this model does not use it.
        array: the gateway's array.
    """

    places: Tensor
    times: Tensor
    values: Tensor
    mean: Tensor
    wavelength: Tensor
    directions: Tensor
    shares: Tensor
    length: Tensor
    drift: Tensor
    nugget: Tensor

    def __init__(self, region: Float[np.ndarray, "2 3"], array: PlanarArray):
        super().__init__(region)
        self.beamformer = Beamformer(array)
        self._responses = 2 * array.elements
        self.register_buffer("places", torch.zeros(0, 3))
        self.register_buffer("times", torch.zeros(0))
        self.register_buffer("values", torch.zeros(0, self._responses))
        self.register_buffer("mean", torch.zeros(self._responses))
        self.solve: Callable[[Tensor, Tensor], Tensor] = torch.linalg.solve
        """Solver of the kriging equations, batches of (matrix, right side); export puts one that ONNX knows here."""
        self.register_buffer("directions", _all_sides(DIRECTIONS), persistent=False)
        self.register_buffer("shares", torch.full((DIRECTIONS,), 1 / DIRECTIONS))
        for name in ("wavelength", "length", "drift", "nugget"):
            self.register_buffer(name, torch.ones(()))

    @property
    def has_responses(self) -> bool:
        """Whether element responses are interpolated; otherwise the pictures are."""
        return self.values.shape[1] == self._responses

    def fit(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> None:
        """Keep the known spectra, to interpolate them, and find the likeliest s, ℓ, T and ν.

        Args:
            dataset: its responses where it has them, else its pictures.
            known: indices of the spectra to interpolate.
        """
        self._keep(dataset, np.unique(known))
        if len(self.places) > 1:  # the law cannot be fitted to a single spectrum
            self._find_law()

    def uncertainty(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, " B"]:
        """Share of the field's variance that the known spectra leave open: 0 at a known position, 1 far from all."""
        return self.interpolated(positions)[1]

    def _keep(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> None:
        self.places = torch.from_numpy(dataset.positions[known]).float()
        self.times = torch.from_numpy(known).float()
        self.wavelength = torch.tensor(dataset.wavelength).float()
        if dataset.responses is not None:
            responses = torch.from_numpy(dataset.responses[known])
            self.values = torch.view_as_real(responses / responses.abs().square().mean().sqrt()).flatten(1)
            self.mean = torch.zeros(self._responses)
        else:
            self.values = torch.from_numpy(dataset.pictures[known]).flatten(1)
            self.mean = torch.from_numpy(dataset.pictures[known].mean(axis=0, dtype=np.float64).ravel()).float()

    def _find_law(self) -> None:
        # Vecchia's likelihood: the known positions in a random order, each given the nearest of those before it, so
        # that the first ones tell of large distances and the last ones of small. The variance is profiled out.
        order = torch.randperm(len(self.places), generator=torch.Generator().manual_seed(0))
        rank = torch.from_numpy(evenly(np.arange(1, len(order)), FITTED_ON))
        one = order[rank]
        distance = _distance(self.places[one], self.places[order])
        distance[torch.arange(len(order)) >= rank[:, None]] = torch.inf
        distance, near = distance.topk(min(NEIGHBOURS, len(order) - 1), largest=False)
        near = order[near]
        centre, others = self.places[one][:, None].double(), self.places[near].double()
        nowhere = FAR * torch.arange(1, near.shape[1] + 1).double()[None, :, None]
        others = torch.where(distance.isinf()[..., None], nowhere, others)
        times = self.times[near][..., None].double()
        among, since = _distance(times, times), _distance(times, self.times[one][:, None, None].double())
        products = torch.stack([self._products(*members) for members in zip(one, near, strict=True)])

        if not products.any():
            return  # all spectra are the same

        def cost(parameters: np.ndarray) -> tuple[float, np.ndarray]:
            leaf = torch.from_numpy(parameters).requires_grad_()
            shares, (length, drift, nugget) = leaf[:-3].softmax(dim=0), leaf[-3:].exp()
            covariance = self._covariance(others, others, self._faded(among, drift), shares, length)
            covariance = covariance + nugget * torch.eye(covariance.shape[-1])
            towards = self._covariance(others, centre, self._faded(since, drift), shares, length)[..., :1]
            weights = torch.cholesky_solve(towards, torch.linalg.cholesky(covariance))
            residual = torch.cat([torch.ones_like(weights[:, :1]), -weights], dim=1)
            error = (residual.mT @ products @ residual).squeeze()
            variance = 1 + nugget - (weights * towards).sum(dim=(1, 2))
            unlikeliness = (error / variance).mean().log() + variance.log().mean()
            value = unlikeliness - EVENNESS * shares.log().mean()
            (gradient,) = torch.autograd.grad(value, leaf)
            return float(value.detach()), gradient.numpy()

        start = np.append(np.zeros(DIRECTIONS), np.log([10 * float(self.wavelength), 100 * len(order), 0.1]))
        bounds = [(-10.0, 10.0)] * DIRECTIONS
        bounds += [tuple(start[-3] + np.log([0.001, 10.0])), (0.0, np.log(DRIFT_MOST)), (np.log(NUGGET_LEAST), 0.0)]
        found = minimize(cost, start, jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": ITERATIONS})
        self.shares = torch.from_numpy(found.x[:-3]).softmax(dim=0).float()
        self.length, self.drift, self.nugget = torch.from_numpy(np.exp(found.x[-3:])).float()

    def _rows(self, members: Int[Tensor, "*b n"]) -> Float[Tensor, "*b N C"]:
        """The values that kriging weights: the members' values minus the mean; for responses y, also those of −jy.

        Multiplying y by a conjugated complex weight w is then a sum with two real weights: Re w for y, Im w for −jy.
        """
        values = self.values[members].float() - self.mean
        if not self.has_responses:
            return values
        real, imaginary = values.unflatten(-1, (-1, 2)).unbind(-1)
        return torch.cat([values, torch.stack([imaginary, -real], dim=-1).flatten(-2)], dim=-2)

    def _products(self, one: Int[Tensor, ""], near: Int[Tensor, " n"]) -> Float[Tensor, "N N"]:
        """Mean products of one member's values with itself and its neighbours' rows, as the likelihood needs them."""
        rows = torch.cat([self._rows(one[None])[:1], self._rows(near)])
        return (rows @ rows.T).double() / rows.shape[1]

    def _covariance(
        self,
        a: Float[Tensor, "*b n 3"],
        b: Float[Tensor, "*b m 3"],
        faded: Float[Tensor, "*b n m"],
        shares: Float[Tensor, " J"],
        length: Float[Tensor, ""],
    ) -> Float[Tensor, "*b N M"]:
        """κ between the rows of the positions a and b (for pictures |κ|²), times the factor ``faded`` of the drift."""
        wavenumbers = 2 * torch.pi / self.wavelength * self.directions.to(a.dtype).T
        phase_a, phase_b = a @ wavenumbers, b @ wavenumbers
        cosine, sine = phase_b.cos().mT, phase_b.sin().mT
        real = (shares * phase_a.cos()) @ cosine + (shares * phase_a.sin()) @ sine
        imaginary = (shares * phase_a.sin()) @ cosine - (shares * phase_a.cos()) @ sine
        faded = faded * self._faded(_distance(a, b), length)
        if not self.has_responses:
            return (real.square() + imaginary.square()) * faded
        real, imaginary = real * faded, imaginary * faded
        return torch.cat([torch.cat([real, -imaginary], dim=-1), torch.cat([imaginary, real], dim=-1)], dim=-2)

    def _faded(self, apart: Tensor, scale: Tensor) -> Tensor:
        """The factor e^(−separation/scale) of κ (for pictures of |κ|², its square); separation in space or in time."""
        return torch.exp(-apart / scale * (1 if self.has_responses else 2))

    def expected_fading(self, positions: Float[Tensor, "B 3"], near: Int[Tensor, "B n"]) -> Float[Tensor, "B n"]:
        """Expected factor e^(−τ/T) of κ (for pictures of |κ|², its square) between asked positions and known ones.

        The time of an asked position is unknown. The position is taken to lie on one of the legs between consecutive
        known positions. A leg's probability is its duration times the density, at the position, of a normal
        distribution in three dimensions around the leg's straight line.
        """
        if len(self.places) < 2:
            return torch.ones_like(near, dtype=positions.dtype)
        legs, took = self.places.diff(dim=0), self.times.diff()
        ahead = positions[:, None] - self.places[:-1]
        share = ((ahead * legs).sum(dim=-1) / legs.square().sum(dim=-1).clamp_min(1e-12)).clamp(0, 1)
        leg_length = torch.linalg.vector_norm(legs, dim=-1)
        stray = STRAY * leg_length + STRAY_LEAST
        # Integral of the unnormalised density: a tube around the leg and half a ball at each of its ends.
        tube_volume = 2 * torch.pi * leg_length * stray**2 + (2 * torch.pi) ** 1.5 * stray**3
        distance = torch.linalg.vector_norm(ahead - share[..., None] * legs, dim=-1) / stray
        likely, leg = (took.log() - distance.square() / 2 - tube_volume.log()).topk(min(LEGS, len(legs)), dim=1)
        times = self.times[leg] + share.gather(1, leg) * took[leg]
        apart = (times[:, None, :] - self.times[near][:, :, None]).abs()
        return (self._faded(apart, self.drift) * likely.softmax(dim=1)[:, None]).sum(dim=-1)

    def interpolated(self, positions: Float[Tensor, "B 3"]) -> tuple[Float[Tensor, "B C"], Float[Tensor, " B"]]:
        """Interpolated values, and the share of their variance that the known spectra leave open, 0…1."""
        near = _distance(positions, self.places).topk(min(NEIGHBOURS, len(self.places)), largest=False).indices
        around = self.places[near] - positions[:, None]  # small numbers: large coordinates would cost precision
        times = self.times[near][..., None]
        among = self._faded(_distance(times, times), self.drift)
        since = self.expected_fading(positions, near)[..., None]
        covariance = self._covariance(around, around, among, self.shares, self.length)
        covariance = covariance + self.nugget * torch.eye(covariance.shape[-1], device=covariance.device)
        asked = torch.zeros_like(around[:, :1])
        towards = self._covariance(around, asked, since, self.shares, self.length)[..., 0]
        weights = self.solve(covariance, towards)
        values = (weights[:, None] @ self._rows(near)).squeeze(1) + self.mean
        return values, (1 - (weights * towards).sum(dim=-1)).clamp(0, 1)

    def responses(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B elements 2"]:
        """Element responses y, real and imaginary, up to one scale for all; only where responses are interpolated."""
        return self.interpolated(positions)[0].unflatten(-1, (-1, 2))

    def forward(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B 90 360"]:
        """Predicted spectrum: made of the interpolated responses where there are any, else the interpolated picture."""
        if self.has_responses:
            return self.beamformer(self.responses(positions))
        picture = (self.interpolated(positions)[0] / LARGEST_GREY).clamp(0, 1)
        return picture.unflatten(-1, (len(ELEVATIONS_DEG), len(AZIMUTHS_DEG)))

    def load_state_dict(self, state_dict: Mapping[str, Any], strict: bool = True, assign: bool = False) -> Any:
        """As ``torch.nn.Module`` does; the kept spectra take the shape they have in the file."""
        for name in ("places", "times", "values", "mean"):
            if name in state_dict:
                setattr(self, name, torch.empty_like(state_dict[name]))
        return super().load_state_dict(state_dict, strict, assign)


def _distance(a: Float[Tensor, "*b n d"], b: Float[Tensor, "*b m d"]) -> Float[Tensor, "*b n m"]:
    # By differences: torch.cdist's faster way is exact to millimetres only.
    return torch.linalg.vector_norm(a[..., :, None, :] - b[..., None, :, :], dim=-1)


def _all_sides(count: int) -> Float[Tensor, "count 3"]:
    # A Fibonacci spiral: every direction represents the same solid angle.
    index = torch.arange(count) + 0.5
    z, azimuth = 1 - 2 * index / count, torch.pi * (1 + 5**0.5) * index
    across = (1 - z.square()).sqrt()
    return torch.stack([across * azimuth.cos(), across * azimuth.sin(), z], dim=-1)
