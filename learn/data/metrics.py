"""Scores of predicted spectra against true ones; every table reports these."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from skimage.metrics import structural_similarity

from scenes.files.errors import ParameterError
from simulate.spectra.angular_grid import COLUMNS, ROWS, AngularGrid
from simulate.spectra.spectrum import check_spectra


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


def ssim(
    prediction: Float[np.ndarray, "*batch 90 360"], truth: Float[np.ndarray, "*batch 90 360"]
) -> Float[np.ndarray, "*batch"]:
    """Structural similarity (SSIM [wang2004]) of predicted and true spectra: the value that all tables report.

    It is ``skimage.metrics.structural_similarity(prediction, truth, data_range=1)`` of each 90 × 360 picture, in double
    precision, and at most 1.

    Args:
        prediction: a spectrum or a stack of spectra, 0…1.
        truth: as many true spectra, 0…1: the grey levels of a dataset's pictures divided by 255.

    Returns:
        The SSIM of each pair; one number for one pair.

    Raises:
        ParameterError: other shapes, or grey levels instead of numbers from 0 to 1.

    >>> import bisplat
    >>> evaluation = bisplat.evaluate("runs/lab")
    >>> each = bisplat.ssim(evaluation.prediction, evaluation.truth)
    >>> each.shape == evaluation.test.shape, float(np.median(each)) == evaluation.metrics()["ssim_median"]
    (True, True)
    """
    prediction, truth = _pair(prediction, truth)
    pairs = zip(*(spectra.reshape(-1, ROWS, COLUMNS) for spectra in (prediction, truth)), strict=True)
    each = [structural_similarity(p.astype(np.float64), t.astype(np.float64), data_range=1) for p, t in pairs]
    return np.array(each).reshape(truth.shape[:-2])[()]


def ssim_of_each(
    prediction: Float[np.ndarray, "K 90 360"], truth: Float[np.ndarray, "K 90 360"]
) -> Float[np.ndarray, " K"]:
    """SSIM of each pair in the type of its arrays. Fits choose by it in single precision, which is faster.

    Args:
        prediction: predicted spectra, 0…1.
        truth: true spectra, 0…1, of the same float type.

    >>> truth = np.random.default_rng(0).uniform(size=(1, 90, 360))
    >>> ssim_of_each(truth, truth).round(6).tolist(), ssim_of_each(1 - truth, truth).tolist() < [0.0]
    ([1.0], True)
    """
    return np.array([structural_similarity(p, t, data_range=1) for p, t in zip(prediction, truth, strict=True)])


def aoa_error(
    prediction: Float[np.ndarray, "*batch 90 360"],
    truth: Float[np.ndarray, "*batch 90 360"],
    grid: AngularGrid = AngularGrid(),
) -> Float[np.ndarray, "*batch"]:
    """Error of the angle of arrival: the great-circle angle between the directions of the two maxima, degrees.

    The angle is also right across azimuth 0°, and near boresight, where directions of different azimuths are close.

    Args:
        prediction: a spectrum or a stack of spectra.
        truth: as many true spectra.
        grid: directions of their rows and columns, ``dataset.grid``; NeRF²'s by default.

    Returns:
        The angle of each pair, 0…180; one number for one pair.

    Raises:
        ParameterError: other shapes, or grey levels instead of numbers from 0 to 1.

    >>> prediction, truth = np.zeros((2, 90, 360))
    >>> prediction[0, 359] = truth[0, 1] = 1  # at the horizon, azimuths 359 and 1 degree
    >>> float(aoa_error(prediction, truth).round(3))
    2.0
    """
    prediction, truth = _pair(prediction, truth)
    cosine = (grid.dominant_direction(prediction) * grid.dominant_direction(truth)).sum(-1)
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))


def _pair(prediction: np.ndarray, truth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Predicted and true spectra, checked.

    Raises:
        ParameterError: as ``ssim``.
    """
    prediction, truth = check_spectra("prediction", prediction), check_spectra("truth", truth)
    if prediction.shape != truth.shape:
        raise ParameterError("prediction", f"expected shape {truth.shape}, that of truth, found {prediction.shape}")
    return prediction, truth
