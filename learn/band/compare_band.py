"""Comparison of methods that predict responses over a band, on one split and by the same code."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Complex, Float

from learn.band.band_methods import BAND_METHODS, BandMethod, KnownBand, PredictedBand, require_band
from learn.channels.channel_scores import SCORES, correlation, coverage, snr_db
from learn.comparison.averaged_table import average_name
from learn.comparison.method_factories import check_effort, chosen_methods
from learn.comparison.results_folder import given_folder
from learn.comparison.score_table import Measure, ScoreTable
from learn.comparison.scored_methods import (
    FitRow,
    Parts,
    asked_sizes,
    checked_with_deviation,
    earlier_sizes,
    fit_results,
    score_fits,
)
from learn.data.splits import Split, SplitKind
from scenes.files.npz_file import Expected
from scenes.files.plain_text import say
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import given_dataset
from simulate.spectra.band import delay_spread


def score_band(
    predicted: PredictedBand, truth: Complex[np.ndarray, "K elements subcarriers"], bandwidth: float
) -> dict[str, Any]:
    """Score predicted responses over a band."""
    snr = snr_db(predicted.responses, truth)
    heard = ~np.isnan(snr)
    if not heard.any():
        return dict.fromkeys(SCORES)
    found, truth, snr = predicted.responses[heard], truth[heard], snr[heard]
    off = np.abs(delay_spread(found, bandwidth) - delay_spread(truth, bandwidth))
    return {
        "snr_median_db": float(np.median(snr)),
        "snr_mean_db": float(snr.mean()),
        "snr_p10_db": float(np.quantile(snr, 0.1)),
        "correlation_median": float(np.median(correlation(found, truth))),
        "delay_spread_error_median_ns": 1e9 * float(np.median(off)),
        "coverage_90": None if predicted.deviation is None else coverage(found - truth, predicted.deviation[heard]),
    }


class BandRow(FitRow, frozen=True, kw_only=True):
    """The entries that every kept row has."""

    snr_median_db: float | None
    snr_mean_db: float | None


@dataclass(frozen=True, kw_only=True, repr=False)
class BandComparison(ScoreTable):
    """Rows measured by ``compare_band``.

    ``pandas.DataFrame(comparison)`` makes a table of the rows. ``print(comparison)`` shows the averages over the seeds,
    the best first, and a notebook shows the same as HTML. ``len(comparison)`` and iteration are those of ``rows``.

    A row has "label", the name of the method, "seed" of the fit, "train_size", the number of training positions asked
    for (None: all), "known", the number of known positions, "found", what the fit found in words (None: it says
    nothing), "steps" of training (None: the method has none), "seconds" for the fit and the predictions, "source" of a
    class of your own, a hash that tells when it has to be measured again, and these scores:

    - "snr_median_db", "snr_mean_db" and "snr_p10_db" (10th percentile) of the signal-to-noise ratio of the predicted
      responses over all elements and subcarriers of a position, 10 log₁₀ ‖y‖² / ‖y − ŷ‖², dB;
    - "correlation_median", of ``|ŷ^H y|`` / (‖ŷ‖ ‖y‖), which a wrong level or common phase leaves as it is;
    - "delay_spread_error_median_ns", of the absolute error of the root mean square delay spread, ns;
    - "coverage_90", the share of the real and imaginary parts of the responses within the stated 90 % intervals; None
      if the method states none.

    Attributes:
        folder: the dataset's folder.
        split: how the test part was chosen.
        seed: seed of the split.
        guard: known positions nearer than this to a test position were left out, wavelengths.
        minutes: training time of each method that is trained by steps.
        parts: training, validation and test part; of several sizes, those of the largest.
        rows: a dictionary for each method, seed and size, in the order in which they were measured. ``averages()`` and
            ``table()`` average them over the seeds.
        distances: how far the test positions are from the known ones.
        dataset: the spectra, with their responses over the band.
        snr_db: SNR of each test position, dB, [test], of the first seed, by the name of the row in the table.

    Example:
        >>> import bisplat, numpy as np
        >>> places = np.random.default_rng(0).uniform(0, 0.2, (60, 3))
        >>> delays = np.linalg.norm(places - [4, 0, 0], axis=1) / 3e8
        >>> waves = np.exp(-2j * np.pi * delays[:, None] * (2.4e9 + 1.25e6 * (np.arange(16) - 8)))
        >>> array = bisplat.PlanarArray(1, 4)
        >>> wide = bisplat.write_dataset("data/hall", places, waves[:, None] * np.ones((4, 1)), array, "2.4 GHz",
        ...                              bandwidth="20 MHz")
        >>> comparison = bisplat.compare_band(wide, ["nearest", "helmholtz"], split="random")
        >>> [row["label"] for row in comparison.table()]  # the best first
        ['helmholtz', 'nearest']
        >>> comparison
        BandComparison('data/hall': 2 methods, 48 known and 12 test positions, split random)
    """

    COLUMNS: ClassVar[Mapping[str, str]] = {
        "snr_median_db": "median SNR (dB)",
        "snr_mean_db": "mean SNR (dB)",
        "snr_p10_db": "10th % (dB)",
        "correlation_median": "median correlation",
        "delay_spread_error_median_ns": "delay spread off (ns)",
        "coverage_90": "in 90 % interval",
        "steps": "steps",
        "seconds": "seconds",
    }
    MEASURE: ClassVar[Measure] = Measure(
        "snr", "snr_median_db", "snr_mean_db", False, "SNR of the predicted responses (dB)", "share of positions"
    )
    RANKED_BY: ClassVar[str] = MEASURE.key
    THINGS: ClassVar[str] = "positions"

    dataset: Dataset = field(repr=False)
    snr_db: Mapping[str, Float[np.ndarray, " K"]]

    def of_each(self) -> dict[str, Float[np.ndarray, "..."]]:
        return dict(self.snr_db)


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
    dataset = given_dataset(dataset)
    require_band(dataset)
    assert dataset.band is not None
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
