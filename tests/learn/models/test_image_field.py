"""Waves of the gateway's mirror images: what a few spectra tell of the walls holds everywhere."""

import dataclasses

import numpy as np
import onnxruntime
import pytest
import torch
from scipy.spatial.transform import Rotation

from learn.comparison.compare import compare
from learn.fitted.runs import train
from learn.models.images.image_field import ImageField, frame_of_walls, in_frame
from learn.models.images.image_search import most_likely
from learn.models.kriging.kriged_field import KrigedField
from learn.reports.export import export
from learn.training.model_export import INPUT, OUTPUT
from scenes.files.errors import InputError
from simulate.dataset.receivers import ArrayReceiver
from simulate.dataset.written_dataset import write_dataset
from tests.plane_wave_field import BEAMFORMER, WAVELENGTH, dataset_of

GATEWAY = np.array([2.6, 1.1, 1.5])
TURN = Rotation.from_euler("zyx", [70, 20, 10], degrees=True)
OFFSETS = TURN.apply(WAVELENGTH * BEAMFORMER.array.positions)
KNOWN, OTHERS = np.arange(6), np.arange(6, 40)

WALLS = [  # the gateway, its image in the wall y = −0.8, in the floor z = 0.1, in both, and in the wall x = 3.4
    (1.0, GATEWAY, (1, 1, 1)),
    (0.5 + 0.3j, [2.6, -2.7, 1.5], (1, -1, 1)),
    (-0.4j, [2.6, 1.1, -1.3], (1, 1, -1)),
    (0.3, [2.6, -2.7, -1.3], (1, -1, -1)),
    (-0.5, [4.2, 1.1, 1.5], (-1, 1, 1)),
]


def waves(places: np.ndarray, middle, signs) -> np.ndarray:
    """e^{−jkR}/R of one image, computed element by element."""
    found = np.zeros((len(places), len(OFFSETS)), complex)
    for row, place in enumerate(places):
        for column, offset in enumerate(OFFSETS):
            away = np.linalg.norm(place - (np.array(middle) + np.array(signs) * offset)) / WAVELENGTH
            found[row, column] = np.exp(-2j * np.pi * away) / away
    return found


@pytest.fixture(scope="module")
def room():
    places = np.array([0.3, 0.2, 0.7]) + np.random.default_rng(0).uniform(0, 1, (40, 3))
    responses = sum(amplitude * waves(places, *image) for amplitude, *image in WALLS)
    found = dataset_of(places, responses)
    return dataclasses.replace(found, receiver=ArrayReceiver(GATEWAY, TURN.as_quat(), found.identification))


@pytest.fixture(scope="module")
def fitted(room):
    model = ImageField(np.zeros((2, 3)), BEAMFORMER, WAVELENGTH)
    sentence = model.fit(room, KNOWN)
    assert "mirror images of it explain 9" in sentence or "explain 100%" in sentence
    return model


def error(model, room, unit: float = 1.0) -> float:
    """Share of the power of the other responses that a model does not predict. ``unit`` is that of its responses."""
    with torch.inference_mode():
        found = unit * torch.view_as_complex(model.responses(torch.from_numpy(room.positions[OTHERS]).float())).numpy()
    truth = room.responses[OTHERS]
    return float((abs(found - truth) ** 2).sum() / (abs(truth) ** 2).sum())


def test_six_spectra_tell_the_field_wavelengths_away(room, fitted):
    kriged = KrigedField(np.zeros((2, 3)), BEAMFORMER, WAVELENGTH, "responses")
    kriged.fit(room, KNOWN)
    unit = float((np.abs(room.responses[KNOWN]) ** 2).mean() ** 0.5)
    assert error(fitted, room) < 0.01 < 0.5 < error(kriged, room, unit)


def test_walls_that_are_turned_are_found(room, fitted):
    """Also those of a room in the turned frame: the prediction is as good as with walls along the axes."""
    known = np.arange(14)
    turned = in_frame(room, frame_of_walls(-30))
    model, straight = (ImageField(np.zeros((2, 3)), BEAMFORMER, WAVELENGTH) for _ in range(2))
    assert "mirror images of it in walls turned by 30°" in model.fit(turned, known)
    assert "turned" not in straight.fit(room, known)
    assert error(model, turned) < 1.2 * error(straight, room) < 0.01
    loaded = ImageField(np.zeros((2, 3)), BEAMFORMER, WAVELENGTH)
    loaded.load_state_dict(model.state_dict())
    assert error(loaded, turned) == pytest.approx(error(model, turned), rel=1e-3)


def test_strengths_are_those_of_the_highest_likelihood():
    generator = np.random.default_rng(0)
    some = generator.normal(size=(30, 50, 2)) @ [1, 1j]
    data = 3 * some[:, 7] - 2j * some[:, 20] + 0.1 * generator.normal(size=(30, 2)) @ [1, 1j]
    few = most_likely(some, data, np.full(50, 0.1), 1.0, iterations=60)
    assert set(np.argsort(few.variances)[-2:]) == {7, 20}
    assert np.allclose(few.amplitudes[[7, 20]], [3, -2j], atol=0.2)
    # the same by the other system of equations, which fewer waves than data need
    some, chosen = some[:, :25], np.full(25, 0.1)
    assert np.allclose(most_likely(some, data, chosen, 1.0, 60).amplitudes[[7, 20]], [3, -2j], atol=0.2)


def test_no_waves_in_dark_responses(room):
    for known in (KNOWN, np.arange(20)):  # of so many, the angle of the walls is looked for, too
        model = ImageField(np.zeros((2, 3)), BEAMFORMER, WAVELENGTH)
        model.fit(room.with_values(response=np.zeros_like(room.responses)), known)
        assert not len(model.middles) and not model.responses(torch.zeros(2, 3)).any()
    assert not most_likely(np.ones((2, 1), complex), np.zeros(2, complex), np.ones(1), 1.0, 2).variances.any()


def test_variances_are_small_and_numbers_of_images_that_differ_are_refused(room, fitted):
    places = torch.from_numpy(room.positions[OTHERS]).float()
    assert (0 <= fitted.uncertainty(places)).all() and (fitted.uncertainty(places) < 0.2).all()
    with pytest.raises(RuntimeError, match="signs"):
        fitted.load_state_dict({**fitted.state_dict(), "signs": torch.ones(1, 3)})


@pytest.mark.parametrize(
    ("change", "found"),
    [
        ({}, "pictures alone"),
        ({"metadata": {"phases": "per-position"}}, "phases that cannot be compared"),
        ({"metadata": {"moving": "receiver"}}, "a receiver that moves"),
        ({"metadata": {"moving": "both"}}, "both ends moving"),
    ],
)
def test_what_has_no_images_is_refused(room, change, found):
    model = ImageField(np.zeros((2, 3)), BEAMFORMER, WAVELENGTH)
    with pytest.raises(InputError, match=f"expected .*, found {found}"):
        values = room.values if "moving" in change.get("metadata", {}) else {"spectrum": room.pictures}
        model.fit(dataclasses.replace(room, values=values, **change), KNOWN)


@pytest.fixture(scope="module")
def folder(room, tmp_path_factory):
    """The room's dataset in a folder."""
    path = tmp_path_factory.mktemp("mirror-images") / "data"
    given = {"gateway_position": GATEWAY, "gateway_orientation": TURN.as_quat()}
    return write_dataset(path, room.positions, room.responses, BEAMFORMER.array, room.metadata["frequency_hz"], **given)


@pytest.fixture(scope="module")
def run(folder, tmp_path_factory):
    return train(folder, tmp_path_factory.mktemp("mirror-images") / "run", model="mirror-images", split="random")


def test_a_run_by_name(folder, run):
    found = run.predict(folder.positions)
    assert found.responses is not None and np.abs(found.spectra - folder.spectra).mean() < 0.01


@pytest.mark.slow
def test_onnx_gives_the_same_spectra(folder, run, tmp_path):
    found = run.predict(folder.positions[:2])
    export(run, tmp_path / "model.onnx")
    session = onnxruntime.InferenceSession(tmp_path / "model.onnx")
    (exported,) = session.run([OUTPUT], {INPUT: folder.positions[:2].astype(np.float32)})
    np.testing.assert_allclose(exported, found.spectra, atol=1e-3)


def test_a_dataset_without_responses_is_refused_or_the_row_left_out(folder, tmp_path, capsys):
    pictures = folder.with_values(response=None)
    with pytest.raises(InputError, match="the model mirror-images: expected element responses"):
        train(pictures, tmp_path / "run", model="mirror-images", split="random")
    assert not (tmp_path / "run").exists()
    rows = compare(pictures, ["mirror-images"], split="random", output=tmp_path / "table", tested=2)
    assert "mirror-images" not in {row["label"] for row in rows}
    assert "left out mirror-images: expected element responses" in capsys.readouterr().err
