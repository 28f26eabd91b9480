"""Every model by its name: the class that builds it, how it is fitted, and the settings that are its own.

This table needs no torch: the command line, ``compare``, ``load_run`` and the docs take their model names from it. A
new model is one file with a ``SpectrumModel`` and one line here.
"""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Any, Literal

from scenes.errors import ParameterError, did_you_mean

if TYPE_CHECKING:  # torch is imported when a model is built
    from learn.models.base import SpectrumModel


@dataclass(frozen=True, kw_only=True)
class ModelEntry:
    """One model of the table.

    Attributes:
        builds: the class, as ``module:Class``; it is called with (region, array, **options).
        summary: what the model does, for help texts and docs.
        fit: ``steps``: trained by gradient steps on batches of spectra; ``closed form``: by its own ``fit``.
        learning_rate: of AdamW, for a model trained by steps.
        options: arguments of the class that differ from the class's own defaults.
        options_without_gpu: further arguments where there is no GPU, in tables whose budget a CPU could not keep
            otherwise; such rows are marked "(reduced)".
    """

    builds: str
    summary: str
    fit: Literal["steps", "closed form"] = "steps"
    learning_rate: float = 1e-3
    options: Mapping[str, Any] = field(default_factory=dict)
    options_without_gpu: Mapping[str, Any] = field(default_factory=dict)


MODELS: dict[str, ModelEntry] = {
    "helmholtz": ModelEntry(
        builds="learn.models.helmholtz:HelmholtzField",
        summary="kriging of element responses (of spectra, where there are none) under the Helmholtz equation",
        fit="closed form",
    ),
    "bisplat": ModelEntry(
        builds="learn.models.bisplat:BiSplatWRF",
        summary="BiSplat-WRF of the paper: 500 planar Gaussians and a bilinear spatial transformer",
        learning_rate=2e-3,
    ),
    "bisplat-plus": ModelEntry(
        builds="learn.models.bisplat:BiSplatWRF",
        summary="BiSplat-WRF+ of the paper: 2,000 planar Gaussians and deeper networks",
        learning_rate=3e-4,  # its deep networks collapse at the small model's rate
        options={
            "primitives": 2000,
            "ffn_width": 256,
            "ffn_layers": 12,
            "transformer_layers": 6,
            "transformer_ffn_width": 512,
        },
    ),
    "bisplat-aperture": ModelEntry(
        builds="learn.models.bisplat:BiSplatAperture",
        summary="BiSplat-WRF whose field is received by the array, so that it predicts element responses",
        learning_rate=2e-3,
        options={"tx_order": 3},  # shorter waves in TX-PE learn the training positions by heart
    ),
    "mlp": ModelEntry(builds="learn.models.mlp:SpectrumMLP", summary="a network from position to pixels"),
    "mlp-responses": ModelEntry(
        builds="learn.models.mlp:ResponseMLP", summary="a network from position to element responses"
    ),
    "nerf2": ModelEntry(
        builds="learn.models.nerf2:NeRF2",
        summary="NeRF²: rays marched through a neural radiance field",
        learning_rate=8e-4,
        options_without_gpu={"samples": 16, "rays": 1024, "width": 128},
    ),
    "swiftwrf": ModelEntry(
        builds="learn.models.swiftwrf:SwiftWRF",
        summary="the idea of SwiftWRF: planar Gaussians that a network deforms, added up without depth",
    ),
}

DEFAULT_MODEL = "helmholtz"

if TYPE_CHECKING:
    ModelName = str
else:
    ModelName = Literal[tuple(MODELS)]  # the choices of the command line


def model_entry(name: str) -> ModelEntry:
    """The entry of a model.

    Raises:
        ParameterError: no model has this name.

    >>> model_entry("helmholtz").fit
    'closed form'
    """
    if name not in MODELS:
        raise ParameterError("model", f'expected the name of a model, found "{name}"; {did_you_mean(name, MODELS)}')
    return MODELS[name]


def model_class(name: str) -> type[SpectrumModel]:
    """The class of a model.

    Raises:
        ParameterError: no model has this name.
    """
    module, _, attribute = model_entry(name).builds.partition(":")
    return getattr(import_module(module), attribute)


def check_options(name: str, options: Mapping[str, Any]) -> None:
    """Make sure that a model's class takes these options.

    Raises:
        ParameterError: no model has this name, or the model has no such option.
    """
    known: list[str] = []
    for each in model_class(name).__mro__[:-1]:
        if "__init__" not in vars(each):
            continue
        parameters = inspect.signature(vars(each)["__init__"]).parameters.values()
        known += [parameter.name for parameter in parameters if parameter.kind is not inspect.Parameter.VAR_KEYWORD]
        if all(parameter.kind is not inspect.Parameter.VAR_KEYWORD for parameter in parameters):
            break  # no further options are handed on to a base class
    known = [option for option in known if option not in ("self", "region", "array")]
    for option in options:
        if option not in known:
            has = f"which has {', '.join(known)}" if known else "which has none"
            raise ParameterError(option, f"expected an option of the model {name}, {has}; found {option}")
