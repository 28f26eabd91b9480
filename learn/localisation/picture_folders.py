"""Pictures of transmitters at unknown places, read from folders and checked against the gateway of a run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import UInt8

from learn.data.same_receiver import (
    SAME_DIRECTION,
    SAME_PLACE,
    in_megahertz,
    other_array,
    other_frequency,
    pose_difference,
)
from learn.training.run_folder import Run
from scenes.files.errors import InputError
from scenes.files.plain_text import say
from simulate.dataset.dataset_frequency import frequency_of
from simulate.dataset.dataset_kinds import not_spectra
from simulate.dataset.dataset_reader import read_gateway, read_metadata
from simulate.dataset.picture_files import read_all
from simulate.spectra.identification import EXPLAINED, can_fit, examined, stated_array, stated_grid
from simulate.spectra.lags import fit_lags


def observed_pictures(folder: Path, run: Run) -> tuple[list[str], UInt8[np.ndarray, "K 90 360"]]:
    """Read pictures, and check that the gateway of a run can have recorded them.

    A warning is printed if the folder does not state its array, and the array of the run does not explain the pictures.
    """
    if other := not_spectra(folder):
        raise InputError(other)
    names, pictures = read_all(folder / "spectrum" if (folder / "spectrum").is_dir() else folder)
    _check_metadata(folder, names, pictures, run)
    _check_gateway(folder, run)
    return names, pictures


def is_own(folder: Path, run: Run) -> bool:
    """Whether the pictures of a folder are those of a run's dataset."""
    own = Path(run.config.dataset).resolve()
    return folder.resolve() in (own, own / "spectrum")


def _check_metadata(folder: Path, names: list[str], pictures: UInt8[np.ndarray, "K 90 360"], run: Run) -> None:
    """Compare the stated frequency, array and grid with those of a run, or else the pictures with its array."""
    problems: list[str] = []
    path, of_run = folder / "metadata.json", run.beamformer
    metadata = read_metadata(path, problems)
    rows = np.array([int(name) for name in names]) - 1
    frequency = frequency_of(folder, metadata, rows, problems).frequency
    if problems:
        raise InputError(problems[0])
    if metadata.get("moving") == "both":
        raise InputError(f"{path}: expected pictures of a gateway that stands still, found some of an array that moved")
    array, grid = stated_array(metadata), stated_grid(metadata)
    wavelength = float(run.model.wavelength)
    if frequency.source != "assumed" and other_frequency(wavelength, frequency.wavelength):
        raise InputError(
            f"{folder}: expected pictures at the frequency of {run.folder}, {in_megahertz(wavelength)}, found "
            f"{in_megahertz(frequency.wavelength)}"
        )
    array = None if array is None else array.at(frequency.hertz)
    if array is not None and other_array(of_run.array, array):
        raise InputError(
            f"{path}: expected pictures of the array of {run.folder}, {of_run.array.in_words}, found those of "
            f"{array.in_words}"
        )
    if grid is not None and grid != of_run.grid:
        raise InputError(f"{path}: expected pictures on the grid of {run.folder}, {of_run.grid}, found {grid}")
    telling = examined(pictures)
    if array is None and len(telling) and can_fit(of_run.array):
        left = fit_lags(telling, of_run).median_residual
        if left > EXPLAINED:
            say(
                f"warning: {folder}: the array of {run.folder}, {of_run.array.in_words}, leaves {left:.2g} grey "
                "levels of these pictures unexplained, where rounding leaves 0.3; were they recorded by another array?"
            )


def _check_gateway(folder: Path, run: Run) -> None:
    """Compare the gateway that a folder states with that of a run's dataset, if both are stated."""
    path, of_run = folder / "gateway_info.yml", Path(run.config.dataset) / "gateway_info.yml"
    if not (path.exists() and of_run.exists()):
        return
    problems: list[str] = []
    found, expected = read_gateway(path, problems), read_gateway(of_run, problems)
    if problems:
        raise InputError(problems[0])
    distance, angle = pose_difference(expected, found)
    if distance > SAME_PLACE * float(run.model.wavelength) or angle > SAME_DIRECTION:
        raise InputError(
            f"{path}: expected pictures of the gateway of {run.folder}, at {expected[0].round(3).tolist()}, found "
            f"those of a gateway {distance:.3g} m away and turned by {angle:.3g}°; if this file is wrong, give the "
            "folder of the pictures alone"
        )
