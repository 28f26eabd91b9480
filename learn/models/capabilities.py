"""Abilities of some models beyond predicting spectra. Callers ask ``isinstance(model, HasPrimitives)`` and so on.

A model has an ability if its class has the methods. Only ``PredictsResponses`` is a base class, since it also provides
methods."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float, Int
from torch import Tensor

from learn.models.base import Beamformed, BeamformingLayer, SpectrumModel, normalised
from learn.models.quadrature import Quadrature, coarse_loss
from learn.models.splatting.splat import Splats
from scenes.scene.description import Scene
from simulate.dataset.dataset import Dataset
from simulate.spectra.beamformer import Beamformer

WEAK = 0.1
"""ε of ``responses_loss``: power below which a spectrum counts less, relative to the mean power."""


@runtime_checkable
class FitsInClosedForm(Protocol):
    """Is fitted to known spectra [n, 90, 360] and positions [n, 3] at once, instead of by gradient steps."""

    def fit(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> str:
        """Fit to known spectra, and make the model's choices, such as its weights."""

    def refit(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> None:
        """Fit the fitted model to other known spectra, with the choices that ``fit`` made."""


@runtime_checkable
class HasPrimitives(Protocol):
    """Consists of Gaussian primitives, ``splats``, which blend into the complex ``field`` [B, H, W, 2] of B places."""

    def splats(self, positions: Float[Tensor, "B 3"]) -> Splats:
        """The primitives as they are blended for each transmitter position (metres, world frame)."""

    def field(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B H W 2"]:
        """The complex field F(φ, θ) on the model's own grid (real, imaginary)."""


@runtime_checkable
class TracesRays(Protocol):
    """Traces rays in a scene to predict the responses [B, elements, 2] at B positions, so that it needs the ray tracer.

    Such a model is not a function of tensors alone, and cannot be exported.
    """

    @property
    def corrected(self) -> Scene:
        """The scene that it traces."""


@runtime_checkable
class HasOwnLoss(Protocol):
    """Has its own ``training_loss`` in place of the composite loss of predicted and true spectra [B, 90, 360]."""

    def training_loss(self, positions: Float[Tensor, "B 3"], spectra: Float[Tensor, "B 90 360"]) -> Float[Tensor, ""]:
        """Loss of a training step."""


def relative_error(
    found: Float[Tensor, "B elements *subcarriers 2"], truth: Float[Tensor, "B elements *subcarriers 2"]
) -> Float[Tensor, ""]:
    """The mean of ``|ŷ − y|² / (|y|² + ε)`` over a batch of responses (real, imaginary)."""
    error = (found - truth).square().sum(dim=-1).flatten(1).mean(dim=-1)
    return (error / (truth.square().sum(dim=-1).flatten(1).mean(dim=-1) + WEAK)).mean()


class PredictsResponses(SpectrumModel, ABC):
    """Base class of the models that predict element responses, from which the array's spectra are computed.

    A subclass implements ``responses``; ``beamforming`` computes the spectra [B, 90, 360] from these. Where element
    responses are known, or are found behind pictures, the model is trained on them instead of on spectra.

    Args:
        region: [2, 3] corners (min, max) of the box of training positions, metres, world frame.
        beamformer: the dataset's array and grid.
        wavelength: wavelength, metres.

    Attributes:
        beamforming: the layer that computes spectra from responses.

    Example:
        >>> import bisplat, torch
        >>> run = bisplat.train("data/lab", "runs/responses", model="mlp-responses", steps=2)
        >>> isinstance(run.model, bisplat.PredictsResponses)
        True
        >>> run.model.responses(torch.tensor([[2.5, 3.0, 1.2]], device=run.model.region.device)).shape
        torch.Size([1, 16, 2])
    """

    beamforming: BeamformingLayer

    def __init__(self, region: Float[np.ndarray, "2 3"], beamformer: Beamformer, wavelength: float):
        super().__init__(region, wavelength)
        self.beamforming = BeamformingLayer(beamformer)

    @abstractmethod
    def responses(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B elements 2"]:
        """Predict element responses (real, imaginary) at positions, metres, up to one common factor per spectrum."""

    def forward(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B 90 360"]:
        """Predict spectra [B, 90, 360], 0…1: those of ``responses``, min–max normalised."""
        return self.beamforming(self.responses(positions))

    def predict(
        self, positions: Float[Tensor, "B 3"]
    ) -> tuple[Float[Tensor, "B 90 360"], Float[Tensor, "B elements 2"] | None]:
        responses = self.responses(positions)
        return self.beamforming(responses), responses

    def beamformed(self) -> Beamformed | None:
        """As for ``SpectrumModel``. None if the class has its own ``predict``, whose spectra may be others."""
        own = type(self).predict is not PredictsResponses.predict
        return None if own else Beamformed(self.responses, self.beamforming)

    def responses_loss(
        self, positions: Float[Tensor, "B 3"], responses: Float[Tensor, "B elements 2"]
    ) -> Float[Tensor, ""]:
        """Loss of a training step where the true responses are known, scaled to a mean square magnitude of 1.

        It is the mean of ``|ŷ − y|² / (|y|² + ε)`` over the batch. Every spectrum thus counts the same, whether the
        transmitter is near or far, except those that receive almost no power.
        """
        return relative_error(self.responses(positions), responses)

    def coarse(self, positions: Float[Tensor, "B 3"], pixels: Quadrature) -> Float[Tensor, "B H W"]:
        """As for ``SpectrumModel``, min–max normalised over these pixels."""
        return self.beamforming.coarse(self.responses(positions), pixels)

    def coarse_loss(
        self, positions: Float[Tensor, "B 3"], spectra: Float[Tensor, "B H W"], pixels: Quadrature
    ) -> Float[Tensor, ""]:
        """As for ``SpectrumModel``, with true spectra that are normalised over these pixels too."""
        spectra = normalised(spectra.flatten(1)).view_as(spectra)
        return coarse_loss(self.coarse(positions, pixels), spectra, pixels)


def no_comparable_phases(dataset: Dataset) -> str:
    """What was expected and what was found, for the user, where phases of two positions cannot be compared."""
    apart = dataset.phases_recorded_per_position
    found = "phases that cannot be compared between positions" if apart else "pictures alone"
    return f"expected element responses with their phases, found {found}"
