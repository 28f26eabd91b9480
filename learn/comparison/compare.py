"""Comparison of models and baselines on one split, scored by the same code."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from learn.comparison.experiment import begun
from learn.comparison.methods import is_reduced, method_named, method_names
from learn.comparison.table import Comparison
from learn.comparison.task import Method
from learn.data.splits import SplitKind
from scenes.files.errors import ParameterError, require_positive, require_whole, require_within, shown
from simulate.dataset.dataset_folder import Dataset

Models = Sequence[str] | Mapping[str, str | Method | Callable[[], Method]]
"""Names of methods, or a dictionary from names to methods; ``compare`` describes both."""


MINUTES_MOST, SEEDS_MOST = 10_000.0, 1000
"""Largest budget, a week, and number of fits of each method."""


def compare(
    dataset: Dataset | Path | str,
    models: Models | None = None,
    split: SplitKind = "files",
    budget: float = 5.0,
    seeds: int = 1,
    test_spectra: int | None = None,
    output: Path | str | None = None,
) -> Comparison:
    """Fit and score methods on one split, and measure the array's ceiling. Makes no figures.

    A second call with the same ``output`` measures only the rows that are missing there, and returns all rows.

    Args:
        dataset: a dataset, or its folder.
        models: names of methods (``learn.comparison.methods.method_names`` lists them) or of classes
            ("module:Class"); or a dictionary whose keys are the labels in the table and whose values are such a name, a
            class with ``fit`` and ``predict``, a function that returns an object with both, or such an object, which
            is copied for each seed. None: every baseline and model.
        split: how the test part is chosen; "random" draws the same test part for every method.
        budget: training time of each model that is trained by steps, minutes.
        seeds: number of fits of each method, with seeds 0, 1, …
        test_spectra: largest number of test spectra that are scored, evenly spread over the test part; None: all of it.
        output: folder for results.jsonl, per_sample/ and runs/; None: a new temporary folder, which is not deleted and
            whose path is the ``folder`` of the result.

    Returns:
        All rows measured in the folder.

    Raises:
        InputError: the dataset cannot be read, or the folder holds an experiment with other settings, or other files,
            or another process writes to it.
        ParameterError: a method is unknown, or ``budget``, ``seeds`` or ``test_spectra`` is not positive.

    >>> import numpy as np
    >>> class Grey:
    ...     def fit(self, task):
    ...         self.mean = task.spectra.mean()
    ...
    ...     def predict(self, positions):
    ...         return np.full((len(positions), 90, 360), self.mean)
    >>> comparison = compare("data/lab", {"nearest": "nearest", "grey": Grey})
    >>> [row["label"] for row in comparison]
    ['nearest', 'grey', "array's ceiling"]
    >>> import pandas
    >>> "ssim_median" in pandas.DataFrame(comparison)
    True
    """
    check_effort(budget, seeds)
    methods = makers(method_names() if models is None else models)
    with begun(dataset, split, output, minutes=budget, test_spectra=test_spectra) as experiment:
        experiment.measure(methods, seeds)
        experiment.measure_ceiling()
        return Comparison.of(experiment)


def check_effort(budget: float, seeds: int) -> None:
    """Refuse a budget that is no number of minutes above 0 and at most ``MINUTES_MOST``, or a number of seeds outside
    1 to ``SEEDS_MOST``.

    Raises:
        ParameterError: either of them.
    """
    require_positive(budget=budget)
    require_within(0, MINUTES_MOST, "minutes", budget=budget)
    require_whole(1, SEEDS_MOST, seeds=seeds)


def makers(models: Models) -> dict[str, Callable[[], Method]]:
    """Functions that make new, unfitted methods, by the label of their rows: a model of reduced size is marked.

    Args:
        models: as for ``compare``.

    Raises:
        ParameterError: there is no method, or one is unknown or has no ``fit``.

    >>> list(makers(["nearest", "kriging"]))
    ['nearest', 'kriging']
    """
    if not models:
        raise ParameterError("models", "expected at least one method, found none")
    if not isinstance(models, Mapping):
        return {f"{name} (reduced)" if is_reduced(name) else name: method_named(name) for name in models}
    return {name: _maker(name, given) for name, given in models.items()}


def _maker(name: str, given: Any) -> Callable[[], Method]:
    if isinstance(given, str):
        return method_named(given)
    if not isinstance(given, type) and hasattr(given, "fit"):
        return partial(copy.deepcopy, given)
    if not callable(given):
        raise ParameterError("models", f"expected a method with fit and predict for {name}, found {shown(given)}")
    return given
