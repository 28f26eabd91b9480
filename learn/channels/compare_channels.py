"""Comparison of methods that predict the downlink's channels from the uplink's, on one split and by the same code."""

from __future__ import annotations

import time
from collections.abc import Sequence
from os import PathLike
from pathlib import Path

import numpy as np
from jaxtyping import Complex

from learn.channels.channel_comparison import ChannelComparison
from learn.channels.channel_methods import CHANNEL_METHODS
from learn.channels.channel_scores import score_channels, snr_db
from learn.channels.known_channels import USUAL_WAVELENGTH, KnownChannels
from learn.comparison.score_table import chosen_methods, label_of
from learn.data.splits import SplitKind
from learn.data.splits import split as split_rows
from scenes.files.errors import require_instance
from scenes.files.plain_text import say
from scenes.scene.description import SPEED_OF_LIGHT
from simulate.csi.csi_dataset import CsiDataset, read_csi

MOST_KNOWN = 5000
"""With more known rows, so many of them are drawn, and the methods learn from these alone."""

BLOCK = 1000
"""Rows that are predicted at once."""

SMALLEST = 1e-290
"""Smallest number that channels are divided by: complex division by smaller ones overflows."""


def compare_channels(
    dataset: CsiDataset | Path | str,
    methods: Sequence[str] | None = None,
    *,
    split: SplitKind = "files",
    train_size: int | None = None,
    seed: int = 0,
) -> ChannelComparison:
    """Fit and score methods that predict the downlink of rows of channels (CSI) from their uplink.

    Every method learns from both links of the same known rows, those of the training and the validation part. It is
    then given the uplink of the same test rows, and their positions if the folder has them. The downlink's subcarriers
    are taken to follow the uplink's at the same distance, as in the data of NeRF² and of ``export_csi``.

    Args:
        dataset: channels, or their folder.
        methods: some of "copy" (the uplink as it is), "ramp" (each antenna's uplink as one path), "nearest" (the
            downlink of the known row whose uplink correlates most, with the factor that fits the uplinks), "delays"
            (Gaussian-process regression over frequency, with a power of each delay that is fitted to the known rows)
            and "helmholtz" (the linear minimum-mean-square-error estimate over all antennas and subcarriers). None:
            all of these. Besides them there is "nerf2", which is trained for minutes.
        split: how the test part is chosen: "files" (the folder's index files), "random" (a random fifth), "blocked"
            (every fourth block of ten consecutive rows) or "area" (connected areas with a fifth, of known positions).
        train_size: number of training rows to keep; the validation part shrinks in proportion. None: all.
        seed: seed of the split.

    Returns:
        The scores.

    Raises:
        InputError: the folder cannot be read; or it has too few rows, no index files or no positions for the split.
        ParameterError: a method or the split is unknown, or another argument is out of its range.

    Example:
        >>> import bisplat, numpy as np
        >>> array = bisplat.PlanarArray(1, 8)
        >>> ramps = np.exp(-1j * np.linspace(0.1, 0.3, 20)[:, None, None] * np.arange(52)) * np.ones((8, 1))
        >>> wide = bisplat.write_dataset("data/paths", np.eye(20, 3), ramps, array, "2.4 GHz", bandwidth="20 MHz")
        >>> bisplat.export_csi(wide, "paths")
        >>> best = bisplat.compare_channels("paths", ["copy", "ramp"], split="random").table()[0]
        >>> best["label"], best["snr_median_db"] > 100
        ('ramp', True)
    """
    names = chosen_methods(methods, CHANNEL_METHODS)
    require_instance(CsiDataset, str, PathLike, dataset=dataset)
    dataset = dataset if isinstance(dataset, CsiDataset) else read_csi(dataset)
    parts = split_rows(dataset, split, seed, train_size)
    if dataset.frequencies is None:
        say(f"{dataset.folder}: assumed that the downlink's subcarriers follow the uplink's at the same distance")
    taught = parts.known
    if len(taught) > MOST_KNOWN:
        say(f"the methods learn from {MOST_KNOWN} of the {len(taught)} known rows")
        taught = np.sort(np.random.default_rng(seed).permutation(taught)[:MOST_KNOWN])
    level = _largest(dataset.uplink, dataset.downlink)  # so that no square of a channel is out of a float's range
    places = dataset.positions
    known = KnownChannels(
        dataset.uplink[taught] / level,
        dataset.downlink[taught] / level,
        None if places is None else places[taught],
        seed,
        antennas=dataset.antenna_positions,
        wavelength=USUAL_WAVELENGTH if dataset.frequency is None else SPEED_OF_LIGHT / dataset.frequency.hertz,
    )
    heard = None if places is None else places[parts.test]
    uplink, truth = dataset.uplink[parts.test] / level, dataset.downlink[parts.test] / level
    rows, ratios = [], {}
    for name in names:
        begun = time.perf_counter()
        method = CHANNEL_METHODS[name]()
        method.fit(known)
        blocks = [slice(at, at + BLOCK) for at in range(0, len(uplink), BLOCK)]
        predicted = np.concatenate(
            [method.predict(uplink[block], None if heard is None else heard[block]) for block in blocks]
        )
        seconds = time.perf_counter() - begun
        label = label_of(name, method)
        rows.append({"label": label, **score_channels(predicted, truth), "seconds": round(seconds, 3)})
        ratios[label] = snr_db(predicted, truth)
    return ChannelComparison(dataset.folder, split, seed, len(parts.known), len(parts.test), rows, ratios)


def _largest(*links: Complex[np.ndarray, "K A S"]) -> float:
    """The largest absolute real or imaginary part, or ``SMALLEST``."""
    largest = max(float(np.abs(part).max()) for link in links for part in (link.real, link.imag))
    return max(largest, SMALLEST)
