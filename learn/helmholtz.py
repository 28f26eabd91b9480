"""Kriging under the Helmholtz equation: what the known spectra say about the places between them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from jaxtyping import Float, Int
from scipy.optimize import minimize
from torch import Tensor

from learn.spectrum_model import Beamformer, SpectrumModel
from learn.splits import evenly
from simulate.dataset import Dataset
from simulate.spectrum import AZIMUTHS_DEG, ELEVATIONS_DEG, PlanarArray

NEIGHBOURS = 64
"""Known positions a prediction is made from, the nearest."""

FITTED_ON = 200
"""Terms of the likelihood, evenly spread over the order of the known positions."""

FAR = 1e6
"""Metres; where a neighbour is put that is none."""

NUGGET_LEAST = 1e-6
"""Share of the variance; keeps two spectra of one position apart."""


class HelmholtzField(SpectrumModel):
    """Every element's response as a random field over the transmitter's position, interpolated (simple kriging).

    By reciprocity y_m(r) is the field at r of a source at element m: around the transmitter, where nothing is but
    air, it solves ∇²y + k²y = 0. Of waves from all sides alike, such fields have the covariance sin(kd) / kd over a
    distance d (Cook et al. 1955). Edges of shadows end a wave's validity; that is put into a length ℓ:

        κ(d) = sin(kd) / kd · e^(−d/ℓ),   y(r) = Σ_i w_i y_i,   w = (K + ν I)⁻¹ κ(r)

    over the nearest known positions i. The length ℓ and the nugget ν (the share of the variance that is noise) are
    those of highest likelihood (Vecchia 1988). Nothing else is learned.

    Pictures without responses are interpolated themselves, about their mean, under κ², the covariance of the power
    |y|² of a Gaussian field (Reed 1962).

    Args:
        region: as ``SpectrumModel``; not looked at.
        array: the gateway's array.
    """

    places: Tensor
    values: Tensor
    mean: Tensor
    wavelength: Tensor
    length: Tensor
    nugget: Tensor

    def __init__(self, region: Float[np.ndarray, "2 3"], array: PlanarArray):
        super().__init__(region)
        self.beamformer = Beamformer(array)
        self._responses = 2 * array.elements
        self.register_buffer("places", torch.zeros(0, 3))
        self.register_buffer("values", torch.zeros(0, self._responses))
        self.register_buffer("mean", torch.zeros(self._responses))
        for name in ("wavelength", "length", "nugget"):
            self.register_buffer(name, torch.ones(()))

    @property
    def has_responses(self) -> bool:
        """Whether it interpolates element responses; else pictures."""
        return self.values.shape[1] == self._responses

    def keep(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> None:
        """What to interpolate.

        Args:
            dataset: its responses where it has them, else its pictures.
            known: indices of the spectra to interpolate.
        """
        self.places = torch.from_numpy(dataset.positions[known]).float()
        self.wavelength = torch.tensor(dataset.wavelength).float()
        if dataset.channels is not None:
            channels = torch.from_numpy(dataset.channels[known])
            self.values = torch.view_as_real(channels / channels.abs().square().mean().sqrt()).flatten(1)
            self.mean = torch.zeros(self._responses)
        else:
            self.values = torch.from_numpy(dataset.pictures[known]).flatten(1)
            self.mean = self.values.float().mean(dim=0)

    def fit(self) -> None:
        """Find the likeliest ℓ and ν.

        Vecchia's likelihood: the known positions in a random order, each given the nearest of those before it, so
        that the first ones tell of large distances and the last ones of small. The variance is profiled out.
        """
        if len(self.places) < 2:
            return  # one spectrum tells neither
        order = torch.randperm(len(self.places), generator=torch.Generator().manual_seed(0))
        rank = torch.from_numpy(evenly(np.arange(1, len(order)), FITTED_ON))
        distance = _distance(self.places[order[rank]], self.places[order])
        distance[torch.arange(len(order)) >= rank[:, None]] = torch.inf
        distance, near = distance.topk(min(NEIGHBOURS, len(order) - 1), largest=False)
        group = torch.cat([order[rank, None], order[near]], dim=1)
        products = torch.stack([self._products(members) for members in group])
        places = self.places[group].double()
        nowhere = FAR * torch.arange(1, near.shape[1] + 1).double()[None, :, None]
        places[:, 1:] = torch.where(distance.isinf()[..., None], nowhere, places[:, 1:])
        among = _distance(places, places)

        def cost(parameters: np.ndarray) -> float:
            length, nugget = np.exp(parameters)
            covariance = self._covariance(among, length)
            covariance.diagonal(dim1=-2, dim2=-1).add_(nugget)
            root = torch.linalg.cholesky(covariance[:, 1:, 1:])
            weights = torch.cholesky_solve(covariance[:, 1:, :1], root)
            residual = torch.cat([torch.ones_like(weights[:, :1]), -weights], dim=1)
            error = (residual.mT @ products @ residual).squeeze()
            variance = (covariance[:, :1] @ residual).squeeze()
            return float((error / variance).mean().log() + variance.log().mean())

        start = np.log([float(self.wavelength), 1e-2])
        bounds = [tuple(start[0] + np.log([0.01, 100.0])), (np.log(NUGGET_LEAST), 0.0)]
        found = minimize(cost, start, method="Nelder-Mead", bounds=bounds, options={"xatol": 0.02, "fatol": 1e-4})
        length, nugget = np.exp(found.x)
        self.length, self.nugget = torch.tensor(length).float(), torch.tensor(nugget).float()

    def _products(self, members: Tensor) -> Float[Tensor, "N N"]:
        """Mean products of the members' values, as the likelihood needs them."""
        values = self.values[members].float() - self.mean
        return (values @ values.T).double() / values.shape[1]

    def _covariance(self, distance: Tensor, length: Tensor | float) -> Tensor:
        covariance = torch.sinc(2 * distance / self.wavelength) * torch.exp(-distance / length)
        return covariance if self.has_responses else covariance**2

    def interpolated(self, positions: Float[Tensor, "B 3"]) -> tuple[Float[Tensor, "B C"], Float[Tensor, " B"]]:
        """Interpolated values, and the share of their variance that the known ones leave open, 0…1."""
        distance, near = _distance(positions, self.places).topk(min(NEIGHBOURS, len(self.places)), largest=False)
        around = self.places[near]
        covariance = self._covariance(_distance(around, around), self.length)
        covariance = covariance + self.nugget * torch.eye(near.shape[1], device=covariance.device)
        towards = self._covariance(distance, self.length)
        weights = _solve(covariance, towards)
        known = self.values[near].float() - self.mean
        values = (weights[:, None] @ known).squeeze(1) + self.mean
        return values, (1 - (weights * towards).sum(dim=-1)).clamp(0, 1)

    def channels(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B elements 2"]:
        """Element responses y, real and imaginary, up to one scale for all; only where responses are interpolated."""
        return self.interpolated(positions)[0].unflatten(-1, (-1, 2))

    def forward(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B 90 360"]:
        """Predicted picture: of the interpolated responses, or the interpolated one."""
        if self.has_responses:
            return self.beamformer(self.channels(positions))
        picture = (self.interpolated(positions)[0] / 255).clamp(0, 1)
        return picture.unflatten(-1, (len(ELEVATIONS_DEG), len(AZIMUTHS_DEG)))

    def load_state_dict(self, state_dict: Mapping[str, Any], strict: bool = True, assign: bool = False) -> Any:
        """As of every module; what is kept has the shape it has in the file."""
        for name in ("places", "values", "mean"):
            if name in state_dict:
                setattr(self, name, torch.empty_like(state_dict[name]))
        return super().load_state_dict(state_dict, strict, assign)


def _distance(a: Float[Tensor, "*b n 3"], b: Float[Tensor, "*b m 3"]) -> Float[Tensor, "*b n m"]:
    # By differences: torch.cdist's faster way is exact to millimetres only.
    return torch.linalg.vector_norm(a[..., :, None, :] - b[..., None, :, :], dim=-1)


def _solve(matrix: Float[Tensor, "B N N"], right: Float[Tensor, "B N"]) -> Float[Tensor, "B N"]:
    if not torch.compiler.is_exporting():
        return torch.linalg.solve(matrix, right)
    # ONNX has no solver: Gauss-Jordan elimination, which needs no pivots where the matrix is positive definite.
    rows = torch.cat([matrix, right[..., None]], dim=-1)
    for k in range(matrix.shape[-1]):
        pivot = rows[:, k : k + 1] / rows[:, k : k + 1, k : k + 1]
        others = rows - rows[:, :, k : k + 1] * pivot
        rows = torch.cat([others[:, :k], pivot, others[:, k + 1 :]], dim=1)
    return rows[..., -1]
