"""The track of a dataset's antenna, and the responses of tags along it."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float
from scipy.spatial.transform import Rotation

from learn.localisation.locate_tags import LEAST_READS, MOST_ANTENNAS
from scenes.files.errors import InputError
from scenes.files.plain_text import say
from simulate.dataset.dataset import Dataset
from simulate.spectra.spectrum import evenly


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
        responses = dataset.retrieved if dataset.responses is None and recorded else dataset.responses
        if responses is None:
            raise InputError(f"{dataset.folder}: expected recorded responses, found pictures alone")
        low, high = dataset.positions.min(axis=0), dataset.positions.max(axis=0)
        margin = np.where(high > low, dataset.wavelength, 0)
        region = np.stack([low - margin, high + margin])
        antennas = dataset.gateway_position + elements
        return Track(dataset.names, *_thinned(dataset.folder, responses, antennas), region, dataset.positions)
    if dataset.moving == "both" or dataset.responses is None:
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
