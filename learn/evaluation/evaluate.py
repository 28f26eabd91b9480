"""Scores of a run, the baselines and the array's ceiling on the same held-out spectra."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from learn.comparison.comparison import Comparison
from learn.data.metrics import Scores, require_scorable, scorable, score
from learn.data.neighbours import inverse_distance, nearest
from learn.data.split_distances import SplitDistances
from learn.evaluation.prediction_intervals import StatedIntervals, intervals_by_distance
from learn.fitted.method_run import MethodRun, evaluate_method
from learn.fitted.runs import load_run
from learn.models.base import Report
from learn.quantities.array_ceiling import CEILING, NO_CEILING, SAMPLES, array_ceiling, has_ceiling
from learn.training.config import Origin, require_same_link
from learn.training.conformal_deviation import pixel_errors
from learn.training.run_folder import Run, load_spectra
from scenes.files.errors import InputError, require_flag, require_path
from scenes.files.plain_text import say
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import given_dataset, require_fixed_end
from simulate.dataset.index_files import read_index
from simulate.spectra.spectrum import evenly, spectrum_of

JSON_NAMES = {
    "mean-picture": "mean_picture",
    "nearest": "nearest",
    "inverse-distance": "inverse_distance",
    CEILING: "array_ceiling",
}
"""Names of the baselines in metrics.json and in the JSON output of ``bisplat evaluate``."""


@dataclass(frozen=True)
class Evaluation:
    """Predictions for K test spectra, and the scores of the model and of the baselines.

    Attributes:
        run_name: name of the run's folder.
        dataset: the dataset tested on.
        test: [K] indices of the test spectra in ``dataset``, without constant ones, which show no direction.
        known_positions: [n, 3] transmitter positions of the spectra that the run and the baselines learned from,
            metres, world frame.
        prediction: [K, 90, 360] predicted spectra, 0…1, float32.
        deviation: [K] standard deviation that the run states for the values of each predicted spectrum, 0…1. None: it
            states none.
        scores: scores by name: "model", "mean-picture", "nearest" and "inverse-distance" of all K test spectra, and
            "array's ceiling" of at most 50 of them, evenly spread, unless it was left out.
        origin: what the run was trained on.
        tested_on: what the test spectra are, in words. None: the test part of the run's split.

    Example:
        >>> import bisplat
        >>> evaluation = bisplat.evaluate("runs/lab")
        >>> evaluation.positions.shape[0] == len(evaluation.test) == len(evaluation.truth) == len(evaluation.prediction)
        True
        >>> worst = evaluation.scores["model"].ssim.argmin()  # of the test spectra
        >>> bool(evaluation.scores["model"].ssim[worst] <= evaluation.metrics()["ssim_median"])
        True
    """

    run_name: str
    dataset: Dataset
    test: Int[np.ndarray, " K"]
    known_positions: Float[np.ndarray, "n 3"]
    prediction: Float[np.ndarray, "K 90 360"]
    deviation: Float[np.ndarray, " K"] | None
    scores: dict[str, Scores]
    origin: Origin
    tested_on: str | None = None

    def __len__(self) -> int:
        return len(self.test)

    def __repr__(self) -> str:
        median = np.median(self.scores["model"].ssim)
        return f"Evaluation({self.run_name!r}: {len(self)} test spectra, median SSIM {median:.3f})"

    @property
    def positions(self) -> Float[np.ndarray, "K 3"]:
        """[K, 3] transmitter positions of the test spectra, metres, world frame."""
        return self.dataset.positions[self.test]

    @property
    def truth(self) -> Float[np.ndarray, "K 90 360"]:
        """[K, 90, 360] the dataset's test spectra, 0…1, float32."""
        return spectrum_of(self.dataset.pictures[self.test])

    @cached_property
    def distances(self) -> SplitDistances:
        """Distances from the test positions to the nearest known ones."""
        return SplitDistances.between(self.known_positions, self.positions, self.dataset.wavelength)

    @cached_property
    def errors_in_deviations(self) -> Float[np.ndarray, "K P"] | None:
        """[K, P] absolute errors at P pixels of each spectrum, divided by ``deviation``; nan where that is nan. None:
        the run states no deviation anywhere.

        The pixels are those of every fifth row and column.
        """
        if self.deviation is None or np.isnan(self.deviation).all():
            return None
        return np.abs(pixel_errors(self.prediction, self.truth)) / self.deviation[:, None]

    def metrics(self) -> dict[str, Any]:
        """Medians and means over the test spectra, as in metrics.json.

        Returns:
            The entries of ``Scores.summary`` for the model; "test_spectra" (K); "known_spectra" (n); the least and the
            median distance from a test position to the nearest known one ("test_to_known_least_m", …, also in
            wavelengths); and "baselines", a dictionary of entries as the model's for "mean_picture", "nearest",
            "inverse_distance" and "array_ceiling". If the run states deviations,
            also "within_90_percent_interval" (share of the true values that lie in the stated 90 % intervals),
            "interval_width_mean", "deviation_median", and "interval_bands", a dictionary with the number of spectra,
            this share and this width for each band of the distance to the nearest known position.
        """
        others = [(name, json_name) for name, json_name in JSON_NAMES.items() if name in self.scores]
        baselines = {json_name: self.scores[name].summary() for name, json_name in others}
        metrics = {
            **self.scores["model"].summary(),
            "test_spectra": len(self.test),
            "known_spectra": self.distances.known,
            **self.distances.facts(),
            "baselines": baselines,
        }
        if self.deviation is not None and self.errors_in_deviations is not None:
            intervals = StatedIntervals.of(self.errors_in_deviations, self.deviation)
            if intervals is not None:
                metrics["within_90_percent_interval"] = intervals.share
                metrics["interval_width_mean"] = intervals.width
                metrics["deviation_median"] = float(np.nanmedian(self.deviation))
                metrics["interval_bands"] = {band: each.facts() for band, each in self.intervals_by_distance().items()}
        return metrics

    def intervals_by_distance(self) -> dict[str, StatedIntervals]:
        """How the stated 90 % intervals hold in each band of the distance to the nearest known position.

        Returns:
            For each band that has test spectra, in words: their number, the share of the true values that are within
            their intervals, and the mean width of these. Empty if the run states no deviation.

        Example:
            >>> import bisplat
            >>> bands = bisplat.evaluate("runs/lab").intervals_by_distance()
            >>> all(each.spectra > 0 for each in bands.values())
            True
        """
        if self.deviation is None or self.errors_in_deviations is None:
            return {}
        wavelengths = self.distances.distance / self.distances.wavelength
        return dict(intervals_by_distance(self.errors_in_deviations, self.deviation, wavelengths))


def evaluate(
    run: Run | Path | str,
    dataset: Dataset | Path | str | None = None,
    index: Path | None = None,
    ceiling: bool = True,
    report: Report = lambda phase, done, total: None,
) -> Evaluation | Comparison:
    """Score a run and the baselines on the same held-out rows, and of spectra the array's ceiling.

    The function writes nothing; ``bisplat evaluate`` writes a report. The options are those of a run of spectra.

    Args:
        run: a trained run, or its folder.
        dataset: another dataset, or its folder; the run is then tested on all of its spectra. None, or the dataset that
            the run was trained on, in whatever folder it is now: the run is tested on the test part of its split.
        index: a file with the names of the spectra to test on instead, one per line.
        ceiling: also score the array's ceiling. If the dataset has no responses, these are found behind at most 50
            spectra, which takes a second for 4 × 4 elements, and half a minute for 16 × 16.
        report: called with the part, the number of parts done, and the number of all parts.

    Returns:
        The predictions and the scores; of other quantities the table that ``compare`` returns.

    Raises:
        InputError: the run, the dataset or the index cannot be read; the run's dataset has been replaced; the index
            names spectra that the run was trained on; the spectra are of another grid, frequency or array than the
            run's predictions, or another end moves; the array has fewer than three elements; or all test spectra are
            constant.

    Example:
        >>> evaluation = evaluate("runs/lab")
        >>> evaluation.prediction.shape == (len(evaluation.test), 90, 360)
        True
        >>> list(evaluation.scores)
        ['model', 'mean-picture', 'nearest', 'inverse-distance', "array's ceiling"]
    """
    require_flag(ceiling=ceiling)
    found = run if isinstance(run, Run) else load_run(run)
    if isinstance(found, MethodRun) and dataset is None and index is None:
        return evaluate_method(found)
    return evaluate_spectra(found, dataset, index, ceiling, report)


def evaluate_spectra(
    run: Run | Path | str,
    dataset: Dataset | Path | str | None = None,
    index: Path | None = None,
    ceiling: bool = True,
    report: Report = lambda phase, done, total: None,
) -> Evaluation:
    """Score a run of spectra, as ``evaluate`` explains it."""
    if index is not None:
        require_path(index=index)
    run = load_spectra(run)
    if dataset is None:
        tested_on = run.dataset()
    else:
        tested_on = given_dataset(dataset)
        require_fixed_end(tested_on)
    same = dataset is None or run.is_trained_on(tested_on)
    known_data = tested_on if same else run.dataset()
    require_scorable(tested_on.array, str(tested_on.folder))
    grid, array = tested_on.grid, tested_on.array
    if grid != run.beamformer.grid:
        raise InputError(
            f"{tested_on.folder}: expected spectra on the grid that the run predicts, {run.beamformer.grid}, "
            f"found {grid}"
        )
    if not same:
        receiver = run.folder, run.beamformer.array, float(run.model.wavelength)
        require_same_link(*receiver, known_data, tested_on)
    parts = run.split(known_data)
    known, test = parts.known, parts.test if same else np.arange(len(tested_on.names))
    if index is not None:
        test = read_index(Path(index), tested_on.names)
        both = np.intersect1d(test, known) if same else np.array([])
        if len(both):
            raise InputError(
                f"{index}: expected names of spectra that the run was not trained on, found {len(both)} that it was "
                f"trained on, such as {tested_on.names[both[0]]}"
            )

    test = scorable(tested_on, test)
    truth = spectrum_of(tested_on.pictures[test])
    positions = tested_on.positions[test]
    known_spectra, known_positions = spectrum_of(known_data.pictures[known]), known_data.positions[known]
    methods: dict[str, Callable[[], Float[np.ndarray, "K 90 360"]]] = {
        "mean-picture": lambda: np.broadcast_to(known_spectra.mean(axis=0), (len(positions), *known_spectra.shape[1:])),
        "nearest": lambda: nearest(known_positions, known_spectra, positions),
        "inverse-distance": lambda: inverse_distance(known_positions, known_spectra, positions),
    }
    if ceiling and not has_ceiling(tested_on):
        say(f"{tested_on.folder}: the array's ceiling is left out: {NO_CEILING}")
        ceiling = False
    total = len(methods) + 1 + ceiling
    report("model", 0, total)
    prediction = run.predict(positions).spectra
    scores = {"model": score(prediction, truth, grid, array)}
    for name, predicted in methods.items():
        report(name, len(scores), total)
        scores[name] = score(predicted(), truth, grid, array)
    if ceiling:
        report(CEILING, len(scores), total)
        rows = evenly(np.arange(len(test)), SAMPLES)
        recorded = None if "response" not in tested_on.values else tested_on.responses[test[rows]]
        scores[CEILING] = score(array_ceiling(truth[rows], tested_on.beamformer, recorded), truth[rows], grid, array)
    return Evaluation(
        run_name=run.name,
        dataset=tested_on,
        test=test,
        known_positions=known_positions,
        prediction=prediction,
        deviation=run.deviation(positions),
        scores=scores,
        origin=Origin.of(run.config, parts, run.dataset_sha256),
        tested_on=_tested_on(tested_on, same, index),
    )


def _tested_on(dataset: Dataset, same: bool, index: Path | None) -> str | None:
    """What the test spectra are, in words. None: the test part of the run's split."""
    of = "" if same else f" of {dataset.folder.resolve().name}"
    if index is not None:
        return f"the spectra{of} named in {Path(index).name}"
    return None if same else f"all spectra{of}"
