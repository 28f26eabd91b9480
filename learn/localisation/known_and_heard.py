"""What is known and what was heard, from datasets, folders and arrays, as questions that the search answers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Complex, Float, Int
from scipy.spatial.transform import Rotation

from learn.data.same_receiver import require_same_frequency
from learn.data.splits import SplitKind
from learn.data.splits import split as split_rows
from learn.fitted.fitted_method import fit_method
from learn.localisation.channel_evidence import ChannelEvidence
from learn.localisation.evidence import Evidence
from learn.localisation.located_places import NEW
from learn.localisation.place_search import Question
from learn.localisation.power_evidence import PowerEvidence
from learn.localisation.track_evidence import LEAST_READS, TrackEvidence
from scenes.files.errors import InputError, ParameterError, check_array, named, require_flag, require_within
from scenes.files.plain_text import say
from scenes.scene.description import SPEED_OF_LIGHT
from scenes.scene.frequency import read_frequency
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import read_dataset
from simulate.dataset.dataset_kinds import NOT_RECEIVED
from simulate.dataset.powers_files import fault_of_powers, read_power_table
from simulate.exchange.recorded_responses import one_way
from simulate.spectra.spectrum import evenly

SAME_STATED_PLACE = 0.1
"""Metres. Gateways and antennas whose stated positions differ by more are other ones."""

MOST_KNOWN, LEAST_KNOWN = 2000, 10  # Numbers of known rows of channels; of more, so many are drawn

LEVEL_MOST = 60.0  # Largest level that can be stated, dB

MOST_ANTENNAS = 1000  # Largest number of antenna positions of a track; the time grows with its square


def of_powers(survey: Dataset, heard: Any, *, split: SplitKind = "files", level: float | None = None) -> Question:
    """The question by a survey of received powers. Without ``heard``, its own test part, of the same level."""
    if level is not None:
        require_within(-LEVEL_MOST, LEVEL_MOST, "dB", level=level)
    known, asked = _parts(survey, split, heard)
    truth: Float[np.ndarray, "K 3"] | None = None
    if heard is None:
        powers, level = survey.powers[asked], level or 0.0
        truth = survey.positions[asked]
    elif isinstance(heard, str | Path):
        powers, truth = _read_powers(Path(heard), survey)
    else:
        powers = _checked_powers(heard, len(survey.gateway_names))
    predict = fit_method(survey, "power", known=known).predict
    there = survey.positions[known], survey.powers[known]
    evidence = PowerEvidence(predict, powers, *there, survey.floor_dbm, survey.wavelength)
    if level is None:
        evidence.estimate_level()
    else:
        evidence.level = level
    return _of_rows(evidence, asked, truth)


def of_channels(dataset: Dataset, heard: Any, *, split: SplitKind = "files") -> Question:
    """The question by channels with positions. Without ``heard``, their own test part."""
    known, asked = _parts(dataset, split, heard)
    truth: Float[np.ndarray, "K 3"] | None = None
    if heard is None:
        channels, truth = dataset.uplink[asked], dataset.positions[asked]
    elif isinstance(heard, str | Path):
        channels, truth = _read_channels(Path(heard), dataset)
    else:
        what = "channels [K, {}, {}] of at least one transmitter".format(*dataset.uplink.shape[1:])
        channels = check_array("heard", heard, (None, *dataset.uplink.shape[1:]), what, "c")
        if not len(channels):
            raise ParameterError("heard", f"expected {what}, found none")
    known = known[dataset.uplink[known].any(axis=(1, 2))]
    if len(known) < LEAST_KNOWN:
        found = f"{len(known)} whose uplink is not zero"
        raise InputError(f"{dataset.folder}: expected at least {LEAST_KNOWN} known rows, found {found}")
    if len(known) > MOST_KNOWN:
        say(f"{dataset.folder}: used {MOST_KNOWN} of the {len(known)} known rows")
        known = np.sort(np.random.default_rng(0).permutation(known)[:MOST_KNOWN])
    positions = dataset.positions[known]
    if not np.ptp(positions, axis=0).any():
        raise InputError(f"{dataset.folder}: expected at least two different positions of known rows, found one")
    if dataset.frequency.source == "assumed":
        say(f"{dataset.folder}: no frequency is stated, so {dataset.frequency.hertz / 1e6:g} MHz is assumed")
    uplink = dataset.uplink[known].astype(complex)
    evidence = ChannelEvidence(
        channels.astype(complex), positions, uplink, dataset.gateway_positions, dataset.wavelength
    )
    return _of_rows(evidence, asked, truth)


def _parts(dataset: Dataset, kind: SplitKind, heard: Any) -> tuple[Int[np.ndarray, " n"], Int[np.ndarray, " K"] | None]:
    """Known rows, and the rows of the test part; if something else was heard, all rows are known."""
    if heard is not None:
        return np.arange(len(dataset)), None
    parts = split_rows(dataset, kind, 0)
    return parts.known, parts.test


def _of_rows(evidence: Evidence, asked: Int[np.ndarray, " K"] | None, truth: np.ndarray | None) -> Question:
    numbers = np.arange(len(evidence.heard)) if asked is None else asked
    part = NEW if asked is None else "test"
    return Question(evidence, [str(each) for each in numbers], [part] * len(numbers), truth)


def _checked_powers(heard: Any, gateways: int) -> Float[np.ndarray, "K G"]:
    what = f"powers in dBm with a column for each of the {gateways} gateways"
    powers = check_array("heard", heard, (None, gateways), what, finite=False)
    if not len(powers) or np.isinf(powers).any():
        found = "an infinite one" if len(powers) else "no row"
        raise ParameterError("heard", f"expected {what}, NaN where nothing was received, found {found}")
    powers[powers == NOT_RECEIVED] = np.nan
    if fault := fault_of_powers(powers):
        raise ParameterError("heard", fault)
    return powers


def _read_powers(path: Path, survey: Dataset) -> tuple[Float[np.ndarray, "K G"], Float[np.ndarray, "K 3"] | None]:
    """Powers of transmitters at unknown places, with the survey's gateways in its order, and their true positions."""
    heard = read_dataset(path) if path.is_dir() else None
    if heard is not None:
        names, powers = heard.gateway_names, heard.powers
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
    if heard is None:
        return powers[:, order], None
    _require_same(path, "gateways", heard, survey, heard.gateway_positions[order])
    return powers[:, order], heard.positions


def _read_channels(path: Path, known: Dataset) -> tuple[Complex[np.ndarray, "K A S"], Float[np.ndarray, "K 3"] | None]:
    """Channels of the uplink of transmitters at unknown places, and their true positions."""
    heard = read_dataset(path)
    found, expected = heard.uplink.shape[1:], known.uplink.shape[1:]
    if found != expected:
        wanted, other = (f"{each[0]} antennas and {each[1]} subcarriers of the uplink" for each in (expected, found))
        raise InputError(f"{path}: expected {wanted} as in {known.folder}, found {other}")
    _require_same(path, "antennas", heard, known, heard.gateway_positions)
    return heard.uplink, heard.places


def _require_same(path: Path, what: str, heard: Dataset, known: Dataset, found: Float[np.ndarray, "n 3"]) -> None:
    """Refuse another frequency, if both are stated, and other places of gateways or antennas."""
    if "assumed" not in (heard.frequency.source, known.frequency.source):
        require_same_frequency(path, known.folder, known.wavelength, heard.wavelength)
    away = float(np.linalg.norm(found - known.gateway_positions, axis=1).max())
    if away > SAME_STATED_PLACE:
        raise InputError(f"{path}: expected the {what} where they are in {known.folder}, found one {away:.3g} m away")


def of_track(dataset: Dataset, heard: Any = None, *, region: Any = None, boresight: Any = None) -> Question:
    """The question of a dataset's tags, by their responses along the track of its antenna.

    If transmitters move, each is a tag, and the elements of the array are the places of the antenna. If the receiver
    moves, its elements at all its positions are these places, and the transmitter, whose position is not used, is the
    only tag.
    """
    if heard is not None:
        raise ParameterError("heard", f"expected none with {dataset.folder}, whose own tags are located")
    region = None if region is None else _box(region)
    elements = Rotation.from_quat(dataset.gateway_orientation).apply(dataset.wavelength * dataset.array.positions)
    names, truth, comparable = ["1"], None, "response" in dataset.values
    if dataset.moving == "transmitter":
        if not (comparable or dataset.phases_recorded_per_position):
            raise InputError(f"{dataset.folder}: expected recorded responses, found pictures alone")
        responses = dataset.responses if comparable else dataset.retrieved
        names, truth, antennas = dataset.names, dataset.positions, dataset.gateway_position + elements
        if region is None:
            low, high = truth.min(axis=0), truth.max(axis=0)
            margin = np.where(high > low, dataset.wavelength, 0)
            region = np.stack([low - margin, high + margin])
            corners = " to ".join(str(tuple(corner.round(2).tolist())) for corner in region)
            say(f"{dataset.folder}: tags are searched around its positions, in {corners} m (--region states another)")
    elif dataset.moving == "both" or not comparable:
        found = "two ends that move" if dataset.moving == "both" else "no phases that can be compared along it"
        raise InputError(f"{dataset.folder}: expected an antenna that moved along a track, found {found}")
    elif region is None:
        found = f"since the receiver of {dataset.folder} moved"
        raise ParameterError("region", f"expected the box in which the transmitter is, {found}")
    else:
        responses, antennas = dataset.responses.reshape(1, -1), (dataset.positions[:, None] + elements).reshape(-1, 3)
    if len(antennas) < LEAST_READS:
        raise InputError(f"{dataset.folder}: expected at least {LEAST_READS} antenna positions, found {len(antennas)}")
    some = evenly(np.arange(len(antennas)), MOST_ANTENNAS)
    if len(some) < len(antennas):
        say(f"{len(some)} of the {len(antennas)} antenna positions are used")
    pattern = "in all directions alike" if boresight is None else "ahead, with the cosine of the angle"
    say(f"{dataset.folder}: the antenna is taken to look {pattern}; each tag has an unknown phase and magnitude")
    evidence = TrackEvidence(responses[:, some], antennas[some], region, dataset.wavelength, _ahead(boresight))
    return Question(evidence, names, [NEW] * len(names), truth)


def of_positions(
    track: Float[np.ndarray, "N 3"],
    heard: Any,
    *,
    region: Any = None,
    boresight: Any = None,
    frequency: Any = None,
    round_trip: bool = False,
) -> Question:
    """The question by responses at the positions of a moving antenna."""
    require_flag(round_trip=round_trip)
    what = f"responses of tags at {len(track)} antenna positions"
    responses = check_array("heard", heard, (None, len(track)), what, "c", finite=False)
    if region is None or frequency is None:
        missing = "region" if region is None else "frequency"
        raise ParameterError(missing, "expected it with the positions of an antenna, found none")
    for row in responses if round_trip else ():
        read = np.isfinite(row) & (row != 0)
        row[read] = one_way(row[read][None], [])[0]
    wavelength = SPEED_OF_LIGHT / read_frequency(frequency)
    return _of_rows(TrackEvidence(responses, track, _box(region), wavelength, _ahead(boresight)), None, None)


def _box(region: Any) -> Float[np.ndarray, "2 3"]:
    box = check_array("region", region, (2, 3), "corners (min, max) of a box")
    if (box[0] > box[1]).any():
        raise ParameterError("region", f"expected corners (min, max), found {box.tolist()}")
    return box


def _ahead(boresight: Any) -> Float[np.ndarray, " 3"] | None:
    if boresight is None:
        return None
    ahead = check_array("boresight", boresight, (3,), "a direction x, y, z")
    if not ahead.any():
        raise ParameterError("boresight", "expected a direction, found a vector of length 0")
    return ahead / np.linalg.norm(ahead)
