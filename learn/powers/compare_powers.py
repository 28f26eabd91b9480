"""Comparison of methods that predict received powers on one split, scored by the same code."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

from learn.comparison.score_table import chosen_methods, label_of
from learn.data.split_distances import SplitDistances, say_distances
from learn.data.splits import SplitKind
from learn.data.splits import split as split_positions
from learn.powers.known_powers import KnownPowers
from learn.powers.power_comparison import PowerComparison
from learn.powers.power_methods import POWER_METHODS
from learn.powers.power_scores import absolute_errors, of_gateway, score_powers
from scenes.files.plain_text import say
from simulate.rssi.rssi_dataset import USUAL_FREQUENCY, RssiDataset, read_rssi


def compare_powers(
    dataset: RssiDataset | Path | str,
    methods: Sequence[str] | None = None,
    *,
    split: SplitKind = "files",
    train_size: int | None = None,
    seed: int = 0,
    guard: float = 0.0,
) -> PowerComparison:
    """Fit and score methods that predict received powers (RSSI) at new positions.

    Every method learns from the same known positions, those of the training and the validation part, and is scored at
    the same test positions. A known power that was not received counts as one below the dataset's floor: the laws of
    distance are fitted to it as a censored value, and the other methods take the power that the law of its gateway then
    expects. At test positions it is no error in dB, and only counts for whether reception is predicted.

    Args:
        dataset: received powers, or their folder.
        methods: some of "mean" (of each gateway), "nearest" (known position), "inverse-distance" (mean of the four
            nearest), "log-distance" (P = P₀ − 10 n log₁₀ d for each gateway), "mri" (the same for all gateways
            together, NeRF²'s baseline), "kriging" (about the log-distance law), and "helmholtz" (with a covariance of
            slow change and of fading). None: all of these. Besides them there is "nerf2", which is trained for minutes.
        split: how the test part is chosen: "files" (the folder's index files), "random" (a random fifth), "blocked"
            (every fourth block of ten consecutive positions) or "area" (connected areas with a fifth).
        train_size: number of training positions to keep; the validation part shrinks in proportion. None: all.
        seed: seed of the split and of the methods.
        guard: known positions nearer than this to a test position are left out, wavelengths.

    Returns:
        The scores.

    Raises:
        InputError: the folder cannot be read; or it has too few positions, or no index files, for the split.
        ParameterError: a method or the split is unknown, or another argument is out of its range.

    Example:
        >>> import bisplat, numpy as np
        >>> places = np.random.default_rng(0).uniform(0, 4, (40, 3))
        >>> powers = -40 - 20 * np.log10(np.linalg.norm(places - [0, 0, 5], axis=1))[:, None]
        >>> hall = bisplat.write_rssi("sports", places, powers, {"door": (0, 0, 5)}, "2.4 GHz")
        >>> scores = bisplat.compare_powers(hall, ["nearest", "log-distance"], split="random").table()
        >>> scores[0]["label"], round(scores[0]["error_median_db"], 3)
        ('log-distance', 0.0)
    """
    names = chosen_methods(methods, POWER_METHODS)
    dataset = dataset if isinstance(dataset, RssiDataset) else read_rssi(dataset)
    parts = split_positions(dataset, split, seed, train_size, guard)
    known, places, truth = parts.known, dataset.positions[parts.test], dataset.rssi_dbm[parts.test]
    if dataset.frequency is None:
        say(f"{dataset.folder}: no frequency is stated, so {USUAL_FREQUENCY / 1e6:g} MHz is assumed")
    distances = SplitDistances.between(dataset.positions[known], places, dataset.wavelength)
    say_distances(distances)
    task = KnownPowers.of(dataset, known, seed)
    rows, gateway_rows, errors = [], [], {}
    for name in names:
        begun = time.perf_counter()
        method = POWER_METHODS[name]()
        method.fit(task)
        predicted = method.predict(places)
        seconds = time.perf_counter() - begun
        scores = score_powers(predicted, truth, dataset.floor_dbm)
        label = label_of(name, method)
        rows.append({"label": label, **scores, "seconds": round(seconds, 3)})
        for number, gateway in enumerate(dataset.gateway_names):
            of_one = score_powers(of_gateway(predicted, number), truth[:, [number]], dataset.floor_dbm)
            gateway_rows.append({"label": label, "gateway": gateway, **of_one})
        errors[label] = absolute_errors(predicted, truth)
    counts = len(known), len(parts.test)
    return PowerComparison(dataset.folder, split, seed, guard, *counts, rows, gateway_rows, errors, distances)
