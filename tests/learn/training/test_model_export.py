"""Exported models against the original: same spectra, for any number of positions."""

import dataclasses

import numpy as np
import onnxruntime
import pytest
import torch

from learn.fitted.runs import load_run
from learn.models.kriging.helmholtz import HelmholtzField
from learn.models.kriging.kriged_field import DIRECTIONS, KrigedField
from learn.models.networks.bisplat import BiSplatWRF
from learn.reports.export import export
from learn.training.model_export import INPUT, OUTPUT
from scenes.files import atomic
from scenes.files.errors import InputError
from simulate.spectra.beamformer import Beamformer


@pytest.fixture
def runs(finished_run, small, region, small_models):
    """A run, and another whose primitives are equally far and almost opaque, so that what is in front decides."""
    run = load_run(finished_run)
    torch.manual_seed(0)
    model = BiSplatWRF(region, Beamformer(), 0.33, **small).eval()
    with torch.no_grad():
        model.primitives.depth_raw.fill_(1.0)
        model.primitives.opacity_raw.fill_(6.0)
    field = KrigedField(region, Beamformer(), 0.33, "responses")
    generator = np.random.default_rng(0)
    field.places = torch.from_numpy(generator.uniform(0, 3, (80, 3))).float()
    field.times = torch.arange(80).float()
    field.drift = torch.tensor(40.0)
    field.shares = torch.rand(DIRECTIONS).softmax(dim=0)
    field.values = torch.from_numpy(generator.standard_normal((80, 32))).float()
    field.nugget = torch.tensor(0.01)
    mixed = HelmholtzField(region, Beamformer(), 0.33)
    mixed._set({"responses": 0.75, "inverse-distance": 0.25}, {"responses": field})
    return {
        "bisplat-aperture": run,
        "bisplat": dataclasses.replace(run, model=model),
        "helmholtz": dataclasses.replace(run, model=mixed.eval()),
    }


def test_full_disk_is_an_error_that_names_the_file(runs, tmp_path, monkeypatch):
    """Torch would end the process if it wrote the file itself."""

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(atomic.os, "fsync", full)
    with pytest.raises(OSError) as error:
        export(runs["bisplat-aperture"], tmp_path / "model.pt2")
    assert error.value.filename == str(tmp_path / "model.pt2") and not list(tmp_path.iterdir())


POSITIONS = np.array([[1.0, 0.4, 1.0], [3.2, 0.1, 1.0], [0.1, 0.2, 1.0]])


@pytest.mark.parametrize(
    "model", ["bisplat-aperture", *(pytest.param(name, marks=pytest.mark.slow) for name in ("bisplat", "helmholtz"))]
)
def test_onnx_gives_the_same_spectra(runs, tmp_path, model):
    path = tmp_path / "model.onnx"
    export(runs[model], path)
    session = onnxruntime.InferenceSession(path)
    for some in (POSITIONS, POSITIONS[:1]):
        (found,) = session.run([OUTPUT], {INPUT: some.astype(np.float32)})
        expected = runs[model].predict(some).spectra
        np.testing.assert_allclose(found, expected, atol=1e-4 * expected.max())
    assert [file.name for file in tmp_path.iterdir()] == ["model.onnx"]


def test_exported_program_gives_the_same_spectra(runs, tmp_path):
    path = tmp_path / "model.pt2"
    export(runs["bisplat-aperture"], path)
    program = torch.export.load(path).module()
    found = program(torch.from_numpy(POSITIONS).float()).detach().numpy()
    np.testing.assert_allclose(found, runs["bisplat-aperture"].predict(POSITIONS).spectra, atol=1e-4)


def test_other_suffix_is_refused(runs, tmp_path):
    with pytest.raises(InputError, match="format: expected one of"):
        export(runs["bisplat"], tmp_path / "model.txt")
    assert not list(tmp_path.iterdir())
