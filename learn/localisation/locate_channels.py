"""Locate transmitters from their channels over subcarriers (CSI), by known rows with positions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Complex, Int

from learn.localisation.channel_regression import ChannelFingerprints, PositionRegression
from learn.localisation.located_places import Place
from learn.powers.fit_powers import checked_indices
from scenes.files.errors import InputError, ParameterError, check_array, require_seed
from scenes.files.plain_text import say
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import given_dataset

MOST_KNOWN = 2000  # Largest number of known rows; of more, so many are drawn

LEAST_KNOWN = 10  # Least number of known rows


def locate_channels(
    dataset: Dataset | Path | str,
    heard: Complex[np.ndarray, "K A S"],
    *,
    known: Int[np.ndarray, " n"] | None = None,
    seed: int = 0,
) -> list[list[Place]]:
    """Locate transmitters from the channels (CSI) of their uplink, by rows whose positions are known.

    A Gaussian process takes the position for a function of the channels [rasmussen2006]. Its covariance is high for
    rows that agree phase by phase over all antennas and subcarriers, and for rows whose powers of directions and delays
    agree in dB. Level, common phase and timing of a row do not count. Left-out known rows set the size of the stated
    covariances.

    Args:
        dataset: channels with positions, or their folder.
        heard: [K, A, S] channels of the uplink of K transmitters, as ``dataset.uplink``.
        known: indices of the rows to use. None: all of them.
        seed: draws 2000 known rows of more.

    Returns:
        The place of each transmitter, with probability 1. Its ``misfit`` is 1 − ``|ρ|²`` for the correlation ρ with the
        most similar known row. A transmitter whose channels are all zero has none.

    Raises:
        InputError: the folder cannot be read, has no positions, or has fewer than 10 known rows that are not zero, or
            all at one position.
        ParameterError: ``heard`` is not an array of channels of the dataset's antennas and subcarriers, or another
            argument is out of its range.

    Example:
        >>> import bisplat, numpy as np
        >>> places = np.random.default_rng(0).uniform((1, -1, 0), (3, 1, 0.1), (60, 3))
        >>> array = bisplat.PlanarArray(1, 8)
        >>> distance = np.linalg.norm(places[:, None] - 0.06 * np.arange(8)[:, None] * [0, 1, 0], axis=2)
        >>> delays = distance[..., None] * (8 + 0.067 * np.linspace(-1, 1, 52))
        >>> band = {"frequency": "2.4 GHz", "bandwidth": "20 MHz"}
        >>> wide = bisplat.write_dataset("data/hangar", places, np.exp(-2j * np.pi * delays), array, **band)
        >>> bisplat.export_csi(wide, "hangar")
        >>> csi = bisplat.read_dataset("hangar")
        >>> [found] = bisplat.locate_channels(csi, csi.uplink[:1], known=np.arange(1, 60))
        >>> bool(np.linalg.norm(found[0].position - places[0]) < 0.3)
        True
    """
    require_seed(seed=seed)
    dataset = given_dataset(dataset, "channel")
    antennas, subcarriers = dataset.uplink.shape[1:]
    what = f"channels [K, {antennas}, {subcarriers}]"
    channels = check_array("heard", heard, (None, antennas, subcarriers), what, "c")
    if not len(channels):
        raise ParameterError("heard", f"expected {what} of at least one transmitter, found none")
    regression, fingerprints = fit_regression(dataset, known, seed)
    found: list[list[Place]] = [[] for _ in channels]
    sent = np.flatnonzero(channels.any(axis=(1, 2)))
    if len(sent):
        for row, place in zip(sent, regression.places(fingerprints.of(channels[sent])), strict=True):
            found[row].append(place)
    return found


def fit_regression(
    dataset: Dataset, known: Int[np.ndarray, " n"] | None, seed: int
) -> tuple[PositionRegression, ChannelFingerprints]:
    """The regression of the known rows' positions, and the fingerprints that it takes."""
    indices = np.arange(len(dataset)) if known is None else checked_indices(known, len(dataset))
    indices = indices[dataset.uplink[indices].any(axis=(1, 2))]
    if len(indices) < LEAST_KNOWN:
        found = f"{len(indices)} whose uplink is not zero"
        raise InputError(f"{dataset.folder}: expected at least {LEAST_KNOWN} known rows, found {found}")
    if len(indices) > MOST_KNOWN:
        say(f"{dataset.folder}: used {MOST_KNOWN} of the {len(indices)} known rows")
        indices = np.sort(np.random.default_rng(seed).permutation(indices)[:MOST_KNOWN])
    positions = dataset.positions[indices]
    if not np.ptp(positions, axis=0).any():
        raise InputError(f"{dataset.folder}: expected at least two different positions of known rows, found one")
    if dataset.frequency.source == "assumed":
        say(f"{dataset.folder}: no frequency is stated, so {dataset.frequency.hertz / 1e6:g} MHz is assumed")
    uplink = dataset.uplink[indices].astype(complex)
    fingerprints = ChannelFingerprints(dataset.gateway_positions, dataset.wavelength, uplink)
    return PositionRegression(fingerprints.of(uplink), positions), fingerprints
