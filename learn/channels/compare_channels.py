"""Comparison of methods that predict the downlink's channels from the uplink's, on one split and by the same code."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Complex, Float, Int

from learn.channels.channel_methods import CHANNEL_METHODS
from learn.channels.channel_scores import score_channels, snr_db
from learn.channels.known_channels import ChannelMethod, KnownChannels, PredictedChannels
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
from simulate.spectra.spectrum import evenly


class ChannelRow(FitRow, frozen=True, kw_only=True):
    """The entries that every kept row has."""

    snr_median_db: float | None
    snr_mean_db: float | None


@dataclass(frozen=True, kw_only=True, repr=False)
class ChannelComparison(ScoreTable):
    """Rows measured by ``compare_channels``.

    ``pandas.DataFrame(comparison)`` makes a table of the rows. ``print(comparison)`` shows the averages over the seeds,
    the best first, and a notebook shows the same as HTML. ``len(comparison)`` and iteration are those of ``rows``.

    A row has "label", the name of the method, "seed" of the fit, "train_size", the number of training rows asked for
    (None: all), "known", the number of known rows, "steps" of training (None: the method has none), "seconds" for the
    fit and the predictions, "source" of a class of your own, a hash that tells when it has to be measured again, and
    these scores:

    - "rows", the number of test rows that the scores refer to, those whose downlink is not zero;
    - "snr_median_db", "snr_mean_db" and "snr_p10_db" (10th percentile) of the signal-to-noise ratio of the predicted
      downlink, 10 log₁₀ ‖h‖² / ‖h − ĥ‖² for each row, dB, at most 200;
    - "correlation_median", of ``|ĥ^H h|`` / (‖ĥ‖ ‖h‖), which a wrong level or common phase leaves as it is;
    - "delay_spread_error_median_ns", of the absolute error of the downlink's root mean square delay spread, ns; None if
      the folder states no bandwidth;
    - "coverage_90", the share of the real and imaginary parts of the channels within the stated 90 % intervals; None if
      the method states none.

    They are None if no test row has a downlink.

    Attributes:
        folder: the dataset's folder.
        split: how the test part was chosen.
        seed: seed of the split.
        guard: known positions nearer than this to a test position were left out, wavelengths.
        minutes: training time of each method that is trained by steps.
        parts: training, validation and test part; of several sizes, those of the largest.
        rows: a dictionary for each method, seed and size, in the order in which they were measured. ``averages()`` and
            ``table()`` average them over the seeds.
        distances: how far the test positions are from the known ones. None: positions or frequency are not known.
        dataset: the channels.
        snr_db: SNR of each test row, dB, [test], of the first seed, by the name of the row in the table; NaN where the
            downlink is zero.
        shown: which of the test rows ``examples`` are, at most 1,000, evenly spread.
        examples: predicted downlinks of these rows, [shown, antennas, subcarriers], of the first seed, by the name of
            the row in the table.

    Example:
        >>> import bisplat, numpy as np
        >>> array = bisplat.PlanarArray(1, 8)
        >>> ramps = np.exp(-1j * np.linspace(0.1, 0.3, 20)[:, None, None] * np.arange(52)) * np.ones((8, 1))
        >>> y = np.random.default_rng(0).uniform(1, 2, (20, 1, 1)) * ramps
        >>> wide = bisplat.write_dataset("data/ramps", np.eye(20, 3), y, array, "2.4 GHz", bandwidth="20 MHz")
        >>> bisplat.export_csi(wide, "ramps")
        >>> comparison = bisplat.compare_channels("ramps", ["copy", "ramp"], split="random")
        >>> [row["label"] for row in comparison.table()]  # the best first
        ['ramp', 'copy']
        >>> comparison.snr_db["copy"].shape
        (4,)
        >>> comparison
        ChannelComparison('ramps': 2 methods, 16 known and 4 test rows, split random)
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
        "snr", "snr_median_db", "snr_mean_db", False, "SNR of the predicted downlink (dB)", "share of rows"
    )
    RANKED_BY: ClassVar[str] = MEASURE.key
    THINGS: ClassVar[str] = "rows"

    dataset: Dataset = field(repr=False)
    snr_db: Mapping[str, Float[np.ndarray, " K"]]
    shown: Int[np.ndarray, " E"]
    examples: Mapping[str, Complex[np.ndarray, "E A S"]]

    def of_each(self) -> dict[str, Float[np.ndarray, "..."]]:
        return dict(self.snr_db)


MOST_KNOWN = 5000
"""With more known rows, so many of them are drawn, and the methods learn from these alone."""

BLOCK = 1000  # Rows that are predicted at once

EXAMPLES = 1000  # Most test rows whose predictions are kept

SMALLEST = 1e-290
"""Smallest number that channels are divided by: complex division by smaller ones overflows."""


def compare_channels(
    dataset: Dataset | Path | str,
    methods: Sequence[str] | Mapping[str, str | ChannelMethod | Callable[[], ChannelMethod]] | None = None,
    *,
    split: SplitKind = "files",
    train_size: int | Sequence[int] | None = None,
    seed: int = 0,
    guard: float = 0.0,
    seeds: int = 1,
    budget: float = 5.0,
    output: Path | str | None = None,
) -> ChannelComparison:
    """Fit and score methods that predict the downlink of rows of channels (CSI) from their uplink.

    Every method learns from both links of the same known rows, those of the training and the validation part. It is
    then given the uplink of the same test rows, and their positions if the folder has them. The downlink's subcarriers
    are taken to follow the uplink's at the same distance, as in the data of NeRF² and of ``export_csi``.

    A method is an object with two methods. ``fit(known)`` learns from ``known.uplink`` and ``known.downlink``
    [n, A, S], in units of their largest number, and may use ``known.positions`` ([n, 3] in metres, or None),
    ``known.seed`` and ``known.minutes``. ``predict(uplink, positions)`` takes uplinks [K, A, S], in the same units, and
    positions [K, 3] or None, and returns downlinks [K, A, S]. It may state deviations, too, as ``downlink`` and
    ``deviation`` [K] of an object: about 90 % of the real and imaginary parts are within 1.645 of them.

    Args:
        dataset: channels, or their folder.
        methods: some of "copy" (the uplink as it is), "ramp" (each antenna's uplink as one path), "nearest" (the
            downlink of the known row whose uplink correlates most, with the factor that fits the uplinks), "delays"
            (Gaussian-process regression over frequency, with a power of each delay that is fitted to the known rows)
            "helmholtz" (the linear minimum-mean-square-error estimate over all antennas and subcarriers) and
            "helmholtz-positions" (the same of what kriging of both links from the known rows nearby leaves), or
            classes of your own ("module:Class"). Or a dictionary from labels to methods, as for ``compare_powers``.
            None: all that are not trained by steps. "nerf2" is,
            for ``budget`` minutes.
        split: how the test part is chosen: "files" (the folder's index files), "random" (a random fifth), "blocked"
            (every fourth block of ten consecutive rows) or "area" (connected areas with a fifth, of known positions).
        train_size: number of training rows to keep; the validation part shrinks in proportion. Or several numbers:
            every method is then fitted to each. Smaller training parts are contained in larger ones, and the test part
            is the same for all. None: all of them.
        seed: seed of the split.
        guard: known positions nearer than this to a test position are left out, wavelengths. Positions and frequency
            must be known.
        seeds: number of fits of each method, with seeds 0, 1, …
        budget: training time of each method that is trained by steps, minutes.
        output: folder that keeps each fit as soon as it is scored. The same call again makes those that are missing.
            None: nothing is kept.

    Returns:
        The scores, with those that the output has from earlier calls.

    Raises:
        InputError: the folder cannot be read; or it has too few rows, no index files or no positions for the split. Or
            something went wrong in a method of your own. Or the output has a comparison with other settings, or other
            files.
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
    check_effort(budget, seeds)
    folder = given_folder(output)
    factories = chosen_methods(methods, CHANNEL_METHODS)
    dataset = given_dataset(dataset, "channel")
    if dataset.frequencies is None:
        say(f"{dataset.folder}: assumed that the downlink's subcarriers follow the uplink's at the same distance")
    sizes = asked_sizes(train_size, "rows")
    parts = Parts.of(dataset, split, seed, {*sizes, *earlier_sizes(folder)}, guard)
    level = _largest(dataset.uplink, dataset.downlink)  # so that no square of a channel is out of a float's range
    test, places = parts.largest.test, dataset.places
    heard = None if places is None else places[test]
    uplink, truth = dataset.uplink[test] / level, dataset.downlink[test] / level
    bandwidth = None if dataset.band is None else truth.shape[2] * dataset.band.spacing
    if len(parts.largest.known) > MOST_KNOWN:
        say(f"the methods learn from {MOST_KNOWN} of the {len(parts.largest.known)} known rows")

    def known(part: Split, method_seed: int) -> KnownChannels:
        taught = part.known
        if len(taught) > MOST_KNOWN:
            taught = np.sort(np.random.default_rng(seed).permutation(taught)[:MOST_KNOWN])
        positions = None if places is None else places[taught]
        return KnownChannels(
            dataset.uplink[taught] / level,
            dataset.downlink[taught] / level,
            positions,
            method_seed,
            budget,
            antennas=dataset.gateway_positions,
            wavelength=dataset.wavelength,
        )

    def predict(label: str, method: ChannelMethod) -> PredictedChannels:
        blocks = []
        for at in range(0, len(uplink), BLOCK):
            block = slice(at, at + BLOCK)
            found = method.predict(uplink[block], None if heard is None else heard[block])
            shape = truth[block].shape
            checked = checked_with_deviation(label, "channels of the downlink", found, "downlink", shape, "row")
            blocks.append(PredictedChannels(*checked))
        deviations = [each.deviation for each in blocks if each.deviation is not None]
        deviation = np.concatenate(deviations) if len(deviations) == len(blocks) else None
        return PredictedChannels(np.concatenate([each.downlink for each in blocks]), deviation)

    shown = evenly(np.arange(len(test)), EXAMPLES)

    def score(found: PredictedChannels) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
        arrays = {"snr_db": snr_db(found.downlink, truth), "examples": level * found.downlink[shown]}
        return score_channels(found.downlink, truth, bandwidth, found.deviation), arrays

    links = [dataset.uplink, dataset.downlink, dataset.gateway_positions]
    data = [*links, places, dataset.frequencies, dataset.train, dataset.test]
    expected = {
        "snr_db": Expected("signal-to-noise ratios", "f", (len(test),)),
        "examples": Expected("channels", "c", (len(shown), *truth.shape[1:])),
    }
    settings = {"split": split, "seed": seed, "guard": float(guard), "minutes": float(budget)}
    with fit_results(folder, "channels", dataset.folder, settings, data, ChannelRow) as kept:
        score_fits(factories, CHANNEL_METHODS, seeds, parts.only(sizes), known, predict, score, kept)
        of_first = {average_name(row): arrays for row, arrays in kept.arrays(expected)}
        rows = kept.rows
    return ChannelComparison(
        folder=dataset.folder,
        split=split,
        seed=seed,
        guard=guard,
        minutes=budget,
        parts=parts.largest,
        rows=rows,
        distances=parts.distances,
        dataset=dataset,
        snr_db={name: arrays["snr_db"] for name, arrays in of_first.items()},
        shown=shown,
        examples={name: arrays["examples"] for name, arrays in of_first.items()},
    )


def _largest(*links: Complex[np.ndarray, "K A S"]) -> float:
    """The largest absolute real or imaginary part, or ``SMALLEST``."""
    largest = max(float(np.abs(part).max()) for link in links for part in (link.real, link.imag))
    return max(largest, SMALLEST)
