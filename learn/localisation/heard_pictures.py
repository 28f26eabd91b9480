"""Pictures of transmitters, from arrays and folders that are checked against a run's gateway, as a question."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int, UInt8

from learn.data.same_receiver import (
    SAME_DIRECTION,
    SAME_PLACE,
    other_array,
    pose_difference,
    require_same_frequency,
)
from learn.localisation.located_places import NEW
from learn.localisation.picture_evidence import PictureEvidence
from learn.localisation.place_search import Question, grid_warning
from learn.training.run_folder import SpectrumRun
from scenes.files.errors import InputError, ParameterError, shown
from scenes.files.plain_text import say
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_frequency import frequency_of
from simulate.dataset.dataset_kinds import require_spectra
from simulate.dataset.metadata import read_metadata
from simulate.dataset.picture_files import read_all
from simulate.dataset.spectra_folder import read_gateway
from simulate.spectra.identification import EXPLAINED, can_fit, examined, stated_array, stated_grid
from simulate.spectra.lags import fit_lags
from simulate.spectra.spectrum import check_pictures, evenly

LOCATED = 200  # Largest number of test transmitters that an evaluation locates, evenly spread over the test part


def of_runs(runs: Sequence[SpectrumRun], heard: Any) -> Question:
    """The question by a run for each gateway: of pictures or folders of them, or of the test part of their datasets.

    The runs' own datasets stand for their test part, since known pictures are found at their own places.
    """
    if heard is None:
        return of_test_part(runs)
    heard = [heard] if isinstance(heard, str | Path) else heard
    if not isinstance(heard, list | tuple) or len(heard) != len(runs):
        found = f"{len(heard)} of them" if isinstance(heard, list | tuple | np.ndarray) else shown(heard)
        raise ParameterError("heard", f"expected pictures or a folder for each of the {len(runs)} runs, found {found}")
    if all(isinstance(each, str | Path) for each in heard):
        folders = [Path(each) for each in heard]
        own = [is_own(folder, run) for folder, run in zip(folders, runs, strict=True)]
        if all(own):
            return of_test_part(runs)
        if any(own):
            found = f"{folders[own.index(False)]} beside {folders[own.index(True)]}"
            raise ParameterError("heard", f"expected the datasets of all runs or of none, found {found}")
        seen = [observed_pictures(folder, run) for folder, run in zip(folders, runs, strict=True)]
        names, pictures = seen[0][0], [each for _, each in seen]
        for folder, (other, _) in zip(folders, seen, strict=True):
            if other != names:
                raise InputError(f"{folder}: expected pictures of the same names as in {folders[0]}, found other ones")
    else:
        pictures = [check_pictures("heard", each) for each in heard]
        if len({len(each) for each in pictures}) > 1:
            found = " and ".join(str(len(each)) for each in pictures)
            raise ParameterError("heard", f"expected pictures of the same transmitters, found {found}")
        names = [str(number) for number in range(len(pictures[0]))]
    data = runs[0].dataset()
    return Question(_evidence(runs, pictures, data.positions[runs[0].split(data).known]), names, [NEW] * len(names))


def of_test_part(runs: Sequence[SpectrumRun], most: int | None = None) -> Question:
    """The question by runs of the test part of their datasets, or of ``most`` of it, evenly spread."""
    datasets = [run.dataset() for run in runs]
    first, parts = datasets[0], runs[0].split(datasets[0])
    test, known = parts.test if most is None else evenly(parts.test, most), parts.known
    for run, dataset in zip(runs[1:], datasets[1:], strict=True):
        if first.names != dataset.names or not np.allclose(first.positions, dataset.positions, atol=1e-6):
            raise InputError(
                f"{dataset.folder}: expected spectra of the same transmitters as in {first.folder}, found other names "
                "or other positions"
            )
        learned = np.intersect1d(run.split(dataset).known, parts.test)
        if len(learned):
            raise InputError(
                f"{run.folder}: expected a run that was not trained on test spectra of {runs[0].folder}, found one "
                f"trained on {len(learned)}, such as {dataset.names[learned[0]]}; train both with the same split and "
                "seed"
            )
    positions = first.positions
    evidence = _evidence(
        runs, [each.pictures[test] for each in datasets], positions[known], [(each, known) for each in datasets]
    )
    if not evidence.told.any():
        raise InputError(f"{first.folder}: expected test spectra of several grey levels, found none in {len(test)}")
    return Question(evidence, [first.names[each] for each in test], ["test"] * len(test), positions[test])


def _evidence(
    runs: Sequence[SpectrumRun],
    pictures: list[UInt8[np.ndarray, "K 90 360"]],
    known: Float[np.ndarray, "n 3"],
    copies: list[tuple[Dataset, Int[np.ndarray, " n"]]] | None = None,
) -> PictureEvidence:
    boxes = np.stack([run.model.region.double().cpu().numpy() for run in runs])
    region = np.stack([boxes[:, 0].max(axis=0), boxes[:, 1].min(axis=0)])
    if (region[0] > region[1]).any():
        raise InputError(
            f"{runs[-1].folder}: expected runs that were trained in one region, found no place that the regions of all "
            "runs share"
        )
    again = None if copies is None else lambda: [dataset.pictures[rows] for dataset, rows in copies]
    evidence = PictureEvidence(runs, pictures, region, known, again)
    for run in runs:
        if (unseen_side := run.beamformer.array.cannot_tell) is not None:
            say(f"warning: {run.folder}: of the array, {unseen_side}; places on both sides may be given")
    if (warning := grid_warning(evidence)) is not None:
        say(f"warning: {warning}")
    return evidence


def observed_pictures(folder: Path, run: SpectrumRun) -> tuple[list[str], UInt8[np.ndarray, "K 90 360"]]:
    """Read pictures, and check that the gateway of a run can have recorded them.

    A warning is printed if the folder does not state its array, and the array of the run does not explain the pictures.
    """
    require_spectra(folder)
    names, pictures = read_all(folder / "spectrum" if (folder / "spectrum").is_dir() else folder)
    _check_metadata(folder, names, pictures, run)
    _check_gateway(folder, run)
    return names, pictures


def is_own(folder: Path, run: SpectrumRun) -> bool:
    """Whether the pictures of a folder are those of a run's dataset."""
    own = Path(run.config.dataset).resolve()
    return folder.resolve() in (own, own / "spectrum")


def _check_metadata(folder: Path, names: list[str], pictures: UInt8[np.ndarray, "K 90 360"], run: SpectrumRun) -> None:
    """Compare the stated frequency, array and grid with those of a run, or else the pictures with its array."""
    path, of_run = folder / "metadata.json", run.beamformer
    metadata = read_metadata(path)
    rows = np.array([int(name) for name in names]) - 1
    frequency, _ = frequency_of(folder, metadata, rows)
    if metadata.get("moving") == "both":
        raise InputError(f"{path}: expected pictures of a gateway that stands still, found some of an array that moved")
    array, grid = stated_array(metadata), stated_grid(metadata)
    if frequency.source != "assumed":
        require_same_frequency(folder, run.folder, float(run.model.wavelength), frequency.wavelength)
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


def _check_gateway(folder: Path, run: SpectrumRun) -> None:
    """Compare the gateway that a folder states with that of a run's dataset, if both are stated."""
    path, of_run = folder / "gateway_info.yml", Path(run.config.dataset) / "gateway_info.yml"
    if not (path.exists() and of_run.exists()):
        return
    found, expected = read_gateway(path), read_gateway(of_run)
    distance, angle = pose_difference(expected, found)
    if distance > SAME_PLACE * float(run.model.wavelength) or angle > SAME_DIRECTION:
        raise InputError(
            f"{path}: expected pictures of the gateway of {run.folder}, at {expected[0].round(3).tolist()}, found "
            f"those of a gateway {distance:.3g} m away and turned by {angle:.3g}°; if this file is wrong, give the "
            "folder of the pictures alone"
        )
