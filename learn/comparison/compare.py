"""Every method and baseline on one split, scored by the same code."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from learn.comparison.experiment import begin
from learn.comparison.methods import is_reduced, method_named, method_names
from learn.comparison.table import Comparison
from learn.comparison.task import Method
from learn.splits import SplitKind
from scenes.errors import ParameterError, require_positive
from simulate.dataset import Dataset

Models = Sequence[str] | Mapping[str, str | Method | Callable[[], Method]]
"""Methods by their names, or what is fitted under a name: see ``compare``."""


def compare(
    dataset: Dataset | Path | str,
    models: Models | None = None,
    split: SplitKind = "files",
    budget: float = 5.0,
    seeds: int = 1,
    output: Path | str | None = None,
) -> Comparison:
    """Fit and score methods on one split, and measure the array's ceiling. Draws nothing.

    Called again with the same ``output`` it measures only what is missing there, and returns all that is there.

    Args:
        dataset: a dataset, or its folder.
        models: names of methods (``learn.comparison.methods.method_names`` lists them) or of classes
            ("module:Class"); or a dictionary from the names that the table shows to such a name, to a class with
            ``fit`` and ``predict``, to a function that makes such an object, or to such an object, which is copied for
            each seed. None: every method.
        split: how the test part is chosen; "random" draws the same test part for every method.
        budget: minutes of training, for each method that learns.
        seeds: how often each method is fitted.
        output: folder for results.jsonl, per_sample/ and runs/; None: a new temporary folder, which ``folder`` of the
            result names and which is not deleted.

    Returns:
        Everything measured in the folder.

    Raises:
        InputError: the dataset cannot be read, or the folder holds an experiment with other settings, or something
            else.
        ParameterError: a method is unknown, or ``budget`` or ``seeds`` is not positive.

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
    require_positive(budget=budget, seeds=seeds)
    models = method_names() if models is None else models
    methods = makers(models)
    if not isinstance(models, Mapping):
        methods = {f"{name} (reduced)" if is_reduced(name) else name: make for name, make in methods.items()}
    experiment = begin(dataset, split, output, minutes=budget)
    experiment.measure(methods, seeds)
    experiment.measure_ceiling()
    return Comparison.of(experiment)


def makers(models: Models) -> dict[str, Callable[[], Method]]:
    """What makes a new, unfitted method, by the name that a table shows.

    Raises:
        ParameterError: a method is unknown, or has no ``fit``.

    >>> list(makers(["nearest", "kriging"]))
    ['nearest', 'kriging']
    """
    if not isinstance(models, Mapping):
        return {name: method_named(name) for name in models}
    return {name: _maker(name, given) for name, given in models.items()}


def _maker(name: str, given: Any) -> Callable[[], Method]:
    if isinstance(given, str):
        return method_named(given)
    if not isinstance(given, type) and hasattr(given, "fit"):
        return partial(copy.deepcopy, given)
    if not callable(given):
        raise ParameterError("models", f"expected a method with fit and predict for {name}, found {given!r}")
    return given
