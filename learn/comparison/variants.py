"""The variants of an ablation: a model, and the same with one part at a time switched off."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from learn.methods.trained_model import TrainedModel
from learn.models.model_settings import OPTION_MOST
from learn.training.registry import check_options
from scenes.files.errors import ParameterError, require_whole, shown

APERTURE: dict[str, dict[str, Any]] = {
    "with TX-PE": {"encoding": "octaves"},
    "without depth order": {"ordered": False},
    "50 primitives": {"primitives": 50},
    "800 primitives": {"primitives": 800},
    "width 64": {"width": 64},
}
"""Rows of the ablation table of bisplat-aperture: label, and options of the model."""


def _variants(model: str, primitives: int | None) -> Iterator[tuple[str, TrainedModel]]:
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


def variants(models: Sequence[str], primitives: int | None = None) -> dict[str, TrainedModel]:
    """The whole of each model and what lacks one part, by the label of a row.

    The rows of ``bisplat`` are those of the paper's ablation [zhang2026]: the whole model, and the model without its
    dynamic network, its delta decoder and its BST. The rows of ``bisplat-aperture`` change its encoding, the order of
    blending, the number of primitives and the width.

    Args:
        models: the models whose parts are switched off.
        primitives: number of primitives in every row. None: the models' own numbers, which train slowly without a GPU.

    Returns:
        Methods for ``compare``, which needs the same number of ``steps`` for all.

    Raises:
        ParameterError: ``primitives`` is out of its range, or a model has no parts that can be switched off.

    Example:
        >>> import bisplat
        >>> list(bisplat.variants(["bisplat"], primitives=20))[-1]
        'bisplat (20 primitives) without BST'
    """
    if primitives is not None:
        require_whole(1, OPTION_MOST, primitives=primitives)
    if isinstance(models, str) or not isinstance(models, Iterable) or not (models := list(models)):
        raise ParameterError("models", f"expected a list of names of models, found {shown(models)}")
    found = {}
    for model in models:
        for label, method in _variants(model, primitives):
            _check_parts(model, method)
            found[label] = method
    return found


def _check_parts(model: str, method: TrainedModel) -> None:
    """Refuse a model that lacks the options of a row, before any row is trained."""
    try:
        check_options(method.model, method.options)
    except ParameterError as error:
        raise ParameterError(
            "models", f"expected models whose parts can be switched off, found {model} ({error.message})"
        ) from error
