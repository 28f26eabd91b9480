"""Accuracy against the number of training spectra, with the same test part for all."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from learn.comparison.compare import Models, check_effort, makers
from learn.comparison.experiment import begun
from learn.comparison.table import Comparison
from learn.comparison.trained_model import TrainedModel
from learn.data.splits import SplitKind
from learn.training.registry import DEFAULT_MODEL
from learn.training.run_folder import Run, load_run
from scenes.files.errors import ParameterError, require_whole, shown
from simulate.dataset.dataset_folder import Dataset
from simulate.positions.given_positions import MOST_POSITIONS


def sweep(
    dataset: Dataset | Path | str,
    sizes: Sequence[int],
    models: Models = (DEFAULT_MODEL, "bisplat-aperture", "bisplat", "inverse-distance"),
    split: SplitKind = "files",
    budget: float = 5.0,
    seeds: int = 1,
    test_spectra: int | None = None,
    init: Run | Path | str | None = None,
    output: Path | str | None = None,
) -> Comparison:
    """Fit and score methods on training parts of several sizes. Makes no figures.

    Args:
        dataset: a dataset, or its folder; as for ``compare``.
        sizes: numbers of training spectra; each smaller training part is contained in every larger one.
        models: as for ``compare``.
        split: how the test part is chosen.
        budget: training time of each model that is trained by steps, minutes.
        seeds: number of fits of each method, with seeds 0, 1, …
        test_spectra: largest number of test spectra that are scored, evenly spread over the test part; None: all of it.
        init: a finished run, or its folder. Its model is also trained starting from its weights, in rows labelled
            "MODEL from FOLDER".
        output: as for ``compare``.

    Returns:
        All rows measured in the folder; "train_size" of a row is the number of training spectra.

    Raises:
        InputError: as for ``compare``, or the run cannot be read, or a size is larger than the training part.
        ParameterError: a method is unknown, or a size, ``budget``, ``seeds`` or ``test_spectra`` is not positive.

    >>> comparison = sweep("data/lab", sizes=(5, 10), models=("nearest",))
    >>> [(row["label"], row["train"]) for row in comparison]
    [('nearest', 5), ('nearest', 10)]
    """
    check_effort(budget, seeds)
    if not sizes or len(set(sizes)) < len(sizes):
        raise ParameterError("sizes", f"expected different numbers of training spectra, found {shown(list(sizes))}")
    for size in sizes:
        require_whole(1, MOST_POSITIONS, sizes=size)
    methods = makers(models)
    if init is not None:
        run = init if isinstance(init, Run) else load_run(Path(init))
        model, folder = run.config.model, run.folder
        methods[f"{model} from {folder.name}"] = partial(TrainedModel, model, init=str(folder.resolve()))
    with begun(dataset, split, output, minutes=budget, test_spectra=test_spectra) as experiment:
        experiment.measure(methods, seeds, sorted(sizes))
        return Comparison.of(experiment)
