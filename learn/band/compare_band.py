"""Comparison of methods that predict responses over a band, on one split and by the same code."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from learn.band.band_comparison import BandComparison, BandRow, score_band
from learn.band.band_methods import BAND_METHODS, BandMethod, KnownBand, PredictedBand, require_band
from learn.channels.channel_scores import snr_db
from learn.comparison.averaged_table import average_name
from learn.comparison.method_factories import check_effort, chosen_methods
from learn.comparison.results_folder import given_folder
from learn.comparison.scored_methods import (
    Parts,
    asked_sizes,
    checked_with_deviation,
    earlier_sizes,
    fit_results,
    score_fits,
)
from learn.data.splits import Split, SplitKind
from scenes.files.errors import require_instance
from scenes.files.npz_file import Expected
from scenes.files.plain_text import say
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import read_dataset


def compare_band(
    dataset: Dataset | Path | str,
    methods: Sequence[str] | Mapping[str, str | BandMethod | Callable[[], BandMethod]] | None = None,
    *,
    split: SplitKind = "files",
    train_size: int | Sequence[int] | None = None,
    seed: int = 0,
    guard: float = 0.0,
    seeds: int = 1,
    budget: float = 5.0,
    output: Path | str | None = None,
) -> BandComparison:
    """Fit and score methods that predict responses over a band at new positions.

    Every method learns from the responses of the same known positions, those of the training and the validation part,
    and is scored at the same test positions. Responses are complex, so that the level and the phase must be right, too.

    A method is an object with two methods. ``fit(known)`` learns from ``known.positions`` [n, 3] (metres) and
    ``known.responses`` [n, elements, subcarriers], and may use ``known.frequencies`` (Hz), ``known.dataset``,
    ``known.seed`` and ``known.minutes``. ``predict(positions)`` takes positions [K, 3] and returns responses
    [K, elements, subcarriers], or an object with the attributes ``responses`` and ``deviation``, the standard deviation
    [K] of their real and imaginary parts.

    Args:
        dataset: a dataset with responses over a band, or its folder.
        methods: some of "nearest" (known position), "inverse-distance" (mean of the four nearest), "kriging" (of all
            subcarriers, with a squared exponential) and "helmholtz" (kriging with waves whose directions and delays are
            fitted), and, trained by steps, "mlp-responses" and "bisplat-aperture" (networks of a path's gains, with
            learned delays); or classes of your own ("module:Class"). Or a dictionary from labels to methods, as for
            ``compare_powers``. None: all that are not trained by steps.
        split: how the test part is chosen: "files" (the folder's index files), "random" (a random fifth), "blocked"
            (every fourth block of ten consecutive positions) or "area" (connected areas with a fifth).
        train_size: number of training positions to keep; the validation part shrinks in proportion. Or several
            numbers: every method is then fitted to each. None: all of them.
        seed: seed of the split.
        guard: known positions nearer than this to a test position are left out, wavelengths.
        seeds: number of fits of each method, with seeds 0, 1, …
        budget: training time of each method that is trained by steps, minutes.
        output: folder that keeps each fit as soon as it is scored. The same call again makes those that are missing.
            None: nothing is kept.

    Returns:
        The scores, with those that the output has from earlier calls.

    Raises:
        InputError: the folder cannot be read; or it has no band, or too few positions or no index files for the split.
            Or something went wrong in a method of your own. Or the output has a comparison with other settings, or
            other files.
        ParameterError: a method or the split is unknown, or another argument is out of its range.

    Example:
        >>> import bisplat, numpy as np
        >>> waves = np.exp(-1j * np.linspace(0.1, 0.3, 20)[:, None, None] * np.arange(16)) * np.ones((8, 1))
        >>> array = bisplat.PlanarArray(1, 8)
        >>> wide = bisplat.write_dataset("data/waves", np.eye(20, 3), waves, array, "2.4 GHz", bandwidth="20 MHz")
        >>> comparison = bisplat.compare_band(wide, ["nearest", "inverse-distance"], split="random")
        >>> len(comparison), comparison.snr_db["nearest"].shape
        (2, (4,))
    """
    check_effort(budget, seeds)
    folder = given_folder(output)
    factories = chosen_methods(methods, BAND_METHODS)
    require_instance(Dataset, str, PathLike, dataset=dataset)
    dataset = dataset if isinstance(dataset, Dataset) else read_dataset(dataset)
    require_band(dataset)
    assert dataset.band is not None and dataset.band_responses is not None
    bandwidth = dataset.band.bandwidth
    sizes = asked_sizes(train_size, "positions")
    parts = Parts.of(dataset, split, seed, {*sizes, *earlier_sizes(folder)}, guard)
    test = parts.largest.test
    places, truth = dataset.positions[test], dataset.band_responses[test]

    def known(part: Split, method_seed: int) -> KnownBand:
        return KnownBand(dataset, part.known, method_seed, budget)

    def predict(label: str, method: BandMethod) -> tuple[PredictedBand, str | None]:
        given = method.predict(places)
        checked = checked_with_deviation(label, "responses over the band", given, "responses", truth.shape, "position")
        found = getattr(method, "found", None)
        if found is not None:
            say(f"{label}: {found}")
        return PredictedBand(*checked), found

    def score(given: tuple[PredictedBand, str | None]) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
        predicted, found = given
        scores = {**score_band(predicted, truth, bandwidth), "found": found}
        return scores, {"snr_db": snr_db(predicted.responses, truth)}

    data = [
        dataset.positions,
        dataset.band_responses,
        np.array([dataset.wavelength, bandwidth]),
        dataset.train,
        dataset.test,
    ]
    expected = {"snr_db": Expected("signal-to-noise ratios", "f", (len(test),))}
    settings = {"split": split, "seed": seed, "guard": float(guard), "minutes": float(budget)}
    with fit_results(folder, "responses over a band", dataset.folder, settings, data, BandRow) as kept:
        score_fits(factories, BAND_METHODS, seeds, parts.only(sizes), known, predict, score, kept)
        ratios = {average_name(row): arrays["snr_db"] for row, arrays in kept.arrays(expected)}
        rows = kept.rows
    return BandComparison(
        folder=dataset.folder,
        split=split,
        seed=seed,
        guard=guard,
        minutes=budget,
        parts=parts.largest,
        rows=rows,
        distances=parts.distances,
        dataset=dataset,
        snr_db=ratios,
    )
