"""Comparison of methods for spectra on one split, with the whole training part or several sizes of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

from learn.comparison.experiment import begun
from learn.comparison.known_spectra import Method
from learn.comparison.method_factories import check_effort, checked_sizes, method_factories
from learn.comparison.spectrum_methods import TrainedModel, is_reduced, method_named, method_names
from learn.comparison.table import Comparison
from learn.data.splits import SplitKind
from learn.training.config import require_untested
from learn.training.registry import DEFAULT_MODEL
from learn.training.run_folder import Run, load_run
from scenes.files.errors import ParameterError
from simulate.dataset.dataset import Dataset

Models = Sequence[str] | Mapping[str, str | Method | Callable[[], Method]]
"""Names of methods, or a dictionary from labels to methods; ``compare`` describes both."""


def compare(
    dataset: Dataset | Path | str,
    models: Models | None = None,
    split: SplitKind = "files",
    budget: float = 5.0,
    seeds: int = 1,
    test_spectra: int | None = None,
    output: Path | str | None = None,
    guard: float = 0.0,
    steps: int | None = None,
) -> Comparison:
    """Fit and score methods on one split, and measure the array's ceiling.

    Every method learns from the same known spectra and is scored on the same test spectra by the same code. The array's
    ceiling is an upper bound and not a method: it scores the element responses that fit each of at most 50 test spectra
    best. The function makes no figures; ``bisplat compare`` does.

    A second call with the same ``output`` measures only the rows that are missing there, and returns all rows.

    A method is an object with two methods. ``fit(known)`` learns from ``known.positions`` [n, 3] (metres) and
    ``known.spectra`` [n, 90, 360] (0…1). ``predict(positions)`` takes positions [K, 3] and returns spectra
    [K, 90, 360].

    Args:
        dataset: a dataset, or its folder.
        models: names of baselines ("mean-picture", "nearest", "inverse-distance", "kriging", "kriging-responses"), of
            models (as for ``train``) or of your own classes ("module:Class"), or "LABEL=FOLDER" of a folder with the
            predictions of another program: spectrum/NAME.png of each test spectrum, or spectra.npy [K, 90, 360] with
            all of them in the order of ``split(...).test``. Or a dictionary from the label of a row
            to one of these: a name, a class with ``fit`` and ``predict``, a function that returns an object with both,
            or such an object, which is copied for each seed. None: every baseline and every model that needs no
            options.
        split: how the test part is chosen: "files" (the folder's index files), "random" (a random fifth), "blocked"
            (every fourth block of ten consecutive spectra) or "area" (connected areas with a fifth).
        budget: training time of each model that is trained by steps, minutes.
        seeds: number of fits of each method, with seeds 0, 1, …
        test_spectra: largest number of test spectra to score, evenly spread over the test part. None: all of them.
        output: folder for results.jsonl, per_sample/ and runs/. None: a new temporary folder, which is not deleted; its
            path is ``Comparison.folder``.
        guard: known positions nearer than this to a test position are left out, wavelengths.
        steps: number of training steps of each model that is trained by steps, instead of the budget. The same on
            every machine.

    Returns:
        All rows measured in the folder.

    Raises:
        InputError: the dataset cannot be read; or ``output`` holds an experiment with other settings or other files, or
            another process writes to it.
        ParameterError: a method is unknown or lacks ``fit``, or ``budget``, ``steps``, ``seeds`` or ``test_spectra`` is
            out of its range.

    Example:
        >>> import numpy as np
        >>> class Grey:
        ...     def fit(self, known):
        ...         self.mean = known.spectra.mean()
        ...
        ...     def predict(self, positions):
        ...         return np.full((len(positions), 90, 360), self.mean)
        >>> comparison = compare("data/lab", {"nearest": "nearest", "grey": Grey})
        >>> [row["label"] for row in comparison]
        ['nearest', 'grey', "array's ceiling"]

        The rows make a table for pandas:

        >>> import pandas
        >>> "ssim_median" in pandas.DataFrame(comparison)
        True
    """
    check_effort(budget, seeds, steps)
    methods = spectrum_factories(method_names() if models is None else models)
    minutes = budget if steps is None else None
    with begun(
        dataset, split, output, minutes=minutes, steps=steps, test_spectra=test_spectra, guard=guard
    ) as experiment:
        experiment.measure(methods, seeds)
        experiment.measure_ceiling()
        return Comparison.of(experiment)


def spectrum_factories(models: Models) -> dict[str, Callable[[], Method]]:
    """Functions that make new, unfitted methods, by the label of their rows."""
    return method_factories(models, method_named, "models", is_reduced)


SWEPT = (DEFAULT_MODEL, "bisplat-aperture", "bisplat", "inverse-distance")
"""Methods that are compared if none are named."""


def sweep(
    dataset: Dataset | Path | str,
    sizes: Sequence[int],
    models: Models = SWEPT,
    split: SplitKind = "files",
    budget: float = 5.0,
    seeds: int = 1,
    test_spectra: int | None = None,
    init: Run | Path | str | None = None,
    output: Path | str | None = None,
    guard: float = 0.0,
    steps: int | None = None,
) -> Comparison:
    """Fit and score methods on training parts of several sizes.

    The result shows how accuracy grows with the number of training spectra. The test part is the same for all sizes.
    The function makes no figures; ``bisplat sweep`` does.

    A second call with the same ``output`` measures only the rows that are missing there, and returns all rows.

    Args:
        dataset: a dataset, or its folder.
        sizes: numbers of training spectra. Each smaller training part is contained in every larger one.
        models: names of methods, or a dictionary from labels to methods, as for ``bisplat.compare``.
        split: how the test part is chosen: "files" (the folder's index files), "random" (a random fifth), "blocked"
            (every fourth block of ten consecutive spectra) or "area" (connected areas with a fifth).
        budget: training time of each model that is trained by steps, minutes.
        seeds: number of fits of each method and size, with seeds 0, 1, …
        test_spectra: largest number of test spectra to score, evenly spread over the test part. None: all of them.
        init: a finished run, or its folder. Its model is then also trained starting from its weights, in rows labelled
            "MODEL from FOLDER", with the run's options.
        output: folder for results.jsonl, per_sample/ and runs/. None: a new temporary folder, which is not deleted; its
            path is ``Comparison.folder``.
        guard: known positions nearer than this to a test position are left out, wavelengths.
        steps: number of training steps of each model that is trained by steps, instead of the budget. The same on
            every machine.

    Returns:
        All rows measured in the folder. The entry "train_size" of a row is its number of training spectra.

    Raises:
        InputError: the dataset or the run cannot be read; the run has learned spectra of the test part; a size is
            larger than the training part; or ``output`` holds an experiment with other settings or other files, or
            another process writes to it.
        ParameterError: a method is unknown; ``sizes`` is empty or has a number twice; a size, ``budget``, ``steps``,
            ``seeds`` or ``test_spectra`` is out of its range; or the run of ``init`` was not trained by steps.

    Example:
        >>> comparison = sweep("data/lab", sizes=(5, 10), models=("nearest",))
        >>> [(row["label"], row["train_size"]) for row in comparison]
        [('nearest', 5), ('nearest', 10)]
    """
    check_effort(budget, seeds, steps)
    rising = checked_sizes("spectra", sizes=sizes)
    methods = spectrum_factories(models)
    run = init if init is None or isinstance(init, Run) else load_run(init)
    if run is not None:
        model = run.config.model
        if run.config.by_steps is None:
            raise ParameterError("init", f"expected a run of a model that is trained by steps, found one of {model}")
        methods[f"{model} from {run.name}"] = partial(
            TrainedModel, model, run.config.options, init=str(run.folder.resolve())
        )
    minutes = budget if steps is None else None
    with begun(
        dataset, split, output, minutes=minutes, steps=steps, test_spectra=test_spectra, guard=guard
    ) as experiment:
        if run is not None and run.is_trained_on(experiment.dataset):
            known = run.split(experiment.dataset).known
            require_untested(known, run.folder, experiment.dataset, experiment.parts)
        experiment.measure(methods, seeds, rising)
        return Comparison.of(experiment)
