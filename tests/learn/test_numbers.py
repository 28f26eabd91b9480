"""Datasets whose numbers are odd: every model and every baseline still predicts finite spectra, 0 to 1."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from learn.data.splits import Split
from learn.evaluation.check import check
from learn.methods.interpolation import InverseDistance, Kriging, Mean, Nearest
from learn.models.kriging import stacking, vecchia
from learn.models.quadrature import quadrature
from learn.quantities.known import Known
from learn.quantities.spectra import Spectra as OfSpectra
from learn.training.config import Config
from learn.training.gradient_steps import Spectra, Training
from learn.training.prediction import predict
from learn.training.registry import MODELS, model_entry
from learn.training.run_files import box_of, build_model
from learn.training.validation_part import learned_responses
from scenes.files.errors import InputError
from scenes.storage.scene_writing import write_scene
from simulate.dataset.dataset import Dataset
from simulate.dataset.index_files import write_index
from simulate.dataset.picture_files import encode_picture
from simulate.dataset.receivers import ArrayReceiver
from simulate.dataset.spectra_folder import write_gateway
from simulate.positions.positions import FARTHEST, write_positions
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import picture
from tests.small_scene import small_scene

COUNT = 6
OPTIONS = {
    "bisplat-plus": {"primitives": 40, "ffn_width": 16, "ffn_layers": 1, "transformer_layers": 1},
    "bisplat": {"primitives": 40, "clusters": 16, "ffn_width": 16, "ffn_layers": 1, "transformer_layers": 1},
    "bisplat-aperture": {"primitives": 40, "width": 16},
    "nerf2": {"samples": 4, "rays": 64, "width": 16},
    "swiftwrf": {"primitives": 20},
    "wrf-gs-plus": {"primitives": 20, "width": 16},
    "gsrf": {"primitives": 20},
}
"""Of models that would take long otherwise."""


@pytest.fixture(scope="module")
def scene(tmp_path_factory) -> str:
    return str(write_scene(small_scene(), tmp_path_factory.mktemp("numbers") / "scene"))


def usual() -> Dataset:
    """A dataset in memory with responses; the last spectrum is for testing."""
    generator = np.random.default_rng(0)
    responses = (generator.normal(size=(COUNT, 16, 2)) @ [1, 1j]).astype(np.complex64)
    return Dataset(
        folder=Path("odd"),
        names=[f"{number:05d}" for number in range(1, COUNT + 1)],
        values={"spectrum": picture(Beamformer().spectrum(responses)), "response": responses},
        receiver=ArrayReceiver(np.array(small_scene().gateway.position), np.array(small_scene().gateway.orientation)),
        places=generator.uniform(-1, 1, (COUNT, 3)),
        train=np.arange(COUNT - 1),
        test=np.array([COUNT - 1]),
    )


ODD = {
    "far away": lambda data: replace(data, places=data.positions + FARTHEST - 1),
    "far apart": lambda data: replace(data, places=data.positions * FARTHEST),
    "very near": lambda data: replace(data, places=data.positions * 1e-7),
    "at one place": lambda data: replace(data, places=np.ones_like(data.positions)),
    "on a line": lambda data: replace(data, places=data.positions * [1, 0, 0]),
    "on a plane": lambda data: replace(data, places=data.positions * [1, 1, 0]),
    "at shared places": lambda data: replace(data, places=data.positions[[0, 0, 1, 1, 2, 2]]),
    "black": lambda data: data.with_values(spectrum=np.zeros_like(data.pictures), response=None),
    "white": lambda data: data.with_values(spectrum=np.full_like(data.pictures, 255), response=None),
    "without responses": lambda data: data.with_values(response=None),
    "hardly any signal": lambda data: data.with_values(
        response=np.repeat(1e-12 * np.eye(COUNT, 1), 16, axis=1).astype("c8")
    ),
    "much signal": lambda data: data.with_values(response=data.responses * 1e11),
    "one known spectrum": lambda data: replace(data, train=np.array([0])),
    "two known spectra": lambda data: replace(data, train=np.array([0, 1])),
}
FEWER = ["far apart", "at one place", "black", "white", "hardly any signal"]
"""For models that take longer."""


def odd_dataset(odd: str) -> Dataset:
    return ODD[odd](usual())


@pytest.fixture(autouse=True)
def short_fits(monkeypatch):
    """Few iterations of every fit, and kriging's scores without folds."""
    monkeypatch.setattr(vecchia, "ITERATIONS", 3)
    monkeypatch.setattr(stacking, "FOLDS", 1)
    monkeypatch.setattr(stacking, "LEFT_OUT", 2)
    monkeypatch.setattr(stacking, "QUARTERS", 1)


def finite(spectra: np.ndarray, clipped: bool = False) -> None:
    assert np.isfinite(spectra).all()
    assert clipped or (spectra.min() >= 0 and spectra.max() <= 1 + 1e-6)


@pytest.mark.parametrize(
    ("name", "odd"),
    [
        pytest.param(name, odd, marks=pytest.mark.slow if entry.needs else ())
        for name, entry in MODELS.items()
        for odd in (FEWER if entry.by_steps or entry.needs else ODD)
    ],
)
def test_models(name, odd, scene):
    data = odd_dataset(odd)
    parts = Split(data.train, data.train[:1], data.test)
    entry = model_entry(name)
    options = {**OPTIONS.get(name, {}), **({"scene": scene} if entry.needs else {})}
    config = Config(dataset="odd", model=name, options=options, by_steps=entry.by_steps)
    torch.manual_seed(0)
    model = build_model(config, box_of(data.positions[parts.train]), data.beamformer, data.wavelength)
    if (name == "twin" and odd == "black") or (name == "mirror-images" and "response" not in data.values):
        for learn in (model.fit, model.refit):
            with pytest.raises(InputError, match=r"expected (spectra of several grey levels|element responses)"):
                learn(data, parts.train)
        return
    if entry.by_steps is None:
        model.fit(data, parts.train)
        model.refit(data, parts.train)
    else:
        module = Training(model, replace(entry.by_steps, steps=2, batch_size=4), quadrature(data.beamformer))
        optimiser = module.configure_optimizers()["optimizer"]
        learned = learned_responses(model, data, parts, replace(entry.by_steps, find_phases=False)).responses
        batch = next(iter(Spectra(data, parts, 4, 0, learned).train_dataloader()))
        for coarse in (True, False):
            optimiser.zero_grad()
            loss = module.loss(*batch, coarse)
            loss.backward()
            optimiser.step()
            assert loss.isfinite()
    places = np.concatenate([data.positions[:2], data.positions[data.test], [[1, 1, 1]]])
    found = predict(model.eval(), places if name != "nerf2" else places[-2:])
    # bisplat's |F|² and gsrf's |F| have no upper bound, swiftwrf's and wrf-gs-plus's reach √2; scores clip them
    unbounded = ("bisplat", "bisplat-plus", "swiftwrf", "wrf-gs-plus", "gsrf", "nerf2")
    finite(found.spectra, clipped=name in unbounded)
    assert found.responses is None or np.isfinite(found.responses).all()


@pytest.mark.parametrize("odd", ODD)
@pytest.mark.parametrize("method", [Mean, Nearest, InverseDistance, Kriging])
def test_baselines(method, odd):
    data = odd_dataset(odd)
    made = method()
    made.fit(Known.of(data, OfSpectra(), data.train))
    # kriging of spectra has no bounds; scores clip it
    finite(made.predict(np.concatenate([data.positions, [[1, 1, 1]]])).value, clipped=method is Kriging)


@pytest.mark.parametrize("level", [0, 255])
def test_folders_of_pictures_of_one_grey_level(level, tmp_path):
    (tmp_path / "spectrum").mkdir()
    for number in range(1, 5):
        image = np.full((90, 360), level, np.uint8)
        (tmp_path / "spectrum" / f"{number:05d}.png").write_bytes(encode_picture(image))
    write_positions(tmp_path / "tx_pos.csv", np.arange(12).reshape(4, 3))
    write_gateway(tmp_path / "gateway_info.yml", "grey", (0, 0, 1), (0, 0, 0, 1))
    write_index(tmp_path / "train_index.txt", ["00001", "00002", "00003"])
    write_index(tmp_path / "test_index.txt", ["00004"])
    found = check(tmp_path)
    assert found.valid and found.split.leakage is not None and np.isfinite(found.split.leakage.ssim).all()
    assert all(text.isprintable() and "nan" not in text for text in found.description().values())
