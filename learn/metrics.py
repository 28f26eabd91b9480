"""How good a predicted spectrum is: the figures every table reports."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from skimage.metrics import structural_similarity

from simulate.spectrum import dominant_direction


@dataclass(frozen=True)
class Scores:
    """Figures of K spectra, one entry each.

    Attributes:
        ssim: ``skimage.metrics.structural_similarity(prediction, truth, data_range=1)``.
        psnr: peak signal-to-noise ratio, dB, peak 1.
        mae: mean absolute error.
        aoa_error: angle between the two maxima's directions of arrival, degrees.
    """

    ssim: Float[np.ndarray, " K"]
    psnr: Float[np.ndarray, " K"]
    mae: Float[np.ndarray, " K"]
    aoa_error: Float[np.ndarray, " K"]

    def summary(self) -> dict[str, float]:
        """The figures of a table's row."""
        return {
            "ssim_median": float(np.median(self.ssim)),
            "ssim_mean": float(np.mean(self.ssim)),
            "ssim_p05": float(np.percentile(self.ssim, 5)),
            "psnr_mean": float(np.mean(self.psnr)),
            "mae_mean": float(np.mean(self.mae)),
            "aoa_error_median_deg": float(np.median(self.aoa_error)),
        }


def score(prediction: Float[np.ndarray, "K 90 360"], truth: Float[np.ndarray, "K 90 360"]) -> Scores:
    """Score predicted pictures against true ones, both on the scale 0…1 of the dataset's pictures."""
    prediction, truth = prediction.astype(np.float64), truth.astype(np.float64)
    squared = ((prediction - truth) ** 2).mean(axis=(1, 2))
    return Scores(
        ssim=ssim(prediction, truth),
        psnr=-10 * np.log10(np.maximum(squared, 1e-10)),
        mae=np.abs(prediction - truth).mean(axis=(1, 2)),
        aoa_error=aoa_error(prediction, truth),
    )


def ssim(prediction: Float[np.ndarray, "K 90 360"], truth: Float[np.ndarray, "K 90 360"]) -> Float[np.ndarray, " K"]:
    """scikit-image's SSIM of each pair, the one definition behind every reported number."""
    return np.array([structural_similarity(p, t, data_range=1) for p, t in zip(prediction, truth, strict=True)])


def aoa_error(
    prediction: Float[np.ndarray, "K 90 360"], truth: Float[np.ndarray, "K 90 360"]
) -> Float[np.ndarray, " K"]:
    """Great-circle angle between the dominant directions, degrees: periodic in azimuth, sound near boresight."""
    cosine = (dominant_direction(prediction) * dominant_direction(truth)).sum(-1)
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))
