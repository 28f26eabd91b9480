"""Fixtures for the learner: small models, a small dataset folder, a run trained on it.

They import what trains and evaluates themselves: it takes seconds, and most tests need none of it.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from learn.models.model_settings import Steps
from learn.training.config import Config
from learn.training.registry import MODELS
from simulate.dataset.index_files import write_index
from simulate.dataset.metadata import write_metadata
from simulate.dataset.picture_files import encode_picture
from simulate.dataset.responses_file import write_responses
from simulate.dataset.spectra_folder import write_gateway
from simulate.positions.positions import write_positions
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import picture


@pytest.fixture(scope="session")
def small() -> dict[str, int]:
    """Options that make the paper's models small."""
    return {
        "primitives": 40,
        "clusters": 16,
        "ffn_width": 16,
        "ffn_layers": 1,
        "transformer_layers": 1,
        "transformer_ffn_width": 16,
    }


@pytest.fixture(scope="session")
def small_aperture() -> dict[str, int]:
    """Options that make bisplat-aperture small."""
    return {"primitives": 40, "width": 16}


@pytest.fixture(scope="session")
def region() -> np.ndarray:
    return np.array([[0.0, -1.0, 0.5], [4.0, 1.0, 2.5]])


@pytest.fixture(scope="session")
def plane_waves() -> Callable[..., np.ndarray]:
    """Function: (amplitude, azimuth, elevation in degrees) of each wave -> 4 × 4 half-wavelength responses.

    Written from the equations: element m = 4 row + column at x = (column − 1.5) λ/2, y = (row − 1.5) λ/2.
    """
    column, row = np.meshgrid(np.arange(4), np.arange(4))
    x, y = (column.ravel() - 1.5) / 2, (row.ravel() - 1.5) / 2

    def responses(*waves: tuple) -> np.ndarray:
        total = np.zeros(16, complex)
        for amplitude, azimuth, elevation in waves:
            phi, theta = np.radians(azimuth), np.radians(elevation)
            total += amplitude * np.exp(2j * np.pi * np.cos(theta) * (x * np.cos(phi) + y * np.sin(phi)))
        return total

    return responses


@pytest.fixture(scope="session")
def write_folder(plane_waves) -> Callable[..., Path]:
    """Function: writes a NeRF² folder of a transmitter on a path, seen as two plane waves; every fifth is for testing.

    It states its frequency. Otherwise it is like a measured folder, without metadata and, unless asked for, responses.
    """

    def write(folder: Path, count: int = 24, keep_responses: bool = False) -> Path:
        along = np.linspace(0, 1, count)
        positions = np.stack([4 * along, np.sin(3 * along), 1 + 0 * along], axis=-1)
        responses = np.array([plane_waves((1, 20 + 150 * t, 35 + 20 * t), (0.6j, 250, 50 - 30 * t)) for t in along])
        names = [f"{number:05d}" for number in range(1, count + 1)]
        (folder / "spectrum").mkdir(parents=True)
        for name, image in zip(names, picture(Beamformer().spectrum(responses)), strict=True):
            (folder / "spectrum" / f"{name}.png").write_bytes(encode_picture(image))
        write_positions(folder / "tx_pos.csv", positions)
        write_metadata(folder / "metadata.json", {"frequency_hz": 915e6})
        write_gateway(folder / "gateway_info.yml", "tiny", (0, 0, 1), (0, 0, 0, 1))
        write_index(folder / "train_index.txt", [name for index, name in enumerate(names) if index % 5 != 2])
        write_index(folder / "test_index.txt", names[2::5])
        if keep_responses:
            write_responses(folder / "channels.npz", responses)
        return folder

    return write


@pytest.fixture(scope="session")
def tiny(tmp_path_factory, write_folder) -> Path:
    """A dataset folder of 24 spectra, to be read from only: 17 to train on, 2 to validate, 5 to test."""
    return write_folder(tmp_path_factory.mktemp("data") / "tiny")


def _use_small_models(patch: pytest.MonkeyPatch, small: dict[str, int], small_aperture: dict[str, int]) -> None:
    sizes = {"bisplat": small, "bisplat-plus": {**small, "primitives": 60}, "bisplat-aperture": small_aperture}
    for name, options in sizes.items():
        patch.setitem(MODELS, name, replace(MODELS[name], options=options))
    from learn.training import validation_part as epochs

    patch.setattr(epochs, "STEPS_PER_VALIDATION", 6)


@pytest.fixture
def small_models(monkeypatch, small, small_aperture) -> None:
    """BiSplat models are small, and every model is validated every 6 steps."""
    _use_small_models(monkeypatch, small, small_aperture)


@pytest.fixture
def quick_fits(monkeypatch) -> None:
    """Fits of covariances end early, and known spectra are divided into two parts to find the weights of a mixture."""
    from learn.models.kriging import stacking, vecchia

    monkeypatch.setattr(vecchia, "ITERATIONS", 15)
    monkeypatch.setattr(stacking, "FOLDS", 2)


@pytest.fixture
def no_ceiling(monkeypatch) -> None:
    """The array's ceiling takes longest of all that ``evaluate`` does: here the truth itself in its place."""
    from learn.evaluation import evaluate

    monkeypatch.setattr(evaluate, "array_ceiling", lambda truth, beamformer, recorded: truth)


@pytest.fixture(scope="session")
def tiny_config(tiny) -> Config:
    """Two validations, each after six steps, which are two passes of three batches."""
    return Config(
        dataset=str(tiny),
        model="bisplat-aperture",
        split="files",
        seed=3,
        split_seed=3,
        by_steps=Steps(steps=12, batch_size=5, learning_rate=2e-3),
    )


@pytest.fixture(scope="session")
def changed() -> Callable[..., Config]:
    """Function: a configuration with some of its settings changed, those of training by steps among them."""

    def change(config: Config, **settings) -> Config:
        of_steps = {name: settings.pop(name) for name in list(settings) if name in Steps.__dataclass_fields__}
        return replace(config, by_steps=replace(config.by_steps, **of_steps), **settings)

    return change


@pytest.fixture(scope="session")
def finished_run(tmp_path_factory, tiny_config, small, small_aperture) -> Path:
    """A run on ``tiny`` that nothing interrupted, to be read from only."""
    from learn.training.train import train_run

    folder = tmp_path_factory.mktemp("runs") / "finished"
    with pytest.MonkeyPatch.context() as patch:
        _use_small_models(patch, small, small_aperture)
        train_run(tiny_config, folder)
    return folder
