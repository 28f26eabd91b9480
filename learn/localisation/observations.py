"""What was observed of transmitters to be located: pictures, powers, channels, or responses along a track.

The gateways, antennas and frequencies must be those of the run or of the known rows.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Shaped, UInt8
from scipy.spatial.transform import Rotation

from learn.data.same_receiver import (
    SAME_DIRECTION,
    SAME_PLACE,
    in_megahertz,
    other_array,
    other_frequency,
    pose_difference,
)
from learn.localisation.locate_tags import LEAST_READS, MOST_ANTENNAS
from learn.localisation.located_places import NEW
from learn.training.run_folder import Run
from scenes.files.errors import InputError, named
from scenes.files.plain_text import say
from scenes.scene.description import SPEED_OF_LIGHT
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import read_dataset
from simulate.dataset.dataset_frequency import frequency_of
from simulate.dataset.dataset_kinds import NOT_RECEIVED, require_spectra
from simulate.dataset.metadata import read_metadata
from simulate.dataset.picture_files import read_all
from simulate.dataset.powers_files import fault_of_powers, read_power_table
from simulate.dataset.spectra_folder import read_gateway
from simulate.spectra.identification import EXPLAINED, can_fit, examined, stated_array, stated_grid
from simulate.spectra.lags import fit_lags
from simulate.spectra.spectrum import evenly

SAME_STATED_PLACE = 0.1
"""Metres. Gateways and antennas whose stated positions differ by more are other ones."""


class ObservedRows(NamedTuple):
    """What was heard of K transmitters."""

    rows: Shaped[np.ndarray, "K *each"]  # powers [K, G], in dBm, or channels of the uplink [K, A, S]
    truth: Float[np.ndarray, "K 3"] | None  # the positions of the transmitters, where they are known, metres


def observed_powers(path: Path, survey: Dataset) -> ObservedRows:
    """Read powers of transmitters at unknown places, with the survey's gateways in its order."""
    truth, places = None, None
    if path.is_dir():
        heard = read_dataset(path)
        names, powers, truth, places = heard.gateway_names, heard.powers, heard.positions, heard.gateway_positions
        _require_same_frequency(path, heard, survey)
    else:
        names, powers = read_power_table(path)
        powers = np.where(powers == NOT_RECEIVED, np.nan, powers)
        if fault := fault_of_powers(powers):
            raise InputError(f"{path}: {fault}")
    for have, want, other in (
        (names, survey.gateway_names, str(survey.folder)),
        (survey.gateway_names, names, str(path)),
    ):
        missing = next((name for name in want if name not in have), None)
        if missing is not None:
            raise InputError(
                f"{path}: expected the gateways of {survey.folder}, found {named(missing)} in {other} alone"
            )
    order = [names.index(name) for name in survey.gateway_names]
    if places is not None:
        _require_same(path, "gateways", survey.folder, places[order], survey.gateway_positions)
    return ObservedRows(powers[:, order], truth)


def observed_channels(path: Path, known: Dataset) -> ObservedRows:
    """Read channels of the uplink of transmitters at unknown places."""
    heard = read_dataset(path)
    found, expected = heard.uplink.shape[1:], known.uplink.shape[1:]
    if found != expected:
        each = " antennas and {} subcarriers of the uplink"
        wanted, other = (f"{shape[0]}{each.format(shape[1])}" for shape in (expected, found))
        raise InputError(f"{path}: expected {wanted} as in {known.folder}, found {other}")
    _require_same_frequency(path, heard, known)
    _require_same(path, "antennas", known.folder, heard.gateway_positions, known.gateway_positions)
    return ObservedRows(heard.uplink, heard.places)


def _require_same_frequency(path: Path, heard: Dataset, known: Dataset) -> None:
    """Refuse another frequency, if both are stated."""
    found, expected = heard.frequency, known.frequency
    if "assumed" in (found.source, expected.source):
        return
    if other_frequency(SPEED_OF_LIGHT / expected.hertz, SPEED_OF_LIGHT / found.hertz):
        raise InputError(f"{path}: expected {expected} as in {known.folder}, found {found}")


def _require_same(
    path: Path, what: str, folder: Path, found: Float[np.ndarray, "n 3"], expected: Float[np.ndarray, "n 3"]
) -> None:
    away = float(np.linalg.norm(found - expected, axis=1).max())
    if away > SAME_STATED_PLACE:
        raise InputError(f"{path}: expected the {what} where they are in {folder}, found one {away:.3g} m away")


def observed_pictures(folder: Path, run: Run) -> tuple[list[str], UInt8[np.ndarray, "K 90 360"]]:
    """Read pictures, and check that the gateway of a run can have recorded them.

    A warning is printed if the folder does not state its array, and the array of the run does not explain the pictures.
    """
    require_spectra(folder)
    names, pictures = read_all(folder / "spectrum" if (folder / "spectrum").is_dir() else folder)
    _check_metadata(folder, names, pictures, run)
    _check_gateway(folder, run)
    return names, pictures


def parts_of(names: list[str], folder: Path, run: Run) -> list[str]:
    """Tell which part of a run's split each picture is of."""
    own = Path(run.config.dataset).resolve()
    if folder.resolve() not in (own, own / "spectrum"):
        return [NEW] * len(names)
    dataset = run.dataset()
    split = run.split(dataset)
    part: dict[str, str] = {}
    for kind in ("train", "validation", "test"):
        part |= {dataset.names[index]: kind for index in getattr(split, kind)}
    return [part.get(name, NEW) for name in names]


def require_unseen(run: Run, first: Run, learned: list[str]) -> None:
    """Refuse a run that was trained on test spectra of the first run."""
    if learned:
        raise InputError(
            f"{run.folder}: expected a run that was not trained on test spectra of {first.folder}, found one "
            f"trained on {len(learned)}, such as {learned[0]}; train both with the same split and seed"
        )


def _check_metadata(folder: Path, names: list[str], pictures: UInt8[np.ndarray, "K 90 360"], run: Run) -> None:
    """Compare the stated frequency, array and grid with those of a run, or else the pictures with its array."""
    problems: list[str] = []
    path, of_run = folder / "metadata.json", run.beamformer
    metadata = read_metadata(path)
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
    found, expected = read_gateway(path), read_gateway(of_run)
    distance, angle = pose_difference(expected, found)
    if distance > SAME_PLACE * float(run.model.wavelength) or angle > SAME_DIRECTION:
        raise InputError(
            f"{path}: expected pictures of the gateway of {run.folder}, at {expected[0].round(3).tolist()}, found "
            f"those of a gateway {distance:.3g} m away and turned by {angle:.3g}°; if this file is wrong, give the "
            "folder of the pictures alone"
        )


class Track(NamedTuple):
    """Responses of K tags at N places of an antenna."""

    names: list[str]  # a name for each tag
    responses: Complex[np.ndarray, "K N"]  # one-way responses
    antennas: Float[np.ndarray, "N 3"]  # places of the antenna, metres, world frame
    # a box around the positions of the tags, metres. None: they are not stated.
    region: Float[np.ndarray, "2 3"] | None
    # positions of the tags as the dataset states them, metres. None: it states none.
    stated: Float[np.ndarray, "K 3"] | None


def track_of(dataset: Dataset) -> Track:
    """The track of a dataset.

    If transmitters move, each is a tag, and the elements of the array are the places of the antenna. If the receiver
    moves, its elements at all its positions are these places, and the transmitter, whose position is not used, is the
    only tag.
    """
    elements = Rotation.from_quat(dataset.gateway_orientation).apply(dataset.wavelength * dataset.array.positions)
    if dataset.moving == "transmitter":
        recorded = dataset.phases_recorded_per_position
        if "response" not in dataset.values and not recorded:
            raise InputError(f"{dataset.folder}: expected recorded responses, found pictures alone")
        responses = dataset.responses if "response" in dataset.values else dataset.retrieved
        low, high = dataset.positions.min(axis=0), dataset.positions.max(axis=0)
        margin = np.where(high > low, dataset.wavelength, 0)
        region = np.stack([low - margin, high + margin])
        antennas = dataset.gateway_position + elements
        return Track(dataset.names, *_thinned(dataset.folder, responses, antennas), region, dataset.positions)
    if dataset.moving == "both" or "response" not in dataset.values:
        found = "two ends that move" if dataset.moving == "both" else "no phases that can be compared along it"
        raise InputError(f"{dataset.folder}: expected an antenna that moved along a track, found {found}")
    antennas = (dataset.positions[:, None] + elements).reshape(-1, 3)
    return Track(["1"], *_thinned(dataset.folder, dataset.responses.reshape(1, -1), antennas), None, None)


def _thinned(
    folder: Path, responses: Complex[np.ndarray, "K n"], antennas: Float[np.ndarray, "n 3"]
) -> tuple[Complex[np.ndarray, "K N"], Float[np.ndarray, "N 3"]]:
    if len(antennas) < LEAST_READS:
        raise InputError(f"{folder}: expected at least {LEAST_READS} antenna positions, found {len(antennas)}")
    some = evenly(np.arange(len(antennas)), MOST_ANTENNAS)
    if len(some) < len(antennas):
        say(f"{len(some)} of the {len(antennas)} antenna positions are used")
    return responses[:, some], antennas[some]
