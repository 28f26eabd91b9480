"""What every learned model is: a map from transmitter positions to pictures, and the loss it is trained with."""

from __future__ import annotations

import numpy as np
import torch
from jaxtyping import Float
from pytorch_msssim import ssim as gaussian_ssim
from torch import Tensor, nn

from simulate.angular_grid import AZIMUTHS_DEG, ELEVATIONS_DEG
from simulate.array import PlanarArray

L1_WEIGHT, SSIM_WEIGHT = 0.7, 0.3
"""The paper's composite loss."""


def loss(prediction: Float[Tensor, "B 90 360"], truth: Float[Tensor, "B 90 360"]) -> Float[Tensor, ""]:
    """0.7 L1 + 0.3 (1 − SSIM) of pictures on the scale 0…1.

    The SSIM of the loss has a Gaussian window, separable and so ten times faster than scikit-image's uniform one;
    reported figures are scikit-image's.
    """
    # Spectra as channels of one picture: the mean is the same, and the convolutions are several times faster so.
    similarity = gaussian_ssim(prediction[None], truth[None], data_range=1.0)
    return L1_WEIGHT * (prediction - truth).abs().mean() + SSIM_WEIGHT * (1 - similarity)


class SpectrumModel(nn.Module):
    """Base of the models: ``forward`` takes positions [B, 3] in metres and gives pictures [B, 90, 360].

    Args:
        region: corners (min, max) of the box of training positions, metres.
    """

    region: Tensor
    beamformer: Beamformer
    """Of models that predict responses."""

    def __init__(self, region: Float[np.ndarray, "2 3"]):
        super().__init__()
        self.register_buffer("region", torch.as_tensor(region, dtype=torch.float32))

    def responses(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B elements 2"]:
        """Predicted element responses, real and imaginary part; of models with ``has_responses`` only."""
        raise NotImplementedError(f"{type(self).__name__} predicts spectra alone")

    @property
    def has_responses(self) -> bool:
        """Whether the model predicts ``responses``, which its ``beamformer`` turns into a spectrum."""
        return False

    def predict(
        self, positions: Float[Tensor, "B 3"]
    ) -> tuple[Float[Tensor, "B 90 360"], Float[Tensor, "B elements 2"] | None]:
        """Predicted pictures, and the element responses they are made of where the model knows them."""
        if not self.has_responses:
            return self(positions), None
        responses = self.responses(positions)
        return self.beamformer(responses), responses

    def scaled(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B 3"]:
        """Positions with the box of training positions at −1…1."""
        low, high = self.region
        return 2 * (positions - low) / (high - low) - 1

    def loss(self, positions: Float[Tensor, "B 3"], pictures: Float[Tensor, "B 90 360"]) -> Float[Tensor, ""]:
        """What a training step lowers; of most models the paper's composite loss of whole pictures."""
        return loss(self(positions), pictures)


class Beamformer(nn.Module):
    """Element responses -> the picture the array makes of them: S = |A y|, min–max normalised.

    Args:
        array: the gateway's array.
    """

    steering: Tensor

    def __init__(self, array: PlanarArray):
        super().__init__()
        steering = array.steering.reshape(-1, array.elements)
        self.register_buffer("steering", on_pairs(steering.T), persistent=False)

    def forward(self, responses: Float[Tensor, "B elements 2"]) -> Float[Tensor, "B 90 360"]:
        """Pictures of element responses (real, imaginary), whatever the responses' scale and common phase."""
        spectrum = power((responses.flatten(1) @ self.steering).unflatten(-1, (-1, 2))).clamp_min(1e-12).sqrt()
        low = spectrum.amin(-1, keepdim=True)
        span = spectrum.amax(-1, keepdim=True) - low
        return ((spectrum - low) / span.clamp_min(1e-6)).unflatten(-1, (len(ELEVATIONS_DEG), len(AZIMUTHS_DEG)))


def power(field: Float[Tensor, "*shape 2"]) -> Float[Tensor, "*shape"]:
    """|F|² of pairs (real, imaginary)."""
    real, imaginary = field.unbind(-1)
    return real**2 + imaginary**2


def on_pairs(matrix: np.ndarray) -> Float[Tensor, "2*n 2*m"]:
    """A complex matrix [n, m] as the real one that does to flattened pairs x what it does to numbers: x M."""
    pairs = np.stack([matrix, 1j * matrix], axis=1)[..., None]
    return torch.from_numpy(np.concatenate([pairs.real, pairs.imag], axis=-1)).float().flatten(2).flatten(0, 1)
