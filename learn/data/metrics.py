"""Scores of predicted spectra against true ones; every table reports these."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from skimage.metrics import structural_similarity

from simulate.spectra.angular_grid import AngularGrid


@dataclass(frozen=True)
class Scores:
    """Scores of K predicted spectra, one entry each.

    Attributes:
        ssim: ``skimage.metrics.structural_similarity(prediction, truth, data_range=1)``, at most 1.
        psnr: peak signal-to-noise ratio, dB, for a peak of 1; at most 100 dB.
        mae: mean absolute error, 0…1.
        aoa_error: angle between the directions of arrival of the two maxima, degrees.

    >>> ones = np.ones(3)
    >>> Scores(ssim=ones, psnr=30 * ones, mae=0.02 * ones, aoa_error=np.array([1.0, 2.0, 40.0])).summary()["psnr_mean"]
    30.0
    """

    ssim: Float[np.ndarray, " K"]
    psnr: Float[np.ndarray, " K"]
    mae: Float[np.ndarray, " K"]
    aoa_error: Float[np.ndarray, " K"]

    def summary(self) -> dict[str, float]:
        """Medians, means and the 5th percentile of the scores over the K spectra: a row of a table, by column name."""
        return {
            "ssim_median": float(np.median(self.ssim)),
            "ssim_mean": float(np.mean(self.ssim)),
            "ssim_p05": float(np.percentile(self.ssim, 5)),
            "psnr_mean": float(np.mean(self.psnr)),
            "mae_mean": float(np.mean(self.mae)),
            "aoa_error_median_deg": float(np.median(self.aoa_error)),
        }


def score(prediction: Float[np.ndarray, "K 90 360"], truth: Float[np.ndarray, "K 90 360"], grid: AngularGrid) -> Scores:
    """Score predicted spectra.

    Args:
        prediction: predicted spectra, 0…1.
        truth: true spectra, 0…1: the grey levels of a dataset's pictures divided by 255.
        grid: the dataset's grid, for the directions of arrival.

    Returns:
        All scores, computed in double precision.

    >>> truth = np.zeros((2, 90, 360))
    >>> truth[:, 30, 100] = 1
    >>> prediction = truth.copy()
    >>> prediction[1] = np.roll(truth[1], 10, axis=0)  # 10 degrees of elevation too high
    >>> scores = score(prediction, truth, AngularGrid())
    >>> scores.ssim.round(3).tolist()[0], scores.psnr.tolist()[0], scores.aoa_error.round(3).tolist()
    (1.0, 100.0, [0.0, 10.0])
    """
    prediction, truth = prediction.astype(np.float64), truth.astype(np.float64)
    squared_error = ((prediction - truth) ** 2).mean(axis=(1, 2))
    return Scores(
        ssim=ssim(prediction, truth),
        psnr=-10 * np.log10(np.maximum(squared_error, 1e-10)),
        mae=np.abs(prediction - truth).mean(axis=(1, 2)),
        aoa_error=aoa_error(prediction, truth, grid),
    )


def ssim(prediction: Float[np.ndarray, "K 90 360"], truth: Float[np.ndarray, "K 90 360"]) -> Float[np.ndarray, " K"]:
    """Structural similarity (SSIM) of each pair, as scikit-image computes it. All tables report this value.

    Args:
        prediction: predicted spectra, 0…1.
        truth: true spectra, 0…1, of the same float type; SSIM is computed in this type.

    >>> truth = np.random.default_rng(0).uniform(size=(1, 90, 360))
    >>> ssim(truth, truth).round(6).tolist(), ssim(1 - truth, truth).tolist() < [0.0]
    ([1.0], True)
    """
    return np.array([structural_similarity(p, t, data_range=1) for p, t in zip(prediction, truth, strict=True)])


def aoa_error(
    prediction: Float[np.ndarray, "K 90 360"], truth: Float[np.ndarray, "K 90 360"], grid: AngularGrid
) -> Float[np.ndarray, " K"]:
    """Great-circle angle between the directions of the two maxima, degrees.

    The angle is also right across azimuth 0°, and near boresight, where directions of different azimuths are close.

    Args:
        prediction: predicted spectra.
        truth: true spectra.
        grid: directions of their rows and columns.

    >>> predicted, truth = np.zeros((2, 1, 90, 360))
    >>> predicted[0, 60, 0] = truth[0, 60, 180] = 1  # elevation 60 degrees, azimuths 0 and 180 degrees
    >>> aoa_error(predicted, truth, AngularGrid()).round(3).tolist()
    [60.0]
    """
    cosine = (grid.dominant_direction(prediction) * grid.dominant_direction(truth)).sum(-1)
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))
