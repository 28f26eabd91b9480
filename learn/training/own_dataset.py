"""Whether a dataset is that of a run, and whether a model of it can start with the weights of another run."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from learn.data.same_receiver import in_megahertz, other_array, other_frequency
from learn.data.splits import PARTS, Split, read_split
from learn.training.config import RunRecord
from scenes.files.errors import InputError
from scenes.scene.description import SPEED_OF_LIGHT
from simulate.dataset.dataset import Dataset
from simulate.spectra.beamformer import Beamformer


def require_same_spectra(dataset: Dataset, folder: Path, dataset_sha256: str | None) -> None:
    """Refuse a dataset that is not the one with which a run or an experiment was begun."""
    if dataset_sha256 not in (None, dataset.fingerprint):
        raise InputError(
            f"{dataset.folder}: expected the dataset that {folder} was trained on, found other spectra, as if they had "
            "been simulated or measured again; put the former dataset there, or train on this one into another folder"
        )


def require_same_data(dataset: Dataset, folder: Path, record: RunRecord, parts: Split) -> None:
    """Refuse to go on with a run whose dataset, or what it states, has changed since the run was begun."""
    require_same_spectra(dataset, folder, record.dataset_sha256)
    again = "train on it into another folder"
    wavelength = None if record.frequency is None else SPEED_OF_LIGHT / record.frequency
    if wavelength is not None and other_frequency(wavelength, dataset.wavelength):
        expected, found = in_megahertz(wavelength), in_megahertz(dataset.wavelength)
        raise InputError(f"{dataset.folder}: expected {expected} as {folder} was begun with, found {found}; {again}")
    before, now = record.beamformer, dataset.beamformer
    if other_array(before.array, now.array) or before.grid != now.grid:
        raise InputError(
            f"{dataset.folder}: expected {before.array.in_words} on {before.grid} as {folder} was begun with, found "
            f"{now.array.in_words} on {now.grid}; {again}"
        )
    path, from_files = folder / "split.json", record.config.split == "files"
    finished = (folder / "weights.safetensors").exists()
    # A kill may come before the split is written. A finished run needs its split no more, unless the user states it.
    if not path.exists() or (finished and not from_files):
        return
    begun = read_split(path, dataset.names, dataset.folder)
    if any(set(getattr(begun, part)) != set(getattr(parts, part)) for part in PARTS):
        why = ", as if the index files had been changed" if from_files else ""
        raise InputError(
            f"{dataset.folder}: expected the split that {folder} was begun with, found another one{why}; {again}"
        )


def require_untested(before_known: np.ndarray, before: Path, dataset: Dataset, parts: Split) -> None:
    """Refuse to start with the weights of a run that has learned test spectra of this training."""
    both = np.intersect1d(before_known, parts.test)
    if len(both):
        raise InputError(
            f"{before}: expected a run that has not learned the test spectra, found one that learned {len(both)} of "
            f"{len(parts.test)}, such as {dataset.names[both[0]]}; start from one with the same test part"
        )


def require_same_receiver(dataset: Dataset, folder: Path, beamformer: Beamformer, wavelength: float) -> None:
    """Refuse a run with whose weights a model of a dataset cannot start."""
    if other_frequency(dataset.wavelength, wavelength):
        expected, found = in_megahertz(dataset.wavelength), in_megahertz(wavelength)
        raise InputError(f"{folder}: expected a run at {expected}, found one at {found}")
    if other_array(dataset.array, beamformer.array) or dataset.grid != beamformer.grid:
        raise InputError(
            f"{folder}: expected a run of {dataset.array.in_words} on {dataset.grid}, found one of "
            f"{beamformer.array.in_words} on {beamformer.grid}"
        )
