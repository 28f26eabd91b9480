"""Ablation: scores of a model with one part at a time switched off, over several seeds."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from learn.comparison.compare import spectrum_factories
from learn.comparison.experiment import begun
from learn.comparison.method_factories import SEEDS_MOST
from learn.comparison.spectrum_methods import TrainedModel
from learn.comparison.table import Comparison
from learn.data.splits import SplitKind
from learn.models.model_settings import OPTION_MOST, STEPS_MOST
from learn.training.registry import check_options
from scenes.files.errors import ParameterError, require_whole, shown
from simulate.dataset.dataset import Dataset

APERTURE: dict[str, dict[str, Any]] = {
    "with TX-PE": {"encoding": "octaves"},
    "without depth order": {"ordered": False},
    "50 primitives": {"primitives": 50},
    "800 primitives": {"primitives": 800},
    "width 64": {"width": 64},
}
"""Rows of the ablation table of bisplat-aperture: label, and options of the model."""


def variants(model: str, primitives: int | None = None) -> Iterator[tuple[str, TrainedModel]]:
    """Yield the rows of a model's ablation table."""
    label = model if primitives is None else f"{model} ({primitives} primitives)"
    size = {} if primitives is None else {"primitives": primitives}
    yield label, TrainedModel(model, size)
    if model == "bisplat-aperture":
        for name, options in APERTURE.items():
            if primitives is None or "primitives" not in options:
                yield f"{label} {name}", TrainedModel(model, {**size, **options})
        return
    for part, branch in (("dynamic network", "dynamic"), ("delta decoder", "delta"), ("BST", "bst")):
        yield f"{label} without {part}", TrainedModel(model, {**size, "bypass": [branch]})


def ablate(
    dataset: Dataset | Path | str,
    models: Sequence[str] = ("bisplat", "bisplat-aperture"),
    split: SplitKind = "files",
    steps: int = 1000,
    seeds: int = 3,
    test_spectra: int | None = None,
    primitives: int | None = None,
    output: Path | str | None = None,
    guard: float = 0.0,
) -> Comparison:
    """Train models with one part at a time switched off, and score them.

    The rows of ``bisplat`` are those of the paper's ablation [zhang2026]: the whole model, and the model without its
    dynamic network, its delta decoder and its BST. The rows of ``bisplat-aperture`` change its encoding, the order of
    blending, the number of primitives and the width. The function makes no figures; ``bisplat ablate`` does.

    A second call with the same ``output`` measures only the rows that are missing there, and returns all rows.

    Args:
        dataset: a dataset, or its folder.
        models: the models whose parts are switched off.
        split: how the test part is chosen: "files" (the folder's index files), "random" (a random fifth), "blocked"
            (every fourth block of ten consecutive spectra) or "area" (connected areas with a fifth).
        steps: number of training steps, the same for every row and seed, so that rows differ only in the part.
        seeds: number of trainings of each row, with seeds 0, 1, …
        test_spectra: largest number of test spectra to score, evenly spread over the test part. None: all of them.
        primitives: number of primitives in every row. None: the models' own numbers, which train slowly without a GPU.
        output: folder for results.jsonl, per_sample/ and runs/. None: a new temporary folder, which is not deleted; its
            path is ``Comparison.folder``.
        guard: known positions nearer than this to a test position are left out, wavelengths.

    Returns:
        All rows measured in the folder; their labels say what is switched off.

    Raises:
        InputError: the dataset cannot be read; or ``output`` holds an experiment with other settings or other files, or
            another process writes to it.
        ParameterError: ``steps``, ``seeds``, ``test_spectra`` or ``primitives`` is out of its range, or a model has no
            parts that can be switched off.

    Example:
        >>> comparison = ablate("data/lab", models=("bisplat",), steps=2, seeds=1, primitives=20)
        >>> [row["label"] for row in comparison][-1]
        'bisplat (20 primitives) without BST'
    """
    require_whole(1, STEPS_MOST, steps=steps)
    require_whole(1, SEEDS_MOST, seeds=seeds)
    if primitives is not None:
        require_whole(1, OPTION_MOST, primitives=primitives)
    if isinstance(models, str) or not isinstance(models, Iterable):
        raise ParameterError("models", f"expected a list of names of models, found {shown(models)}")
    for model in models:
        for _, method in variants(model, primitives):
            _check_parts(model, method)
    methods = spectrum_factories({label: method for model in models for label, method in variants(model, primitives)})
    with begun(dataset, split, output, steps=steps, test_spectra=test_spectra, guard=guard) as experiment:
        experiment.measure(methods, seeds)
        return Comparison.of(experiment)


def _check_parts(model: str, method: TrainedModel) -> None:
    """Refuse a model that lacks the options of a row, before any row is trained."""
    try:
        check_options(method.model, method.options)
    except ParameterError as error:
        raise ParameterError(
            "models", f"expected models whose parts can be switched off, found {model} ({error.message})"
        ) from error
