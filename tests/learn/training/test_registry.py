"""The table of models: each can be built and does what it says (tests/test_contributing.py adds one)."""

import subprocess
import sys
from pathlib import Path

import pytest

from learn.models.capabilities import FitsInClosedForm, HasOwnLoss, HasPrimitives, PredictsResponses, TracesRays
from learn.training.registry import DEFAULT_MODEL, MODELS, check_options, model_class, model_entry
from scenes.files.errors import ParameterError
from simulate.spectra.beamformer import Beamformer

ROOT = Path(__file__).parents[3]

CAPABILITIES = FitsInClosedForm, HasOwnLoss, HasPrimitives, PredictsResponses, TracesRays

CAN_DO = {
    "helmholtz": {FitsInClosedForm},
    "twin": {FitsInClosedForm, PredictsResponses, TracesRays},
    "mirror-images": {FitsInClosedForm, PredictsResponses},
    "bisplat": {HasPrimitives},
    "bisplat-plus": {HasPrimitives},
    "bisplat-aperture": {HasPrimitives, PredictsResponses},
    "mlp": set(),
    "mlp-responses": {PredictsResponses},
    "nerf2": {HasOwnLoss},
    "swiftwrf": set(),
    "wrf-gs-plus": {HasOwnLoss},
    "gsrf": {HasOwnLoss},
}
"""Capabilities of the models of the table."""


def test_the_table_needs_neither_torch_nor_the_ray_tracer():
    code = "import sys, learn.training.registry; print('\\n'.join(sys.modules))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT).stdout
    assert not {line.split(".")[0] for line in loaded.splitlines()} & {"torch", "drjit", "mitsuba", "sionna"}


@pytest.mark.parametrize("name", MODELS)
def test_every_model_of_the_table_can_be_built(name, region):
    entry = model_entry(name)
    check_options(name, {**entry.options, **entry.options_without_gpu})
    small = {"primitives": 20} if "primitives" in entry.options else dict.fromkeys(entry.needs, "closet")
    model = model_class(name)(region, Beamformer(), 0.33, **{**entry.options, **entry.options_without_gpu, **small})
    assert entry.summary and DEFAULT_MODEL in MODELS
    found = {each for each in CAPABILITIES if isinstance(model, each)}
    assert found == CAN_DO[name] and isinstance(model, FitsInClosedForm) == (entry.by_steps is None)


def test_unknown_models_and_options_are_refused():
    with pytest.raises(
        ParameterError, match=r"model: expected the name of a model, or .* found 'helmholz'; did you mean"
    ):
        model_entry("helmholz")
    with pytest.raises(ParameterError, match="octaves: expected an option of the model mlp, which has none"):
        check_options("mlp", {"octaves": 3})
    check_options("bisplat-aperture", {"primitives": 3, "encoding": "octaves"})
    with pytest.raises(ParameterError, match="size: expected an option of the model bisplat-aperture"):
        check_options("bisplat-aperture", {"size": 3})
