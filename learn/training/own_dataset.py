"""Whether a dataset is that of a run, and whether a model of it can start with the weights of another run."""

from __future__ import annotations

from pathlib import Path

from learn.data.same_receiver import in_megahertz, other_array, other_frequency
from scenes.files.errors import InputError
from simulate.dataset.dataset import Dataset
from simulate.spectra.beamformer import Beamformer


def require_same_spectra(dataset: Dataset, folder: Path, dataset_sha256: str | None) -> None:
    """Refuse a dataset that is not the one with which a run or an experiment was begun.

    Args:
        dataset: what is in the dataset's folder now.
        folder: folder of the run or the experiment, for the message.
        dataset_sha256: fingerprint that it recorded. None: it recorded none.

    Raises:
        InputError: the dataset has another fingerprint.
    """
    if dataset_sha256 not in (None, dataset.fingerprint):
        raise InputError(
            f"{dataset.folder}: expected the dataset that {folder} was trained on, found other spectra, as if they had "
            "been simulated or measured again; put the former dataset there, or train on this one into another folder"
        )


def require_same_receiver(dataset: Dataset, folder: Path, beamformer: Beamformer, wavelength: float) -> None:
    """Refuse a run with whose weights a model of a dataset cannot start.

    Args:
        dataset: the dataset to train on.
        folder: folder of the run, for the message.
        beamformer: the run's array and grid.
        wavelength: that of the run, metres.

    Raises:
        InputError: the run is of another frequency, array or grid than the dataset.
    """
    if other_frequency(dataset.wavelength, wavelength):
        expected, found = in_megahertz(dataset.wavelength), in_megahertz(wavelength)
        raise InputError(f"{folder}: expected a run at {expected}, found one at {found}")
    if other_array(dataset.array, beamformer.array) or dataset.grid != beamformer.grid:
        raise InputError(
            f"{folder}: expected a run of {dataset.array.in_words} on {dataset.grid}, found one of "
            f"{beamformer.array.in_words} on {beamformer.grid}"
        )
