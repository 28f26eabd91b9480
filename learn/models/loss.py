"""The paper's composite loss of predicted spectra, 0.7 L1 + 0.3 (1 − SSIM), at all pixels or at a few."""

from __future__ import annotations

from jaxtyping import Float
from pytorch_msssim import ssim as gaussian_ssim
from torch import Tensor

from learn.models.quadrature import Quadrature

L1_WEIGHT, SSIM_WEIGHT = 0.7, 0.3
"""Weights of the two terms in the paper."""

WINDOW, SIGMA = 5, 1.0
"""Size and standard deviation of the SSIM's Gaussian window at a few pixels."""


def composite_loss(
    prediction: Float[Tensor, "B 90 360"], truth: Float[Tensor, "B 90 360"], ssim_weight: float = SSIM_WEIGHT
) -> Float[Tensor, ""]:
    """0.7 L1 + 0.3 (1 − SSIM), averaged over the batch.

    The SSIM of the loss uses a Gaussian window. This is separable, and so ten times faster than the uniform window of
    scikit-image that reported scores use.
    """
    # The batch is passed as one image with B colour planes. The mean is the same, and the convolutions are several
    # times faster.
    similarity = gaussian_ssim(prediction[None], truth[None], data_range=1.0)
    return (1 - ssim_weight) * (prediction - truth).abs().mean() + ssim_weight * (1 - similarity)


def coarse_loss(
    prediction: Float[Tensor, "B H W"], truth: Float[Tensor, "B H W"], pixels: Quadrature
) -> Float[Tensor, ""]:
    """The composite loss at a few pixels: L1 weighted as the mean over all, and the SSIM of the coarser picture."""
    rows = (prediction - truth).abs().mean(dim=(0, 2))
    similarity = gaussian_ssim(prediction[None], truth[None], data_range=1.0, win_size=WINDOW, win_sigma=SIGMA)
    return L1_WEIGHT * rows @ rows.new_tensor(pixels.weights) + SSIM_WEIGHT * (1 - similarity)
