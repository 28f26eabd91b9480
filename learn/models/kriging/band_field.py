"""Kriging of responses over a band: a covariance over positions times one over subcarriers."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
import torch
from jaxtyping import Complex, Float, Int
from torch import Tensor

from learn.models.base import Region, part_of
from learn.models.kriging.delay_powers import fit_delay_powers, white_noise
from learn.models.kriging.deviation_curve import left_out_curve, normal_curve, on_curve
from learn.models.kriging.kriged_field import KrigedField
from learn.models.kriging.vecchia import NUGGET_LEAST, fit_covariance
from simulate.dataset.dataset import Dataset
from simulate.spectra.beamformer import Beamformer

FITTED_TO = 64
"""Largest number of subcarriers to which the powers of delays are fitted; of more, every second, third, …"""

WEAKEST, BELOW_NOISE = 1e-8, 1e-2
"""Components over frequency below this share of the power, or this share of the noise, are left out."""

AT_ONCE = 32  # positions that ``at`` predicts at once


class BandField(KrigedField):
    """Interpolates every element's responses at all subcarriers as one random field over position and frequency.

    As ``KrigedField``, with waves that arrive after the delay τ_t with the share p_t of the power (``delay_powers``)::

        κ(Δ, δ) = Σ_j s_j e^{jk u_j·Δ} · e^(−|Δ|/ℓ) · Σ_t p_t e^{−i 2π δ τ_t}

    δ is the difference of their frequencies. With the eigenvectors v_i of the factor over frequency and its eigenvalues
    λ_i, kriging falls apart into one of each component v_iᴴ y, with the nugget ν + σ² / λ_i.
    """

    components: Tensor  # v_i (real, imaginary)
    powers: Tensor  # λ_i, which add up to about S
    noises: Tensor  # nugget of each component
    level: Tensor  # root mean square magnitude of the known responses, to which ``values`` are scaled
    variances: Tensor  # kriging variances of the points of the curve of deviations, rising from 0 to 1
    # standard deviation there of the real and the imaginary part of each response, relative to ``level``
    deviations: Tensor
    noise: float  # σ², relative to the power of the responses; only after ``fit``

    neighbours = 64

    def __init__(self, region: Region, beamformer: Beamformer, wavelength: float):
        super().__init__(region, beamformer, wavelength, "responses")
        self.register_buffer("components", torch.zeros(0, 0, 2))
        self.register_buffer("powers", torch.zeros(0))
        self.register_buffer("noises", torch.zeros(0))
        self.register_buffer("level", torch.ones(()))
        self.register_buffer("variances", torch.zeros(0))
        self.register_buffer("deviations", torch.zeros(0))

    def fit(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> str:
        known = np.unique(known)
        assert dataset.band is not None
        responses, times = dataset.band_responses[known], known.astype(float)
        found = self.fit_to(dataset.positions[known], responses, times)
        self.learn_deviations(responses)
        return found

    def fit_to(
        self,
        positions: Float[np.ndarray, "n 3"],
        responses: Complex[np.ndarray, "n elements subcarriers"],
        times: Float[np.ndarray, " n"],
    ) -> str:
        """As ``fit``, to known responses. The deviations are those of the covariance until ``learn_deviations``."""
        responses = responses.astype(complex)
        level = np.sqrt(np.square(np.abs(responses)).mean())
        self.level = torch.tensor(level if level > 0 else 1.0).float()
        every = -(-responses.shape[2] // FITTED_TO)
        self.report("powers of delays", 0, 1)
        rows = responses[..., ::every] / float(self.level)
        self.noise = white_noise(rows)
        delays, _ = fit_delay_powers(rows, self.noise)
        self._decompose(delays, self.noise, responses.shape[2], every)
        self.places, self.times = torch.from_numpy(positions).float(), torch.from_numpy(times).float()
        components = torch.view_as_complex(self.components.double())
        values = (torch.from_numpy(responses) / float(self.level)) @ components.conj()
        self.values = torch.view_as_real(values).flatten(1).float()
        self.mean = torch.zeros(self.values.shape[1])
        self.fit_covariance(np.arange(len(positions)))
        self._state(*normal_curve(self.noise))
        effective = float(torch.exp(-(self.shares * self.shares.log()).sum()))
        return (
            f"{len(self.powers)} components of {responses.shape[2]} subcarriers, noise "
            f"{10 * np.log10(self.noise):.0f} dB, about {effective:.0f} directions, length {self.length:.2f} m"
        )

    def fit_covariance(self, used: Int[np.ndarray, " n"]) -> None:
        """Fit the covariance over positions to some of the known ones; all of them are still interpolated."""
        whole = self.places, self.times, self.values
        self.places, self.times, self.values = (each[torch.from_numpy(used)] for each in whole)
        if len(used) > 1:
            fit_covariance(self, KrigedField.neighbours, partial(self.report, "covariance of responses over the band"))
        self.places, self.times, self.values = whole
        # The nugget has the noise of the kept components, too, each of which has its own.
        of_noise = len(self.powers) * self.noise / float(self.powers.sum())
        self.noises = max(float(self.nugget) - of_noise, NUGGET_LEAST) + self.noise / self.powers

    def _decompose(self, delays: Float[np.ndarray, " M"], noise: float, count: int, every: int) -> None:
        """Find the components of the covariance over ``count`` subcarriers that exceed the noise."""
        phases = np.outer(np.arange(count) / every, np.arange(len(delays)) / len(delays))
        left, singular, _ = np.linalg.svd(np.exp(-2j * np.pi * phases) * np.sqrt(delays), full_matrices=False)
        powers = np.square(singular)
        kept = powers > max(WEAKEST * powers.sum(), BELOW_NOISE * noise)
        self.components = torch.from_numpy(np.stack([left.real, left.imag], -1)[:, kept]).float()
        self.powers = torch.from_numpy(powers[kept]).float()

    def band_responses(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B elements subcarriers 2"]:
        """Responses (real, imaginary) at all subcarriers, in the units of the known ones."""
        return torch.cat([self._at(each)[0] for each in positions.split(AT_ONCE)])

    def at(
        self, positions: Float[np.ndarray, "K 3"], left_out: Int[np.ndarray, " K"] | None = None
    ) -> tuple[Complex[np.ndarray, "K elements subcarriers"], Float[np.ndarray, " K"]]:
        """Responses, and the standard deviation of their real and imaginary parts."""
        responses, variance = self.with_variance(positions, left_out)
        of_level = on_curve(variance, self.variances.double().numpy(), self.deviations.double().numpy())
        return responses, float(self.level) * of_level

    def with_variance(
        self, positions: Float[np.ndarray, "K 3"], left_out: Int[np.ndarray, " K"] | None, radius: float = 0.0
    ) -> tuple[Complex[np.ndarray, "K elements subcarriers"], Float[np.ndarray, " K"]]:
        """As ``at``, with the relative variance instead of the deviation."""
        places = torch.from_numpy(np.asarray(positions)).float().split(AT_ONCE)
        without = [None] * len(places) if left_out is None else torch.from_numpy(left_out).split(AT_ONCE)
        with torch.inference_mode():
            found = [self._at(*each, radius) for each in zip(places, without, strict=True)]
        responses, variances = (torch.cat(each).double() for each in zip(*found, strict=True))
        return torch.view_as_complex(responses.contiguous()).numpy(), variances.numpy()

    def _at(
        self, positions: Float[Tensor, "B 3"], left_out: Int[Tensor, " B"] | None = None, radius: float = 0.0
    ) -> tuple[Float[Tensor, "B elements subcarriers 2"], Float[Tensor, " B"]]:
        """Responses as for ``band_responses``, and their kriging variance relative to the field's, 0…1."""
        found, variance = self._components_at(positions, left_out, radius)
        real, imaginary = found.unbind(-1)
        along, across = self.components.unbind(-1)
        real, imaginary = real @ along.T - imaginary @ across.T, real @ across.T + imaginary @ along.T
        relative = (variance * self.powers).sum(dim=1) / self.powers.sum()
        return self.level * torch.stack([real, imaginary], dim=-1), relative

    def _components_at(
        self, positions: Float[Tensor, "B 3"], left_out: Int[Tensor, " B"] | None, radius: float
    ) -> tuple[Float[Tensor, "B elements I 2"], Float[Tensor, "B I"]]:
        """The components at positions, and their kriging variances relative to ``powers``."""
        near, covariance, cross = self.around(positions, left_out, radius)
        identity = torch.eye(covariance.shape[-1], device=covariance.device)
        # One solution for each component: [B, I, 2n, 1].
        weights = self.solve(covariance[:, None] + self.noises[:, None, None] * identity, cross[:, None])[..., 0]
        rows = self._rows(near).unflatten(-1, (-1, len(self.powers), 2))
        found = torch.einsum("bin,bneic->beic", weights, rows)
        return found, (1 - torch.einsum("bin,bn->bi", weights, cross[..., 0])).clamp(0, 1)

    def learn_deviations(self, responses: Complex[np.ndarray, "n elements subcarriers"]) -> None:
        """Let known responses, predicted from one another, tell the deviations (``left_out_curve``)."""
        self._state(*left_out_curve(self, responses.astype(complex) / float(self.level)))

    def _state(self, variances: Float[np.ndarray, " k"], deviations: Float[np.ndarray, " k"]) -> None:
        self.variances, self.deviations = torch.from_numpy(variances).float(), torch.from_numpy(deviations).float()

    def _load_from_state_dict(self, state_dict: Mapping[str, Tensor], prefix: str, *others: Any) -> None:
        numbers = part_of(state_dict, prefix)
        components = numbers.get("components", self.components)
        if components.ndim != 3 or components.shape[2] != 2 or not components.numel():
            raise RuntimeError(f"components of shape {tuple(components.shape)}")
        kept = components.shape[1]
        self.components, self.powers, self.noises = torch.zeros(components.shape), torch.zeros(kept), torch.zeros(kept)
        self.mean = torch.zeros(2 * self.beamforming.elements * kept)
        self.values = self.mean[None]
        points = numbers.get("variances", self.variances)
        self.variances, self.deviations = torch.zeros(points.shape), torch.zeros(points.shape)
        super()._load_from_state_dict(state_dict, prefix, *others)
        if min(self.powers.min(), self.noises.min(), self.level) <= 0:
            raise RuntimeError("a power, noise or level that is not above 0")
        if points.ndim != 1 or not len(points) or (points.diff() < 0).any() or not (self.deviations >= 0).all():
            raise RuntimeError("no curve of deviations over rising variances")
