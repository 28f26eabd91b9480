"""What every model is: a map from transmitter positions to spectra, with capabilities that not every model has."""

from __future__ import annotations

import numpy as np
import torch
from jaxtyping import Float, Int
from torch import Tensor, nn

from learn.models.loss import composite_loss
from learn.models.splat import Splats
from simulate.angular_grid import AZIMUTHS_DEG, ELEVATIONS_DEG
from simulate.array import PlanarArray
from simulate.dataset import Dataset


class SpectrumModel(nn.Module):
    """Base of the models: ``forward`` takes positions [B, 3] in metres and gives spectra [B, 90, 360], 0…1.

    A subclass is called with (region, array, **options); ``learn.models.registry`` names its options' defaults. It
    overrides those of the methods below that it can do more in than predict spectra.

    Args:
        region: corners (min, max) of the box of training positions, metres, world frame.
    """

    region: Tensor
    beamformer: Beamformer
    """Turns ``responses`` into spectra; only models with ``has_responses`` have one."""

    def __init__(self, region: Float[np.ndarray, "2 3"]):
        super().__init__()
        self.register_buffer("region", torch.as_tensor(region, dtype=torch.float32))

    def predict(
        self, positions: Float[Tensor, "B 3"]
    ) -> tuple[Float[Tensor, "B 90 360"], Float[Tensor, "B elements 2"] | None]:
        """Predicted spectra, and the element responses they are made of where the model knows them."""
        if not self.has_responses:
            return self(positions), None
        responses = self.responses(positions)
        return self.beamformer(responses), responses

    # --- what a model may be able to do --------------------------------------------------------------------

    @property
    def has_responses(self) -> bool:
        """Whether the model predicts element ``responses``, which its ``beamformer`` turns into a spectrum."""
        return False

    def responses(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B elements 2"]:
        """Predicted element responses, real and imaginary part, up to one common factor per spectrum."""
        raise NotImplementedError(f"{type(self).__name__} predicts spectra alone")

    @property
    def has_primitives(self) -> bool:
        """Whether the model is made of Gaussian primitives, which ``splats`` returns."""
        return False

    def splats(self, positions: Float[Tensor, "B 3"]) -> Splats:
        """The primitives as they are blended for each transmitter position."""
        raise NotImplementedError(f"{type(self).__name__} has no primitives")

    def field(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B H W 2"] | None:
        """Complex field F(φ, θ) on the model's own grid, real and imaginary part; None where the model has none."""
        return None

    def uncertainty(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, " B"] | None:
        """Share of the field's variance that the known spectra leave open, 0…1; None where the model cannot tell."""
        return None

    def fit(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> None:
        """Fit a model whose registry entry says ``fit="closed form"``.

        Args:
            dataset: spectra with their positions.
            known: indices of the spectra to fit to.
        """
        raise NotImplementedError(f"{type(self).__name__} is trained by steps")

    # --- for subclasses ------------------------------------------------------------------------------------

    def scaled(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B 3"]:
        """Positions with the box of training positions at −1…1."""
        low, high = self.region
        return 2 * (positions - low) / (high - low) - 1

    def loss(self, positions: Float[Tensor, "B 3"], spectra: Float[Tensor, "B 90 360"]) -> Float[Tensor, ""]:
        """The loss of a training step: the paper's composite loss of whole spectra, unless a model overrides it."""
        return composite_loss(self(positions), spectra)


class Beamformer(nn.Module):
    """Element responses -> the spectrum that the array measures: S = |A y|, min–max normalised.

    Args:
        array: the gateway's array.
    """

    steering: Tensor

    def __init__(self, array: PlanarArray):
        super().__init__()
        steering = array.steering.reshape(-1, array.elements)
        self.register_buffer("steering", on_pairs(steering.T), persistent=False)

    def forward(self, responses: Float[Tensor, "B elements 2"]) -> Float[Tensor, "B 90 360"]:
        """Spectra of element responses (real, imaginary); the responses' scale and common phase do not matter."""
        spectrum = power((responses.flatten(1) @ self.steering).unflatten(-1, (-1, 2))).clamp_min(1e-12).sqrt()
        low = spectrum.amin(-1, keepdim=True)
        span = spectrum.amax(-1, keepdim=True) - low
        return ((spectrum - low) / span.clamp_min(1e-6)).unflatten(-1, (len(ELEVATIONS_DEG), len(AZIMUTHS_DEG)))


def power(field: Float[Tensor, "*shape 2"]) -> Float[Tensor, "*shape"]:
    """|F|² of pairs (real, imaginary)."""
    real, imaginary = field.unbind(-1)
    return real**2 + imaginary**2


def on_pairs(matrix: np.ndarray) -> Float[Tensor, "2*n 2*m"]:
    """The real matrix that multiplies flattened (real, imaginary) pairs x as the complex matrix M [n, m] does: x M."""
    pairs = np.stack([matrix, 1j * matrix], axis=1)[..., None]
    return torch.from_numpy(np.concatenate([pairs.real, pairs.imag], axis=-1)).float().flatten(2).flatten(0, 1)
