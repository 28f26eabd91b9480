"""Locate transmitters and tags from what was heard of them: spectra, received powers, channels, or a moving antenna."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from inspect import signature
from os import PathLike
from pathlib import Path
from typing import Any

from jaxtyping import Float
from numpy.typing import ArrayLike

from learn.data.splits import SplitKind
from learn.localisation.heard_pictures import of_runs
from learn.localisation.known_and_heard import MOST_ANTENNAS, of_channels, of_positions, of_powers, of_track
from learn.localisation.located_places import Located
from learn.localisation.place_search import Question
from learn.models.base import Report
from learn.training.run_folder import Run, SpectrumRun, load_spectra
from scenes.files.errors import ParameterError
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import read_dataset
from simulate.dataset.dataset_kinds import quantity_of
from simulate.positions.positions import check_points


def locate(
    model_or_dataset: Any,
    heard: Any = None,
    *,
    split: SplitKind | None = None,
    level: float | None = None,
    region: Float[ArrayLike, "2 3"] | None = None,
    boresight: Float[ArrayLike, " 3"] | None = None,
    frequency: float | str | None = None,
    round_trip: bool = False,
    report: Report = lambda phase, done, total: None,
) -> Located:
    """Locate transmitters or tags from what was heard of them, by what is known.

    - *Spectra*, by a trained run for each gateway: places where the runs predict the most similar spectra, up to scale
      and offset, weighted with the density of training positions.
    - *Received powers* (RSSI), by a survey: ``helmholtz`` predicts the powers everywhere, with intervals. A power that
      was not received is one below the survey's floor.
    - *Channels* (CSI), by channels with positions: a Gaussian process from channels to positions [rasmussen2006], which
      ignores level, common phase and timing.
    - *Responses along the track of an antenna* (synthetic aperture), without anything else that is known: the direct
      path, a gain that changes smoothly, multipath and noise. Each tag has an unknown phase and magnitude. A straight
      track tells neither side nor height, so that ``region`` must leave one side of a plane.

    Each gives a likelihood over places. It is computed on a grid in the region of the known positions. A place is the
    mean of an area or, where the likelihood is narrower than the grid, its maximum.

    Args:
        model_or_dataset: a run, or a list with a run for each gateway, all in one world frame; received powers or
            channels with positions; a dataset whose antenna moved, or whose elements are the stops of one; or the
            positions [N, 3] of a moving antenna, metres, world frame. Folders of these may be given, too.
        heard: of K transmitters: for each run an array of pictures [K, 90, 360] (grey levels 0…255, or spectra 0…1), or
            their folder; powers [K, G] in dBm in the order of the gateways, NaN or −100 where nothing was received, or
            their CSV or folder; channels [K, A, S] of the uplink, or their folder; responses [K, N] at the antenna
            positions in any unit, NaN where a tag was not read, whose phase falls with the distance. None: the test
            part of the run's dataset or of the known rows, or the dataset's own tags.
        split: choice of the test part of powers or channels, as for ``compare``. None: "files".
        level: how much stronger the heard device is than that of the survey, dB. None: it is estimated, for all powers
            are taken for those of one device, and printed.
        region: corners (min, max) of the box in which tags are, metres, world frame; it may be flat. None: around the
            dataset's positions.
        boresight: direction in which a moving antenna looks, world frame, if it has a broad main lobe, as a reader's
            patch has: its pattern is then the cosine of the angle. None: it looks in all directions alike.
        frequency: of positions of a moving antenna: hertz, or a text with a unit such as "915 MHz".
        round_trip: of positions of a moving antenna: the responses are those of the way to the tag and back, as of an
            RFID reader. Their roots are taken; the phase must change by less than half a turn from stop to stop.
        report: called with the phase, the number of transmitters or positions done, and the number of all.

    Returns:
        For each transmitter a list of its places, the most probable one first, and the errors where true positions are
        known. A transmitter of which nothing was heard has none: its picture has a single grey level, no gateway
        received it, its channels are zero, or it was read at fewer than 4 antenna positions.

    Raises:
        InputError: a folder cannot be read or is of another receiver, or too little is known.
        ParameterError: an argument has another shape or is out of its range, or does nothing here.

    Example:
        >>> import numpy as np
        >>> track = np.stack([np.linspace(0, 1, 50), np.zeros(50), np.zeros(50)], axis=1)
        >>> distance = np.linalg.norm(track - [0.3, 0.7, 0], axis=1)
        >>> read = np.exp(-4j * np.pi * distance / 0.325) / distance**2  # the way to the tag and back
        >>> box = [[0, 0.2, 0], [1, 1.2, 0]]
        >>> found = locate(track, [read], region=box, frequency="922.438 MHz", round_trip=True)
        >>> found[0][0].position.round(2).tolist()
        [0.3, 0.7, 0.0]
    """
    kind = _kind(model_or_dataset)
    read, ask = KINDS[kind]
    given = {"split": split, "level": level, "region": region, "boresight": boresight, "frequency": frequency}
    told = {name: each for name, each in (given | {"round_trip": round_trip or None}).items() if each is not None}
    for name in told:
        if name not in signature(ask).parameters:
            raise ParameterError(name, f"expected none, since it does nothing with {kind}")
        if (name == "split" and heard is not None) or (name == "level" and heard is None):
            where = "without anything heard" if heard is None else "beside what was heard"
            raise ParameterError(name, f"expected none, since it does nothing {where}")
    folder = isinstance(model_or_dataset, str | PathLike)
    known = read(model_or_dataset) if folder or kind in (RUN, POSITIONS) else model_or_dataset
    return ask(known, heard, **told).answered(report)


def _kind(given: Any) -> str:
    """What is known, as a key of ``KINDS``; nothing is read yet."""
    if isinstance(given, str | PathLike):
        folder = Path(given)
        quantity = quantity_of(folder)
        if quantity in ("power", "channel"):
            return POWERS if quantity == "power" else CHANNELS
        return TRACK if (folder / "spectrum").is_dir() and not (folder / "config.json").exists() else RUN
    if isinstance(given, list | tuple) and given and all(isinstance(each, Run | str | PathLike) for each in given):
        return RUN
    if isinstance(given, Dataset):
        return {"power": POWERS, "channel": CHANNELS}.get(given.quantities[0], TRACK)
    return RUN if isinstance(given, Run) else POSITIONS


def _runs(given: Any) -> list[SpectrumRun]:
    each = given if isinstance(given, list | tuple) else [given]
    runs = [load_spectra(run) for run in each]
    folder, times = Counter(run.folder.resolve() for run in runs).most_common(1)[0]
    if times > 1:
        raise ParameterError("model_or_dataset", f"expected a run for each gateway, found {folder} twice")
    return runs


def _positions(given: Any) -> Float[ArrayLike, "N 3"]:
    positions = check_points(given, "model_or_dataset")
    if len(positions) > MOST_ANTENNAS:
        raise ParameterError("model_or_dataset", f"expected at most {MOST_ANTENNAS} positions, found {len(positions)}")
    return positions


RUN, POWERS, CHANNELS, TRACK = "a run", "received powers", "channels", "a dataset whose antenna moved"
POSITIONS = "positions of an antenna"

KINDS: dict[str, tuple[Callable[[Any], Any], Callable[..., Question]]] = {
    RUN: (_runs, of_runs),
    POWERS: (read_dataset, of_powers),
    CHANNELS: (read_dataset, of_channels),
    TRACK: (read_dataset, of_track),
    POSITIONS: (_positions, of_positions),
}
"""What is known: how it is read, and the question that it is for; the options that do something are its parameters."""
