"""The paper's composite loss of predicted spectra."""

from __future__ import annotations

from jaxtyping import Float
from pytorch_msssim import ssim as gaussian_ssim
from torch import Tensor

L1_WEIGHT, SSIM_WEIGHT = 0.7, 0.3
"""The paper's composite loss."""


def composite_loss(prediction: Float[Tensor, "B 90 360"], truth: Float[Tensor, "B 90 360"]) -> Float[Tensor, ""]:
    """0.7 L1 + 0.3 (1 − SSIM) of spectra on the scale 0…1.

    The SSIM of the loss has a Gaussian window, separable and so ten times faster than scikit-image's uniform one;
    reported figures are scikit-image's.
    """
    # Spectra as channels of one picture: the mean is the same, and the convolutions are several times faster so.
    similarity = gaussian_ssim(prediction[None], truth[None], data_range=1.0)
    return L1_WEIGHT * (prediction - truth).abs().mean() + SSIM_WEIGHT * (1 - similarity)
