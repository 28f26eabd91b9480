"""What some models can do beyond predicting spectra; callers ask ``isinstance(model, HasPrimitives)`` and so on.

A model has a capability if its class has the methods. Only ``PredictsResponses`` is a base class, since it also gives
methods.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float, Int
from torch import Tensor

from learn.models.base import BeamformingLayer, SpectrumModel, normalised
from learn.models.loss import coarse_loss
from learn.models.quadrature import Quadrature
from learn.models.splat import Splats
from scenes.scene.description import Scene
from simulate.dataset.dataset_folder import Dataset
from simulate.spectra.beamformer import Beamformer

WEAK = 0.1
"""ε of ``responses_loss``: the power below which a spectrum counts less, relative to the mean power."""


@runtime_checkable
class FitsInClosedForm(Protocol):
    """Is fitted to known spectra [n, 90, 360] and positions [n, 3] at once, not by gradient steps.

    The run's weights are those after ``refit``, with which a model keeps all known spectra.
    """

    def fit(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> str:
        """Fit to known spectra, and choose what is to be chosen.

        Args:
            dataset: spectra with their positions.
            known: indices of the spectra to fit to.

        Returns:
            What was found, as a sentence that ``bisplat train`` prints.
        """

    def refit(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> None:
        """Fit the fitted model to other known spectra, with the choices that ``fit`` made.

        Args:
            dataset: as for ``fit``.
            known: indices of the spectra to fit to.
        """


@runtime_checkable
class HasPrimitives(Protocol):
    """Consists of Gaussian primitives, ``splats``, which blend into the complex ``field`` [B, H, W, 2] of B positions.

    The viewer draws the primitives, and the phase of the field.
    """

    def splats(self, positions: Float[Tensor, "B 3"]) -> Splats:
        """The primitives as they are blended for each transmitter position, metres, world frame."""

    def field(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B H W 2"]:
        """The complex field F(φ, θ) on the model's own grid (real, imaginary)."""


@runtime_checkable
class StatesVariance(Protocol):
    """States the variance [B] of its predictions at B positions relative to the field's variance, 0…1.

    Runs scale it to a standard deviation of spectra (``learn.training.deviation``).
    """

    def uncertainty(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, " B"] | None:
        """The variance at transmitter positions, metres, world frame; None: this fitted model knows none."""


@runtime_checkable
class TracesRays(Protocol):
    """Traces rays in a scene for the responses [B, elements, 2] at B positions, so needs the ray tracer to predict.

    It is no function of tensors alone, and is not exported.
    """

    @property
    def corrected(self) -> Scene:
        """The scene that it traces."""


@runtime_checkable
class HasOwnLoss(Protocol):
    """Has a ``training_loss`` of its own, in place of the composite loss of B predicted and true spectra [B, 90, 360].

    All its training steps then look at whole spectra.
    """

    def training_loss(self, positions: Float[Tensor, "B 3"], spectra: Float[Tensor, "B 90 360"]) -> Float[Tensor, ""]:
        """Loss of a training step.

        Args:
            positions: transmitter positions of a batch, metres, world frame.
            spectra: true spectra of the batch, 0…1.
        """


class PredictsResponses(SpectrumModel, ABC):
    """Predicts element ``responses`` [B, elements, 2], from which ``beamforming`` computes the spectra [B, 90, 360].

    Where responses are known, or are found behind pictures, it learns from these.

    Args:
        region: as for ``SpectrumModel``.
        beamformer: the dataset's array and grid.
        wavelength: metres.

    >>> import bisplat
    >>> run = bisplat.train("data/lab", "runs/responses", model="mlp-responses", steps=2)
    >>> isinstance(run.model, bisplat.PredictsResponses), run.model.beamforming.steering.shape
    (True, torch.Size([32, 64800]))
    """

    beamforming: BeamformingLayer

    def __init__(self, region: Float[np.ndarray, "2 3"], beamformer: Beamformer, wavelength: float):
        super().__init__(region, wavelength)
        self.beamforming = BeamformingLayer(beamformer)

    @abstractmethod
    def responses(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B elements 2"]:
        """Predicted element responses (real, imaginary), up to one common factor per spectrum; each model has its own.

        Args:
            positions: transmitter positions, metres, world frame.
        """

    def forward(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B 90 360"]:
        """Predicted spectrum: the array's spectrum of ``responses``, min–max normalised."""
        return self.beamforming(self.responses(positions))

    def predict(
        self, positions: Float[Tensor, "B 3"]
    ) -> tuple[Float[Tensor, "B 90 360"], Float[Tensor, "B elements 2"] | None]:
        """Predicted spectra, and the responses they are computed from.

        Args:
            positions: transmitter positions, metres, world frame.
        """
        responses = self.responses(positions)
        return self.beamforming(responses), responses

    def responses_loss(
        self, positions: Float[Tensor, "B 3"], responses: Float[Tensor, "B elements 2"]
    ) -> Float[Tensor, ""]:
        """Loss of a training step where the true responses are known.

        This is the mean of |ŷ − y|² / (|y|² + ε) over the batch: each spectrum counts the same, near or far, but for
        those that receive almost nothing.

        Args:
            positions: transmitter positions of a batch, metres, world frame.
            responses: true element responses (real, imaginary), scaled to a mean square magnitude of 1 over all spectra
                and elements.
        """
        error = (self.responses(positions) - responses).square().sum(dim=-1).mean(dim=-1)
        return (error / (responses.square().sum(dim=-1).mean(dim=-1) + WEAK)).mean()

    def coarse(self, positions: Float[Tensor, "B 3"], pixels: Quadrature) -> Float[Tensor, "B H W"]:
        """Predicted spectra at a few pixels, normalised over these.

        Args:
            positions: transmitter positions, metres, world frame.
            pixels: the pixels.
        """
        return self.beamforming.coarse(self.responses(positions), pixels)

    def coarse_loss(
        self, positions: Float[Tensor, "B 3"], spectra: Float[Tensor, "B H W"], pixels: Quadrature
    ) -> Float[Tensor, ""]:
        """As for ``SpectrumModel``, of true spectra normalised over these pixels too."""
        spectra = normalised(spectra.flatten(1)).view_as(spectra)
        return coarse_loss(self.coarse(positions, pixels), spectra, pixels)
