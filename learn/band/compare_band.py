"""Comparison of methods that predict responses over a band, on one split and by the same code."""

from __future__ import annotations

import time
from collections.abc import Sequence
from os import PathLike
from pathlib import Path

from learn.band.band_comparison import BandComparison
from learn.band.band_methods import BAND_METHODS
from learn.band.band_scores import score_band
from learn.band.known_band import KnownBand, require_band
from learn.channels.channel_scores import snr_db
from learn.comparison.score_table import chosen_methods
from learn.data.split_distances import SplitDistances, say_distances
from learn.data.splits import SplitKind
from learn.data.splits import split as split_positions
from scenes.files.errors import require_instance
from simulate.dataset.dataset_folder import Dataset, read_dataset


def compare_band(
    dataset: Dataset | Path | str,
    methods: Sequence[str] | None = None,
    *,
    split: SplitKind = "files",
    train_size: int | None = None,
    seed: int = 0,
    guard: float = 0.0,
) -> BandComparison:
    """Fit and score methods that predict responses over a band at new positions.

    Every method learns from the responses of the same known positions, those of the training and the validation part,
    and is scored at the same test positions.

    Args:
        dataset: a dataset with responses over a band, or its folder.
        methods: some of "nearest" (known position), "inverse-distance" (mean of the four nearest). None: all of them.
        split: how the test part is chosen: "files" (the folder's index files), "random" (a random fifth), "blocked"
            (every fourth block of ten consecutive positions) or "area" (connected areas with a fifth).
        train_size: number of training positions to keep; the validation part shrinks in proportion. None: all.
        seed: seed of the split and of the methods.
        guard: known positions nearer than this to a test position are left out, wavelengths.

    Returns:
        The scores.

    Raises:
        InputError: the folder cannot be read; or it has no band, or too few positions or no index files for the split.
        ParameterError: a method or the split is unknown, or another argument is out of its range.
    """
    names = chosen_methods(methods, BAND_METHODS)
    require_instance(Dataset, str, PathLike, dataset=dataset)
    dataset = dataset if isinstance(dataset, Dataset) else read_dataset(dataset)
    require_band(dataset)
    assert dataset.band is not None and dataset.band_responses is not None
    parts = split_positions(dataset, split, seed, train_size, guard)
    known, places, truth = parts.known, dataset.positions[parts.test], dataset.band_responses[parts.test]
    distances = SplitDistances.between(dataset.positions[known], places, dataset.wavelength)
    say_distances(distances)
    task = KnownBand(dataset, known, seed)
    rows, ratios = [], {}
    for name in names:
        begun = time.perf_counter()
        method = BAND_METHODS[name]()
        method.fit(task)
        predicted = method.predict(places)
        seconds = time.perf_counter() - begun
        scores = score_band(predicted, truth, dataset.band.bandwidth)
        found = getattr(method, "found", None)
        rows.append({"label": name, **scores, "found": found, "seconds": round(seconds, 3)})
        ratios[name] = snr_db(predicted.responses, truth)
    return BandComparison(
        folder=dataset.folder,
        split=split,
        seed=seed,
        guard=guard,
        known_positions=len(known),
        test_positions=len(parts.test),
        rows=rows,
        snr_db=ratios,
        distances=distances,
    )
