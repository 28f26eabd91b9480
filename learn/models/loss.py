"""The paper's composite loss of predicted spectra, 0.7 L1 + 0.3 (1 − SSIM)."""

from __future__ import annotations

from jaxtyping import Float
from pytorch_msssim import ssim as gaussian_ssim
from torch import Tensor

L1_WEIGHT, SSIM_WEIGHT = 0.7, 0.3
"""Weights of the two terms in the paper."""


def composite_loss(prediction: Float[Tensor, "B 90 360"], truth: Float[Tensor, "B 90 360"]) -> Float[Tensor, ""]:
    """0.7 L1 + 0.3 (1 − SSIM), averaged over the batch.

    The SSIM of the loss uses a Gaussian window, which is separable and thus ten times faster than the uniform window of
    scikit-image, by which reported scores are computed.

    Args:
        prediction: predicted spectra, 0…1.
        truth: true spectra, 0…1.
    """
    # The batch is passed as one image with B colour planes: the mean is the same, and the convolutions are several
    # times faster.
    similarity = gaussian_ssim(prediction[None], truth[None], data_range=1.0)
    return L1_WEIGHT * (prediction - truth).abs().mean() + SSIM_WEIGHT * (1 - similarity)
