"""Run folders whose files are damaged or hostile: each is refused in one sentence."""

from __future__ import annotations

import json
import shutil
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors.torch import load_file, save_file

from learn.data.splits import read_split, split
from learn.fitted.runs import load_run
from learn.models.kriging.helmholtz import HelmholtzField
from learn.models.kriging.kriged_field import KrigedField
from learn.training.config import Config, write_config
from learn.training.run_files import box_of, read_training
from learn.training.run_folder import save_weights
from scenes.files.errors import InputError
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import read_dataset
from tests import corpus

pytestmark = pytest.mark.usefixtures("small_models")

Change = Callable[[dict[str, torch.Tensor]], object]


@pytest.fixture(scope="module")
def data(tiny) -> Dataset:
    return read_dataset(tiny)


@pytest.fixture
def run(finished_run, tmp_path) -> Path:
    """A finished run of a model trained by steps, to be spoilt."""
    return shutil.copytree(finished_run, tmp_path / "run")


@pytest.fixture(scope="module")
def kriged_run(write_folder, tmp_path_factory) -> Path:
    """A finished run of kriging of responses and by distance, to be copied."""
    place = tmp_path_factory.mktemp("kriged")
    dataset = read_dataset(write_folder(place / "data", count=8, keep_responses=True))
    box = box_of(dataset.positions)
    field = KrigedField(box, dataset.beamformer, dataset.wavelength, "responses")
    field.keep(dataset, np.arange(8))
    model = HelmholtzField(box, dataset.beamformer, dataset.wavelength)
    model._set({"responses": 0.5, "inverse-distance": 0.5}, {"responses": field})
    folder = place / "run"
    parts = split(dataset, "files", 0)
    write_config(folder, Config(dataset=str(dataset.folder)), dataset, parts)
    save_weights(folder, model)
    return folder


@pytest.fixture
def kriged(kriged_run, tmp_path) -> Path:
    """The same, to be spoilt."""
    return shutil.copytree(kriged_run, tmp_path / "kriged")


def refused(read, *words: str) -> None:
    with pytest.raises(InputError) as error:
        read()
    sentence = str(error.value)
    assert sentence.isprintable() and len(sentence) < 600 and "expected" in sentence and "found" in sentence
    for word in words:
        assert word in sentence


WEIGHTS: dict[str, corpus.Case] = {
    **{name: case for name, case in corpus.ANY_FILE.items() if name != "link to itself"},
    "nothing": (corpus.content(b""), "weights of bisplat-aperture"),
    "text": (corpus.content(b"no tensors, but long enough for a header"), "weights of bisplat-aperture"),
    "header of gigabytes": (corpus.content(struct.pack("<Q", 2**33) + b"{}"), "weights of bisplat-aperture"),
    "header that is no JSON": (corpus.content(struct.pack("<Q", 8) + b"{" * 8), "weights of bisplat-aperture"),
    "no tensors": (corpus.content(struct.pack("<Q", 8) + b"{}      "), "weights of bisplat-aperture"),
}


@pytest.mark.parametrize("case", WEIGHTS)
def test_files_that_are_no_weights(case, run):
    make, word = WEIGHTS[case]
    (run / "weights.safetensors").unlink()
    make(run / "weights.safetensors")
    refused(lambda: load_run(run), "weights.safetensors", word)


def change_weights(folder: Path, change: Change) -> None:
    tensors = load_file(folder / "weights.safetensors")
    change(tensors)
    save_file({name: each.contiguous() for name, each in tensors.items()}, folder / "weights.safetensors")


def test_weights_that_are_not_finite(run):
    change_weights(run, lambda tensors: tensors["primitives.depth_raw"].fill_(torch.nan))
    refused(lambda: load_run(run), "primitives.depth_raw")


@pytest.mark.filterwarnings("error")
def test_weights_that_are_complex(run):
    change_weights(run, lambda tensors: tensors.update({name: each + 0j for name, each in tensors.items()}))
    refused(lambda: load_run(run), "expected real weights")


def test_weights_so_large_that_predictions_are_not_finite(run):
    change_weights(run, lambda tensors: [each.fill_(3e38) for each in tensors.values() if each.ndim == 2])
    refused(lambda: load_run(run).predict([[1.0, 0.0, 1.0]]), "finite spectra")


def of_field(part: str, change: Callable[[torch.Tensor], torch.Tensor]) -> Change:
    """Changes a buffer of a kriged field."""

    def apply(tensors: dict[str, torch.Tensor]) -> None:
        name = next(name for name in tensors if name.endswith(f".{part}"))
        tensors[name] = change(tensors[name])

    return apply


KRIGED: dict[str, tuple[Change, str]] = {
    "one place less": (of_field("places", lambda old: old[:-1]), "places of shape"),
    "one value less": (of_field("values", lambda old: old[:-1]), "values of shape"),
    "other values": (of_field("values", lambda old: old[:, :-1]), "values of shape"),
    "no spectra": (of_field("times", lambda old: old[:0]), "no known spectra"),
    "a time alone": (of_field("times", lambda old: old[0]), "no known spectra"),
    "places in a plane": (of_field("places", lambda old: old[:, :2]), "places of shape"),
    "other mean": (of_field("mean", lambda old: old[:3]), "mean"),
    "drift of 0": (of_field("drift", lambda old: 0 * old), "drift"),
    "negative shares": (of_field("shares", lambda old: -old), "share"),
    "no weights": (lambda tensors: tensors["weights"].zero_(), "weights"),
    "weights above 1": (lambda tensors: tensors["weights"].mul_(2), "shares of 1"),
    "negative weights": (lambda tensors: tensors["weights"].mul_(-1), "shares of 1"),
    "weight without field": (lambda tensors: tensors["weights"].fill_(0.2), "no field of"),
    "no fields": (
        lambda tensors: [tensors.pop(name) for name in list(tensors) if name.startswith("fields.")],
        "no field of",
    ),
}


@pytest.mark.parametrize("case", KRIGED)
def test_weights_of_kriging_that_do_not_fit_together(case, kriged):
    change, word = KRIGED[case]
    change_weights(kriged, change)
    refused(lambda: load_run(kriged), "weights.safetensors: expected the weights of helmholtz", word)


SPLITS: dict[str, corpus.Case] = {
    **corpus.ANY_FILE,
    "nothing": (corpus.content(""), "malformed JSON"),
    "deep lists": (corpus.content("[" * 10**6), "levels deep"),
    "long number": (corpus.content("1" * 10**5), "too large"),
    "list": (corpus.content("[]"), "[]"),
    "no validation": (corpus.content('{"train": [], "test": []}'), "the key validation"),
    "one name": (
        corpus.content('{"train": "00001", "validation": [], "test": []}'),
        "train: expected a list, found '00001'",
    ),
    "numbers": (corpus.content('{"train": [1, 2], "validation": [], "test": []}'), "train"),
    "lists": (corpus.content('{"train": [["00001"]], "validation": [], "test": []}'), "train"),
    "unknown": (corpus.content('{"train": ["\\u001b[2J"], "validation": [], "test": []}'), r"'\x1b[2J'"),
    "leak": (corpus.content('{"train": ["00001"], "validation": [], "test": ["00001"]}'), "'00001' twice"),
    "twice": (corpus.content('{"train": ["00001", "00001"], "validation": [], "test": ["00002"]}'), "'00001' twice"),
    "no test": (corpus.content('{"train": ["00001"], "validation": [], "test": []}'), "none in one"),
}


@pytest.mark.parametrize("case", SPLITS)
def test_splits(case, data, tmp_path):
    make, word = SPLITS[case]
    path = tmp_path / "split.json"
    make(path)
    where = "was trained on" if case == "unknown" else "split.json"
    refused(lambda: read_split(path, data.names, data.folder), where, word)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[",
        "[]",
        "{}",
        '{"steps": "many", "seconds": 1}',
        '{"steps": 1, "seconds": NaN}',
        '{"steps": -1, "seconds": 1}',
        '{"steps": 1, "seconds": 1, "deviation": 3}',
        '{"steps": 1, "seconds": 1, "deviation": {"constant": -1, "growth": 0}}',
    ],
)
def test_training_json(text, run):
    assert read_training(run).steps == 12
    (run / "training.json").write_text(text)
    refused(lambda: read_training(run), "training.json: ")


def test_the_unspoilt_runs_are_read(run, kriged, data):
    assert load_run(kriged).predict([[1.0, 0.0, 1.0]]).spectra.shape == (1, 90, 360)
    parts = load_run(run).split(data)
    assert sorted(json.loads((run / "split.json").read_text())["test"]) == [data.names[i] for i in parts.test]
