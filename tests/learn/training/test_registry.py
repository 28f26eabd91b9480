"""A new model is one file and one line: the command line, ``compare`` and ``load_run`` find it in the table."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from learn.models.capabilities import (
    FitsInClosedForm,
    HasOwnLoss,
    HasPrimitives,
    LearnsBand,
    NeedsSomeDatasets,
    PredictsResponses,
    SamplesOneField,
    StatesVariance,
    TracesRays,
)
from learn.training.registry import DEFAULT_MODEL, MODELS, ModelEntry, check_options, model_class, model_entry
from scenes.files.errors import ParameterError
from simulate.spectra.beamformer import Beamformer
from tests.docs.pages import saved

ROOT = Path(__file__).parents[3]

NEW_MODEL = saved("docs/how-to/add-my-own-model.md", "level.py")
"""The one file: the example of docs/how-to/add-my-own-model.md, a model that predicts one learned level everywhere."""

NEW_LINE = (
    'MODELS["level"] = ModelEntry(builds="level_model:Level", summary="one level everywhere", options={"start": 0.5})'
)

PROGRAM = f"""
from learn.training.registry import MODELS, ModelEntry
{NEW_LINE}
from bisplat.__main__ import main
main()
"""

CAPABILITIES = (
    FitsInClosedForm,
    HasOwnLoss,
    HasPrimitives,
    LearnsBand,
    NeedsSomeDatasets,
    PredictsResponses,
    SamplesOneField,
    StatesVariance,
    TracesRays,
)

CAN_DO = {
    "helmholtz": {FitsInClosedForm, StatesVariance},
    "twin": {FitsInClosedForm, StatesVariance, PredictsResponses, TracesRays},
    "mirror-images": {FitsInClosedForm, StatesVariance, PredictsResponses, NeedsSomeDatasets},
    "bisplat": {HasPrimitives},
    "bisplat-plus": {HasPrimitives},
    "bisplat-aperture": {HasPrimitives, LearnsBand, PredictsResponses, SamplesOneField},
    "mlp": set(),
    "mlp-responses": {LearnsBand, PredictsResponses, SamplesOneField},
    "nerf2": {HasOwnLoss},
    "swiftwrf": set(),
    "wrf-gs-plus": {HasOwnLoss},
    "gsrf": {HasOwnLoss},
}
"""Capabilities of the models of the table."""


@pytest.fixture
def bisplat_with_level(tmp_path):
    """Function: runs ``bisplat`` with the new model in a process of its own -> what it printed on stdout."""
    (tmp_path / "level_model.py").write_text(NEW_MODEL)
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)]), "OMP_NUM_THREADS": "1"}

    def run(*arguments) -> str:
        command = [sys.executable, "-c", PROGRAM, *map(str, arguments)]
        done = subprocess.run(command, capture_output=True, text=True, env=environment, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run


@pytest.mark.slow
def test_a_new_model_is_one_file_and_one_line(bisplat_with_level, tiny, tmp_path, monkeypatch):
    assert "level" in bisplat_with_level("train", "--help")
    bisplat_with_level("train", tiny, "-o", tmp_path / "run", "--model", "level", "--steps", 2)
    table = bisplat_with_level(
        "compare", tiny, "-o", tmp_path / "table", "--models", "level", "nearest", "--budget", 0.001, "--json"
    )
    assert "level" in table and "ssim_median" in table

    from learn.training.run_folder import load_run

    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setitem(MODELS, "level", ModelEntry(builds="level_model:Level", summary=""))
    run = load_run(tmp_path / "run")
    assert run.config.model == "level" and abs(run.model.level.item() - 0.5) < 0.1
    assert run.predict(np.zeros((3, 3))).spectra.shape == (3, 90, 360)


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
    with pytest.raises(ParameterError, match="octaves: expected an option of the model mlp, which has encoding"):
        check_options("mlp", {"octaves": 3})
    check_options("bisplat-aperture", {"primitives": 3, "encoding": "octaves"})
    with pytest.raises(ParameterError, match="size: expected an option of the model bisplat-aperture"):
        check_options("bisplat-aperture", {"size": 3})
