"""Scores of predicted spectra against true ones."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8
from skimage.metrics import structural_similarity

from scenes.files.errors import InputError, ParameterError, require_instance
from scenes.files.plain_text import say
from simulate.dataset.dataset import Dataset
from simulate.spectra.angular_grid import COLUMNS, ROWS, AngularGrid
from simulate.spectra.array import LEAST_ELEMENTS, Array, PlanarArray, too_few_elements
from simulate.spectra.element_array import ElementArray
from simulate.spectra.spectrum import check_spectra


@dataclass(frozen=True)
class Scores:
    """Scores of K predicted spectra, one entry for each.

    Attributes:
        ssim: [K] structural similarity as ``bisplat.ssim`` computes it, at most 1.
        psnr: [K] peak signal-to-noise ratio for a peak of 1, dB; at most 100 dB.
        mae: [K] mean absolute error, 0…1.
        aoa_error: [K] error of the angle of arrival as ``bisplat.aoa_error`` computes it, degrees.

    Example:
        >>> ones = np.ones(3)
        >>> scores = Scores(ssim=ones, psnr=30 * ones, mae=0.02 * ones, aoa_error=np.array([1.0, 2.0, 40.0]))
        >>> scores.summary()["psnr_mean"], scores.summary()["aoa_error_median_deg"]
        (30.0, 2.0)
    """

    ssim: Float[np.ndarray, " K"]
    psnr: Float[np.ndarray, " K"]
    mae: Float[np.ndarray, " K"]
    aoa_error: Float[np.ndarray, " K"]

    def summary(self) -> dict[str, float]:
        """Summarise the scores of all K spectra in one row of a table.

        Returns:
            A dictionary with "ssim_median", "ssim_mean", "ssim_p05" (the 5th percentile), "psnr_mean" (dB), "mae_mean"
            and "aoa_error_median_deg" (degrees).
        """
        return {
            "ssim_median": float(np.median(self.ssim)),
            "ssim_mean": float(np.mean(self.ssim)),
            "ssim_p05": float(np.percentile(self.ssim, 5)),
            "psnr_mean": float(np.mean(self.psnr)),
            "mae_mean": float(np.mean(self.mae)),
            "aoa_error_median_deg": float(np.median(self.aoa_error)),
        }


def score(
    prediction: Float[np.ndarray, "*batch 90 360"],
    truth: Float[np.ndarray, "*batch 90 360"],
    grid: AngularGrid = AngularGrid(),
    array: Array = PlanarArray(),
) -> Scores:
    """Score predicted spectra as all tables of this project do.

    Args:
        prediction: a spectrum [90, 360] or a stack of spectra [..., 90, 360], 0…1.
        truth: true spectra of the same shape, 0…1: the grey levels of a dataset's pictures divided by 255.
        grid: the directions of rows and columns, ``dataset.grid``. The default is that of the NeRF² format.
        array: the array, ``dataset.array``, on which the angle depends that ``aoa_error`` compares.

    Returns:
        The scores of each spectrum, computed in double precision.

    Raises:
        ParameterError: the arrays have other shapes, or hold grey levels instead of numbers from 0 to 1.

    Example:
        >>> truth = np.zeros((2, 90, 360))
        >>> truth[:, 30, 100] = 1
        >>> prediction = truth.copy()
        >>> prediction[1] = np.roll(truth[1], 10, axis=0)  # 10 degrees of elevation too high
        >>> scores = score(prediction, truth, AngularGrid())
        >>> scores.ssim.round(3).tolist()[0], scores.psnr.tolist()[0], scores.aoa_error.round(3).tolist()
        (1.0, 100.0, [0.0, 10.0])
    """
    require_instance(AngularGrid, grid=grid)
    prediction, truth = (each.reshape(-1, ROWS, COLUMNS) for each in _pair(prediction, truth))
    squared_error, absolute_error = np.empty((2, len(truth)))
    for index, pair in enumerate(zip(prediction, truth, strict=True)):  # no copy of all of them in double precision
        difference = np.subtract(*pair, dtype=np.float64)
        absolute_error[index] = np.abs(difference).mean()
        squared_error[index] = np.square(difference, out=difference).mean()
    return Scores(
        ssim=ssim(prediction, truth),
        psnr=-10 * np.log10(np.maximum(squared_error, 1e-10)),
        mae=absolute_error,
        aoa_error=aoa_error(prediction, truth, grid, array),
    )


def ssim(
    prediction: Float[np.ndarray, "*batch 90 360"], truth: Float[np.ndarray, "*batch 90 360"]
) -> Float[np.ndarray, "*batch"]:
    """Structural similarity (SSIM) of predicted and true spectra [wang2004].

    All tables of this project report this value. It is
    ``skimage.metrics.structural_similarity(prediction, truth, data_range=1)`` of each 90 × 360 spectrum, with
    scikit-image's uniform window of 7 × 7 pixels and in double precision. It is 1 for equal spectra.

    Args:
        prediction: a spectrum [90, 360] or a stack of spectra [..., 90, 360], 0…1.
        truth: true spectra of the same shape, 0…1: the grey levels of a dataset's pictures divided by 255, as in
            ``dataset.spectra``.

    Returns:
        The SSIM of each pair [...]; a single number for a single pair.

    Raises:
        ParameterError: the arrays have other shapes, or hold grey levels instead of numbers from 0 to 1.

    Example:
        >>> import bisplat
        >>> evaluation = bisplat.evaluate("runs/lab")
        >>> each = bisplat.ssim(evaluation.prediction, evaluation.truth)
        >>> each.shape == evaluation.test.shape, float(np.median(each)) == evaluation.metrics()["ssim_median"]
        (True, True)
    """
    prediction, truth = _pair(prediction, truth)
    pairs = zip(*(spectra.reshape(-1, ROWS, COLUMNS) for spectra in (prediction, truth)), strict=True)

    def one(pair: tuple[np.ndarray, np.ndarray]) -> float:
        return structural_similarity(*(each.astype(np.float64, copy=False) for each in pair), data_range=1)

    with ThreadPoolExecutor(os.cpu_count()) as pool:  # its filters run beside each other
        each = list(pool.map(one, pairs))
    return np.array(each).reshape(truth.shape[:-2])[()]


def ssim_of_each(
    prediction: Float[np.ndarray, "K 90 360"], truth: Float[np.ndarray, "K 90 360"]
) -> Float[np.ndarray, " K"]:
    """SSIM of each pair, in the float type of its arrays: fits compare in single precision, which is faster."""
    return np.array([structural_similarity(p, t, data_range=1) for p, t in zip(prediction, truth, strict=True)])


def aoa_error(
    prediction: Float[np.ndarray, "*batch 90 360"],
    truth: Float[np.ndarray, "*batch 90 360"],
    grid: AngularGrid = AngularGrid(),
    array: Array = PlanarArray(),
) -> Float[np.ndarray, "*batch"]:
    """Error of the angle of arrival: the angle between the directions of the two maxima.

    It is the great-circle angle ``arccos(u·v)`` between the unit vectors u and v of the strongest directions of the
    predicted and the true spectrum. It is therefore also right across azimuth 0°, and near boresight, where directions
    of different azimuths are close to each other.

    A line of elements along an axis a tells only the angle to this axis: its spectrum is the same all along a cone. The
    error is then ``|arccos(a·u) − arccos(a·v)|``.

    Args:
        prediction: a spectrum [90, 360] or a stack of spectra [..., 90, 360], 0…1.
        truth: true spectra of the same shape, 0…1.
        grid: the directions of rows and columns, ``dataset.grid``. The default is that of the NeRF² format.
        array: the array, ``dataset.array``.

    Returns:
        The angle of each pair [...], 0…180 degrees; a single number for a single pair.

    Raises:
        ParameterError: the arrays have other shapes, or hold grey levels instead of numbers from 0 to 1.

    Example:
        >>> prediction, truth = np.zeros((2, 90, 360))
        >>> prediction[0, 359] = truth[0, 1] = 1  # at the horizon, azimuths 359 and 1 degree
        >>> float(aoa_error(prediction, truth).round(3))
        2.0
    """
    require_instance(AngularGrid, grid=grid)
    require_instance(PlanarArray, ElementArray, array=array)
    prediction, truth = _pair(prediction, truth)
    return array.angle_between(grid.dominant_direction(prediction), grid.dominant_direction(truth))


def _pair(prediction: np.ndarray, truth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Predicted and true spectra, checked."""
    prediction, truth = check_spectra("prediction", prediction), check_spectra("truth", truth)
    if prediction.shape != truth.shape:
        raise ParameterError("prediction", f"expected the shape of truth, {truth.shape}, found {prediction.shape}")
    return prediction, truth


def require_scorable(array: Array, place: str) -> None:
    """Refuse arrays of one or two elements, whose spectra every method predicts equally well."""
    why = too_few_elements(array)
    if why is not None:
        found = f"{array.rows} × {array.columns}" if isinstance(array, PlanarArray) else array.in_words
        raise InputError(
            f"{place}: expected an array of at least {LEAST_ELEMENTS} elements to score spectra, found {found}: {why}; "
            "train and predict work all the same, and compare --quantity response scores responses over a band"
        )


def varies(
    spectra: UInt8[np.ndarray, "K 90 360"] | Float[np.ndarray, "K 90 360"],
) -> Bool[np.ndarray, " K"]:
    """Which spectra are not constant. A constant one, such as a black picture, shows no direction."""
    return np.ptp(spectra, axis=(1, 2)) > 0


def scorable(dataset: Dataset, test: Int[np.ndarray, " n"]) -> Int[np.ndarray, " K"]:
    """The test spectra that can be scored. How many cannot is said on stderr."""
    require_scorable(dataset.array, str(dataset.folder))
    told = varies(dataset.pictures[test])
    require_some(told, str(dataset.folder))
    return test[told]


def require_some(told: Bool[np.ndarray, " K"], place: str) -> None:
    """Say how many spectra are constant and therefore not scored."""
    if not told.any():
        raise InputError(f"{place}: expected test spectra that show a direction, found {len(told)} constant ones")
    if not told.all():
        say(
            f"{place}: {int((~told).sum())} of {len(told)} test spectra are constant (black pictures, for example), "
            "show no direction, and are left out of every score"
        )
