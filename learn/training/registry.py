"""The table of models: the class of each model, how it is fitted, and its own defaults.

The command line, ``compare`` and ``load_run`` take the names of models from this table, which does not import torch. A
new model is a file with a subclass of ``SpectrumModel``. Users can name it as ``module:Class``; an entry in this table
gives it a short name and defaults.
"""

from __future__ import annotations

import os
import sys
import sysconfig
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from traceback import FrameSummary, extract_tb
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from learn.models.model_settings import Steps, check_options_of
from scenes.files.errors import InputError, ParameterError, cut, did_you_mean, reason, shown
from scenes.files.optional_packages import require_extra

if TYPE_CHECKING:  # torch is imported when a model is built
    from learn.models.base import SpectrumModel


OURS = ("scenes", "simulate", "learn", "bisplat")  # Our packages


def own_class(name: str, parameter: str) -> Any:
    """Import a class. Its module is searched for on Python's path and then in the current folder."""
    module, _, attribute = name.partition(":")
    here = os.getcwd()
    sys.path.append(here)
    try:
        return getattr(import_module(module), attribute)
    except (Exception, SystemExit) as error:  # the user's module can raise anything while it is imported
        found = what_happened(error)
        if isinstance(error, ModuleNotFoundError) and error.name == module:
            found = f"no module {module} in this folder or on Python's path (PYTHONPATH)"
        raise ParameterError(parameter, f"expected a class at {cut(name)}, found {found}") from error
    finally:
        if here in sys.path:
            del sys.path[len(sys.path) - 1 - sys.path[::-1].index(here)]


def what_happened(error: BaseException) -> str:
    """An error of the user's code in words, with the line of the user's code at which it happened."""
    frames = [each for each in extract_tb(error.__traceback__) if _is_users(each)]
    place = f" ({frames[-1].filename}, line {frames[-1].lineno})" if frames else ""
    return f"{type(error).__name__}: {reason(error)}{place}"


@contextmanager
def in_one_sentence(label: str, expected: str) -> Iterator[None]:
    """Turn errors of the user's code into a sentence that names it. What a file or a disk has done passes."""
    try:
        yield
    except (Exception, SystemExit) as error:
        if isinstance(error, OSError) or (isinstance(error, InputError) and label in str(error)):
            raise
        raise InputError(f"{label}: expected {expected}, found {what_happened(error)}") from error


def is_own(kind: type) -> bool:
    """Whether the user wrote a class."""
    return kind.__module__.split(".")[0] not in OURS


def is_of_own_code(error: BaseException | None) -> bool:
    """Whether an error passed through code of the user's, so that its traceback tells more than the sentence."""
    return error is not None and any(map(_is_users, extract_tb(error.__traceback__)))


_ROOT = Path(__file__).resolve().parents[2]
_LIBRARIES = (*(str(_ROOT / name) + os.sep for name in OURS), sysconfig.get_path("stdlib") + os.sep, "<")


def _is_users(frame: FrameSummary) -> bool:
    """Whether a frame is neither of our packages, nor of Python, nor of an installed library."""
    return not frame.filename.startswith(_LIBRARIES) and "site-packages" not in Path(frame.filename).parts


@dataclass(frozen=True, kw_only=True)
class ModelEntry:
    """One model of the table."""

    builds: str  # the class, as ``module:Class``. It is called with ``(region, beamformer, wavelength, **options)``
    summary: str  # what the model does, for a reader
    # its settings of training by gradient steps. None: its method ``fit`` fits it in closed form
    by_steps: Steps | None = field(default_factory=Steps)
    # arguments of the class that differ from the class's own defaults
    options: Mapping[str, Any] = field(default_factory=dict)
    # further arguments for ``compare`` without a GPU, for a model that would be too slow on a CPU. Its rows are marked
    # "(reduced)"
    options_without_gpu: Mapping[str, Any] = field(default_factory=dict)
    # options without which it cannot be built. ``compare`` leaves it out if no models are named
    needs: tuple[str, ...] = ()
    extra: str | None = None  # the extra of bisplat-wrf that it needs


BY_RESPONSES = Steps(steps=3000, batch_size=128, weight_decay=1.0, full_resolution=0.0)
"""Settings of models that predict element responses, whose steps are fast. Weight decay limits their overfitting."""

MODELS: dict[str, ModelEntry] = {
    "helmholtz": ModelEntry(
        builds="learn.models.kriging.helmholtz:HelmholtzField",
        summary="kriging of element responses and spectra under the Helmholtz equation, mixed with inverse distance",
        by_steps=None,
    ),
    "twin": ModelEntry(
        builds="learn.twin.twin_model:Twin",
        summary="ray tracing of a scene that the known spectra correct, and kriging of responses for the rest",
        by_steps=None,
        needs=("scene",),
        extra="rays",
    ),
    "mirror-images": ModelEntry(
        builds="learn.models.images.image_field:ImageField",
        summary="waves of the gateway's mirror images in the walls, and kriging of responses for the rest",
        by_steps=None,
    ),
    "bisplat": ModelEntry(
        builds="learn.models.networks.bisplat:BiSplatWRF",
        summary="BiSplat-WRF of the paper: 500 planar Gaussians and a bilinear spatial transformer",
        by_steps=Steps(steps=6000, learning_rate=2e-3, full_resolution=0.02),
    ),
    "bisplat-plus": ModelEntry(
        builds="learn.models.networks.bisplat:BiSplatWRF",
        summary="BiSplat-WRF+ of the paper: 2,000 planar Gaussians and deeper networks",
        by_steps=Steps(learning_rate=3e-4),  # its deep networks collapse at the rate of the smaller model
        options={
            "primitives": 2000,
            "ffn_width": 256,
            "ffn_layers": 12,
            "transformer_layers": 6,
            "transformer_ffn_width": 512,
        },
    ),
    "bisplat-aperture": ModelEntry(
        builds="learn.models.networks.aperture:BiSplatAperture",
        summary="planar Gaussians whose field is received by the array, with plane waves of the transmitter's position",
        by_steps=BY_RESPONSES,
    ),
    "mlp": ModelEntry(
        builds="learn.models.networks.mlp:SpectrumMLP",
        summary="a network from position to pixels, few enough that the spectrum is interpolated from them",
        by_steps=Steps(steps=3000, batch_size=64, full_resolution=0.0),
    ),
    "mlp-responses": ModelEntry(
        builds="learn.models.networks.mlp:ResponseMLP",
        summary="a network from position, as plane waves, to element responses",
        by_steps=BY_RESPONSES,
    ),
    "nerf2": ModelEntry(
        builds="learn.models.peers.nerf2:NeRF2",
        summary="NeRF²: rays marched through a neural radiance field",
        by_steps=Steps(learning_rate=8e-4, batch_size=64),
        options_without_gpu={"samples": 16, "rays": 4096, "width": 128},
    ),
    "swiftwrf": ModelEntry(
        builds="learn.models.peers.swiftwrf:SwiftWRF",
        summary="SwiftWRF: planar Gaussians that a network deforms by position, summed without depth order",
        by_steps=Steps(steps=6000, full_resolution=1.0),  # its Gaussians are smaller than a few pixels are apart
        options_without_gpu={"primitives": 1000},
    ),
    "wrf-gs-plus": ModelEntry(
        builds="learn.models.peers.wrf_gs_plus:WRFGSPlus",
        summary="WRF-GS+: Gaussians in space, blended by depth, whose signals and shapes a network deforms by position",
        by_steps=Steps(steps=30_000, batch_size=1, learning_rate=8e-4),  # the published batch and rate
        options_without_gpu={"primitives": 1000, "width": 128},
    ),
    "gsrf": ModelEntry(
        builds="learn.models.peers.gsrf:GSRF",
        summary="GSRF: Gaussians in space with complex signals, drawn on a sphere around the transmitter",
        by_steps=Steps(steps=30_000, batch_size=1, learning_rate=2.7e-3),  # the published steps, batch and rate
        options_without_gpu={"primitives": 500},
    ),
}

DEFAULT_MODEL = "helmholtz"  # The model that ``train`` uses if none is named


def model_entry(name: str) -> ModelEntry:
    """The entry of a model."""
    if isinstance(name, str) and name in MODELS:
        return MODELS[name]
    if not isinstance(name, str) or not name.partition(":")[2]:
        raise ParameterError(
            "model",
            f"expected the name of a model, or your own class as module:Class, found {shown(name)}; "
            f"{did_you_mean(name, MODELS)}",
        )
    from learn.models.base import SpectrumModel
    from learn.models.capabilities import FitsInClosedForm

    own = own_class(name, "model")
    if not (isinstance(own, type) and issubclass(own, SpectrumModel)):
        raise ParameterError(
            "model", f"expected a subclass of bisplat.SpectrumModel at {cut(name)}, found {shown(own)}"
        )
    by_steps = None if issubclass(own, FitsInClosedForm) else Steps()
    return ModelEntry(builds=name, summary=f"the user's own model {name}", by_steps=by_steps)


def model_class(name: str) -> type[SpectrumModel]:
    """The class of a model."""
    entry = model_entry(name)
    if entry.extra is not None:
        require_extra(entry.extra, f"the model {name}")
    module, _, attribute = entry.builds.partition(":")
    return getattr(import_module(module), attribute)


def check_options(name: str, options: Mapping[str, Any]) -> None:
    """Check that a model's class takes these options."""
    check_options_of(model_class(name), name, options)


class Preset(NamedTuple):
    """A model of the table of models, and how long it is trained."""

    model: str  # its name in the table
    steps: int  # number of steps after which its validation SSIM hardly rises (documentation, Reproduce the paper)


PresetName = Literal["paper", "paper-plus"]

PRESETS: dict[str, Preset] = {"paper": Preset("bisplat", 8000), "paper-plus": Preset("bisplat-plus", 8000)}
"""The presets of ``train`` by name."""


def in_words(preset: PresetName, steps: int, given: Mapping[str, Any], minutes: float) -> str:
    """What a preset trains, what the user changed, how long it takes, and where the docs say how good it is."""
    changed = ", ".join(f"{name}={shown(value)}" for name, value in given.items() if name != "steps")
    model = PRESETS[preset].model + (f" with {changed}" if changed else "")
    time = f"about {minutes:.2g} minutes here" if minutes < 100 else f"about {minutes / 60:.2g} hours here"
    return f"preset {preset}: {model}, {steps} steps, {time}; how good that is: documentation, Reproduce the paper"
