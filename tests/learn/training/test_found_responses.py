"""Networks that predict responses learn from those found behind pictures, where these are one field."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import bisplat
from learn.data.metrics import ssim
from learn.data.splits import Split
from learn.models.kriging import vecchia
from learn.models.kriging.retrieved_field import flipped
from learn.training.config import Config
from learn.training.registry import MODELS
from learn.training.run_files import box_of, build_model
from learn.training.validation_part import learned_responses
from simulate.dataset.dataset import Dataset
from simulate.dataset.receivers import ArrayReceiver
from simulate.fullwave.stored_field import read_stored_field
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.identification import Identification
from simulate.spectra.spectrum import picture

FIELD = Path(__file__).parents[2] / "data" / "closet" / "field.npz"
STEPS = MODELS["mlp-responses"].by_steps


@pytest.fixture(autouse=True)
def _few_iterations(monkeypatch):
    monkeypatch.setattr(vecchia, "ITERATIONS", 30)


def dataset_of(responses: np.ndarray, positions: np.ndarray) -> Dataset:
    beamformer = Beamformer()
    return Dataset(
        folder=Path("closet"),
        names=[f"{number:05d}" for number in range(1, len(positions) + 1)],
        values={
            "spectrum": np.stack([picture(beamformer.spectrum(each)) for each in responses]),
            "response": responses,
        },
        receiver=ArrayReceiver(np.zeros(3), np.array([0.0, 0, 0, 1]), Identification(beamformer, "metadata")),
        places=positions,
        train=np.arange(0),
        test=np.arange(0),
        metadata={"frequency_hz": 915e6},
    )


@pytest.fixture(scope="module")
def closet():
    """90 spectra with responses in a box of 0.3 m, and a split of 80 training and 10 validation spectra."""
    field = read_stored_field(FIELD)
    middle = field.origin + field.spacing * (np.array(field.values.shape[1:]) - 1) / 2
    positions = middle + 0.3 * (np.random.default_rng(0).random((90, 3)) - 0.5)
    return dataset_of(field.responses(positions), positions), Split(np.arange(80), np.arange(80, 90), np.arange(0))


def built(name, dataset):
    region = box_of(dataset.positions)
    return build_model(Config(dataset="", model=name, by_steps=STEPS), region, dataset.beamformer, dataset.wavelength)


def found(dataset, parts, name="mlp-responses", **settings):
    return learned_responses(built(name, dataset), dataset, parts, replace(STEPS, **settings)).responses


def likeness(one, other):
    """Correlation of two fields, up to one complex factor."""
    return abs(np.vdot(one, other)) / np.linalg.norm(one) / np.linalg.norm(other)


@pytest.mark.slow
def test_responses_behind_pictures_of_one_field_are_the_true_ones_but_for_a_factor_and_a_flip(closet, capsys):
    dataset, parts = closet
    learned, true = found(dataset.with_values(response=None), parts)[:80], dataset.responses[:80]
    assert max(likeness(learned, true), likeness(learned, flipped(true))) > 0.95
    assert "learns from responses found behind the pictures" in capsys.readouterr().err


@pytest.mark.slow
def test_a_black_picture_says_nothing(closet):
    dataset, parts = closet
    pictures = dataset.pictures.copy()
    pictures[[3, 40]] = 0
    learned, true = found(dataset.with_values(spectrum=pictures, response=None), parts)[:80], dataset.responses[:80]
    assert not learned[[3, 40]].any()
    assert max(likeness(learned, true), likeness(learned, flipped(true))) > 0.95
    pictures[:61] = 0
    assert found(dataset.with_values(spectrum=pictures, response=None), parts) is None  # 19 are too few


@pytest.mark.slow
def test_pictures_that_are_no_field_are_learned_as_they_are(closet, capsys):
    dataset, parts = closet
    mixed_up = replace(
        dataset.with_values(response=None), places=dataset.positions[np.random.default_rng(1).permutation(90)]
    )
    assert found(mixed_up, parts) is None
    assert "learns from pictures" in capsys.readouterr().err


def test_responses_are_found_only_where_a_model_can_learn_them(closet):
    dataset, parts = closet
    assert found(dataset, parts) is dataset.responses
    assert found(dataset, parts, "mlp") is None
    pictures = dataset.with_values(response=None)
    assert found(pictures, parts, "mlp") is None
    assert found(pictures, parts, find_phases=False) is None
    assert found(pictures, Split(np.arange(15), parts.validation, parts.test)) is None


@pytest.mark.slow
def test_a_network_learns_pictures_better_by_their_responses(tmp_path, closet):
    dataset, _ = closet
    known = replace(dataset.with_values(response=None), train=np.arange(80), test=np.arange(80, 90))
    scores = []
    for find in (True, False):
        run = bisplat.train(known, tmp_path / str(find), model="mlp-responses", steps=100, find_phases=find)
        assert run.config.by_steps.find_phases == find
        scores.append(_score(run, known))
    assert 1 - scores[0] < (1 - scores[1]) / 3


def _score(run, dataset):
    return float(np.median(ssim(run.predict(dataset.positions[dataset.test]).spectra, dataset.spectra[dataset.test])))
