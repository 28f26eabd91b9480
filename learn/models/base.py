"""Base class of the models, which map transmitter positions to spectra, and the layer that does beamforming."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch
from jaxtyping import Float, Int
from torch import Tensor, nn

from learn.models.encoding import TransmitterEncoding
from learn.models.loss import coarse_loss, composite_loss
from learn.models.quadrature import Quadrature
from learn.models.splat import Splats
from simulate.dataset.dataset_folder import Dataset
from simulate.spectra.angular_grid import COLUMNS, ROWS
from simulate.spectra.beamformer import Beamformer

Report = Callable[[str, int, int], None]
"""Takes a phase of a fit, a number of steps done, and the largest number of steps the phase can take."""


WEAK = 0.1
"""ε of ``responses_loss``: the power below which a spectrum counts less, relative to the mean power."""


class SpectrumModel(nn.Module):
    """Base class of the models: ``forward`` takes positions [B, 3] in metres and returns spectra [B, 90, 360], 0…1.

    A subclass is built with (region, beamformer, wavelength, **options), and a table lists it. A
    model that can do more than predict spectra also overrides some of the methods below.

    Args:
        region: corners (min, max) of the box of training positions, metres, world frame.
        wavelength: metres.
    """

    region: Tensor
    wavelength: Tensor
    beamforming: BeamformingLayer
    """Computes spectra from ``responses``; only models with ``has_responses`` have one."""

    encoding: TransmitterEncoding
    """Encodes the transmitter's position; only networks have one."""

    report: Report = staticmethod(lambda phase, done, total: None)
    """Called by ``fit`` with what is being done, and how many of how many steps of it are done."""

    def __init__(self, region: Float[np.ndarray, "2 3"], wavelength: float):
        super().__init__()
        self.register_buffer("region", torch.as_tensor(region, dtype=torch.float32))
        self.register_buffer("wavelength", torch.tensor(wavelength, dtype=torch.float32))

    def predict(
        self, positions: Float[Tensor, "B 3"]
    ) -> tuple[Float[Tensor, "B 90 360"], Float[Tensor, "B elements 2"] | None]:
        """Predicted spectra, and the element responses they are computed from; None: the model has no responses.

        Args:
            positions: transmitter positions, metres, world frame.
        """
        if not self.has_responses:
            return self(positions), None
        responses = self.responses(positions)
        return self.beamforming(responses), responses

    @property
    def trains_on_few_pixels(self) -> bool:
        """Whether most training steps look at a few pixels only (``coarse_loss``): unless a model has a ``loss`` of its
        own."""
        return type(self).loss is SpectrumModel.loss

    # --- capabilities that only some models have -----------------------------------------------------------

    @property
    def has_responses(self) -> bool:
        """Whether the model predicts element ``responses``, from which ``beamforming`` computes the spectrum."""
        return False

    def responses(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B elements 2"]:
        """Predicted element responses (real, imaginary), up to one common factor per spectrum.

        Raises:
            NotImplementedError: the model predicts no responses.
        """
        raise NotImplementedError(f"{type(self).__name__} predicts no responses")

    @property
    def traces_rays(self) -> bool:
        """Whether predictions need the ray tracer, so that the model is no function of tensors alone."""
        return False

    @property
    def has_primitives(self) -> bool:
        """Whether the model consists of Gaussian primitives, which ``splats`` returns."""
        return False

    def splats(self, positions: Float[Tensor, "B 3"]) -> Splats:
        """The primitives as they are blended for each transmitter position.

        Raises:
            NotImplementedError: the model has no primitives.
        """
        raise NotImplementedError(f"{type(self).__name__} has no primitives")

    def field(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B H W 2"] | None:
        """Complex field F(φ, θ) on the model's own grid (real, imaginary); None: the model has no field."""
        return None

    def uncertainty(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, " B"] | None:
        """Variance of the prediction relative to the field's variance, 0…1; None: the model does not compute it."""
        return None

    def fit(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> str:
        """Fit a model whose registry entry has ``by_steps=None``.

        Args:
            dataset: spectra with their positions.
            known: indices of the spectra to fit to.

        Returns:
            What was found, as a sentence that ``bisplat train`` prints.

        Raises:
            NotImplementedError: the model is trained by steps.
        """
        raise NotImplementedError(f"{type(self).__name__} is trained by steps")

    def refit(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> None:
        """Fit a fitted model to other known spectra, with the choices that ``fit`` made.

        Args:
            dataset: as for ``fit``.
            known: indices of the spectra to fit to.
        """
        raise NotImplementedError(f"{type(self).__name__} is trained by steps")

    def undecayed(self) -> list[nn.Parameter]:
        """Parameters that say where primitives are and what shape they have, whose weights must not decay; none."""
        return []

    # --- for subclasses ------------------------------------------------------------------------------------

    def loss(self, positions: Float[Tensor, "B 3"], spectra: Float[Tensor, "B 90 360"]) -> Float[Tensor, ""]:
        """Loss of a training step: the paper's composite loss of whole spectra, unless a model overrides it.

        Args:
            positions: transmitter positions of a batch, metres, world frame.
            spectra: true spectra of the batch, 0…1.
        """
        return composite_loss(self(positions), spectra)

    def encoded(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B size"]:
        """Positions (metres, world frame) as the model's ``encoding`` has them."""
        return self.encoding(positions, self.region, self.wavelength)

    def responses_loss(
        self, positions: Float[Tensor, "B 3"], responses: Float[Tensor, "B elements 2"]
    ) -> Float[Tensor, ""]:
        """Loss of a training step of a model with ``has_responses``, where the true responses are known.

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
        """Predicted spectra at a few pixels; a model that can compute these alone overrides it.

        Args:
            positions: transmitter positions, metres, world frame.
            pixels: the pixels.
        """
        if self.has_responses:
            return self.beamforming.coarse(self.responses(positions), pixels)
        return self(positions)[:, pixels.rows][:, :, pixels.columns]

    def coarse_loss(
        self, positions: Float[Tensor, "B 3"], spectra: Float[Tensor, "B H W"], pixels: Quadrature
    ) -> Float[Tensor, ""]:
        """Loss of a training step that looks at a few pixels only.

        Args:
            positions: transmitter positions of a batch, metres, world frame.
            spectra: true spectra of the batch at these pixels, 0…1.
            pixels: the pixels.
        """
        if self.has_responses:  # its spectra are normalised over these pixels
            spectra = normalised(spectra.flatten(1)).view_as(spectra)
        return coarse_loss(self.coarse(positions, pixels), spectra, pixels)


class BeamformingLayer(nn.Module):
    """Computes the spectrum that the array measures from element responses y: S = |A y|, min–max normalised.

    Args:
        beamformer: the dataset's array and grid.
    """

    steering: Tensor

    def __init__(self, beamformer: Beamformer):
        super().__init__()
        steering = beamformer.steering.reshape(-1, beamformer.array.elements)
        self.register_buffer("steering", on_pairs(steering.T), persistent=False)

    def forward(self, responses: Float[Tensor, "B elements 2"]) -> Float[Tensor, "B 90 360"]:
        """Spectra, 0…1, of element responses (real, imaginary), whose scale and common phase have no effect.

        Those of responses that are all zero are black.
        """
        return self._received(responses, self.steering).unflatten(-1, (ROWS, COLUMNS))

    def coarse(self, responses: Float[Tensor, "B elements 2"], pixels: Quadrature) -> Float[Tensor, "B H W"]:
        """The spectra at a few pixels, min–max normalised over these."""
        steering = self.steering.unflatten(1, (ROWS, COLUMNS, 2))[:, pixels.rows][:, :, pixels.columns]
        return self._received(responses, steering.flatten(1)).unflatten(-1, (len(pixels.rows), len(pixels.columns)))

    def _received(
        self, responses: Float[Tensor, "B elements 2"], steering: Float[Tensor, "2*elements 2*P"]
    ) -> Float[Tensor, "B P"]:
        numbers = responses.flatten(1)
        largest = numbers.detach().abs().amax(1, keepdim=True)  # else the least power below darkens weak links
        field = (numbers / torch.where(largest > 0, largest, 1) @ steering).unflatten(-1, (-1, 2))
        return normalised(power(field).clamp_min(1e-12).sqrt())


def normalised(spectra: Float[Tensor, "B P"]) -> Float[Tensor, "B P"]:
    """Spectra scaled from the smallest to the largest of their pixels to 0…1."""
    low = spectra.amin(-1, keepdim=True)
    return (spectra - low) / (spectra.amax(-1, keepdim=True) - low).clamp_min(1e-6)


def power(field: Float[Tensor, "*shape 2"]) -> Float[Tensor, "*shape"]:
    """Power |F|² of complex numbers F given as pairs (real, imaginary)."""
    real, imaginary = field.unbind(-1)
    return real**2 + imaginary**2


def on_pairs(matrix: np.ndarray) -> Float[Tensor, "2*n 2*m"]:
    """The real matrix that multiplies flattened (real, imaginary) pairs as a complex matrix multiplies complex numbers.

    Args:
        matrix: complex [n, m], which row vectors x are multiplied by: x M.
    """
    pairs = np.stack([matrix, 1j * matrix], axis=1)[..., None]
    return torch.from_numpy(np.concatenate([pairs.real, pairs.imag], axis=-1)).float().flatten(2).flatten(0, 1)
