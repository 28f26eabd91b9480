"""Methods in unseen rooms: all know the same spectra, no test spectrum is among them, and training rooms are others."""

import itertools
import json
import shutil
from dataclasses import replace
from functools import partial
from types import SimpleNamespace
from typing import ClassVar

import learn.rooms.compare_rooms as compare_module
import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

import bisplat
from learn.rooms.neighbour_attention import RoomTensors, local_places, to_all_pixels
from learn.rooms.room_methods import AttentionOverNeighbours, KnownInRoom, TwinInRoom
from learn.twin.twin_model import Twin
from scenes.storage.scene_yaml import load_scene

SIGHT = bisplat.Propagation(max_depth=0, diffraction=False, rays=100)


@pytest.fixture(scope="module")
def rooms(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rooms") / "rooms"
    return bisplat.simulate_rooms(folder, 4, "layout", spectra=15, propagation=SIGHT)


class Truth:
    """Predicts the truth, and keeps what it was given."""

    seen: ClassVar[list] = []
    learned: ClassVar[list] = []

    def learn(self, rooms, minutes, seed):
        self.learned.append([dataset.folder.name for dataset in rooms])

    def fit(self, room):
        self.room = room

    def predict(self, positions):
        data = self.room.dataset
        tested = [int(np.flatnonzero((data.positions == place).all(axis=1))[0]) for place in positions]
        self.seen.append((data.folder.name, self.room.known.tolist(), tested))
        return data.spectra[tested]


def test_all_know_the_same_spectra_and_none_that_is_tested(rooms):
    Truth.seen, Truth.learned = [], []
    comparison = bisplat.compare_rooms(rooms, {"a": Truth, "b": Truth}, given=[5, 3], test_rooms=2)
    assert Truth.learned == [["room-000", "room-001"]] * 2
    assert {row["ssim_mean"] for row in comparison} == {1.0} and comparison.rows[0]["spectra"] == 6
    half = len(Truth.seen) // 2
    assert Truth.seen[:half] == Truth.seen[half:]
    for (name, few, tested), (_, more, again) in zip(Truth.seen[:2], Truth.seen[2:half], strict=True):
        assert name in ("room-002", "room-003") and more[:3] == few and tested == again
        assert len(tested) == 3 and not set(more) & set(tested)


def test_a_room_keeps_its_test_spectra_and_seeds_know_others(rooms):
    Truth.seen = []
    for number in (1, 2):
        bisplat.compare_rooms(rooms, {"a": Truth}, given=[3], test_rooms=number)
    assert Truth.seen[0] == Truth.seen[2]
    Truth.seen = []
    bisplat.compare_rooms(rooms, {"a": Truth}, given=[3], seeds=2, test_spectra=1)
    (_, first, tested), (_, second, again) = Truth.seen
    assert first != second and tested == again and len(tested) == 1


def test_methods_by_name_and_the_usual_numbers(rooms):
    comparison = bisplat.compare_rooms(rooms, ["mean", "nearest", "inverse-distance", "attention"], budget=0.001)
    assert sorted({row["train_size"] for row in comparison}) == [5, 10]
    assert all(0 < row["ssim_median"] <= 1 for row in comparison)
    assert "attention" in comparison.remark() and "<table>" in comparison._repr_html_()


def test_models_of_one_room(rooms):
    names = ["helmholtz", "helmholtz-pictures", "mirror-images"]
    comparison = bisplat.compare_rooms(rooms, names, given=[4], test_spectra=1)
    assert min(row["ssim_mean"] for row in comparison) > 0.2
    assert comparison.rows[-1]["ssim_mean"] > 0.9  # in sight of the gateway, one wave explains nearly everything


def test_the_description_of_the_twin_is_wrong(rooms, monkeypatch):
    monkeypatch.setattr(Twin, "fit", lambda self, dataset, known: "")  # which takes a minute
    method, dataset = TwinInRoom(), next(iter(rooms))
    method.fit(KnownInRoom(dataset, np.arange(3), seed=0))
    off = np.linalg.norm(np.array(method._model.corrected.gateway.position) - dataset.gateway_position)
    assert 0.005 < off < 0.15
    assert method._model.propagation.max_depth == 0  # of the dataset, not the default


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"given": [13]}, "room-003: expected 13 known spectra"),
        ({"given": [3, 3]}, "given: expected"),
        ({"test_rooms": 4, "methods": ["attention"]}, "methods: expected a training room"),
        ({"methods": ["krig"]}, "methods: expected"),
    ],
)
def test_refusals(rooms, options, sentence):
    with pytest.raises(bisplat.InputError, match=sentence):
        bisplat.compare_rooms(rooms, **{"methods": ["mean"], **options})


@pytest.mark.parametrize(
    ("changed", "gateway", "expected"),
    [({}, {"rows": 2, "columns": 8}, "array of room-000"), ({"frequency": 868e6}, {}, "frequency of room-000")],
)
def test_rooms_of_another_array_or_frequency_are_refused(rooms, tmp_path, changed, gateway, expected):
    folder = shutil.copytree(rooms.folder, tmp_path / "rooms")
    scene = load_scene(folder / "room-002" / "scene" / "scene.yaml")
    shutil.rmtree(folder / "room-002")
    scene = replace(scene, gateway=replace(scene.gateway, **gateway), **changed)
    bisplat.simulate(scene, folder / "room-002", 15, propagation=SIGHT)
    with pytest.raises(bisplat.InputError, match=expected):
        bisplat.compare_rooms(folder, ["mean"], given=[3])


def test_without_training_rooms_the_others_are_compared(rooms, monkeypatch):
    monkeypatch.setattr(compare_module, "USUAL", ("mean", "attention"))
    comparison = bisplat.compare_rooms(rooms.folder, test_rooms=4, given=[2], test_spectra=1)
    assert {row["label"] for row in comparison} == {"mean"}


def test_coarse_pixels_are_interpolated_where_they_look():
    """A wave around the horizon and up: the middle of a coarse pixel is that of its six columns and six rows."""
    azimuth, elevation = np.radians(np.arange(360)), np.radians(np.arange(90))
    coarse_azimuth, coarse_elevation = np.radians(np.arange(60) * 6 + 2.5), np.radians(np.arange(15) * 6 + 2.5)
    coarse = torch.from_numpy(np.cos(coarse_azimuth - 0.3) * np.sin(coarse_elevation)[:, None])[None, None]
    fine = to_all_pixels(coarse)[0, 0].numpy()
    expected = np.cos(azimuth - 0.3) * np.sin(elevation)[:, None]
    np.testing.assert_allclose(fine[3:-3], expected[3:-3], atol=0.004)


def test_untrained_attention_predicts_by_inverse_distance_in_a_turned_room(rooms):
    dataset = next(iter(rooms))
    turn, shift = Rotation.from_euler("xyz", [0.4, -0.3, 1.2]), np.array([3.0, -2, 1])
    moved = replace(
        dataset,
        positions=turn.apply(dataset.positions) + shift,
        gateway_position=turn.apply(dataset.gateway_position) + shift,
        gateway_orientation=(turn * Rotation.from_quat(dataset.gateway_orientation)).as_quat(),
    )
    np.testing.assert_allclose(
        local_places(moved, moved.positions), local_places(dataset, dataset.positions), atol=1e-4
    )
    torch.manual_seed(0)
    method, known, test = AttentionOverNeighbours(), np.arange(5), np.arange(5, 9)
    method.fit(KnownInRoom(dataset, known, 0))
    found = method.predict(dataset.positions[test])
    away = np.linalg.norm(dataset.positions[test][:, None] - dataset.positions[known], axis=-1)
    shares = 1 / away / (1 / away).sum(axis=1, keepdims=True)
    np.testing.assert_allclose(found, np.einsum("bk,kij->bij", shares, dataset.spectra[known]), atol=1e-4)
    assert np.linalg.norm(local_places(dataset, dataset.gateway_position[None])) < 1e-6
    ahead = dataset.gateway_position + Rotation.from_quat(dataset.gateway_orientation).apply([0, 0, dataset.wavelength])
    np.testing.assert_allclose(local_places(dataset, ahead[None]), [[0, 0, 1]], atol=1e-6)


def test_attention_learns(rooms, monkeypatch):
    datasets = list(rooms)
    tensors = RoomTensors.of(datasets[0], np.arange(15))
    torch.testing.assert_close(tensors.directions @ tensors.directions.mT, torch.eye(3).expand(15, 60, 3, 3))
    method = AttentionOverNeighbours()

    def loss():
        generator = np.random.default_rng(0)
        with torch.no_grad():
            return float(np.mean([method._loss(tensors, generator) for _ in range(8)]))

    before, ticks = loss(), itertools.count(0, 0.1)
    clock = SimpleNamespace(monotonic=lambda: next(ticks))  # a step takes a tenth of a second
    monkeypatch.setattr("learn.rooms.room_methods.time", clock)
    method.learn(datasets[:1], 0.02, seed=0)
    assert method.steps in (11, 12) and loss() < before


def test_the_command_writes_its_files(rooms, bisplat_command, tmp_path):
    call = partial(bisplat_command, "compare", rooms.folder, "-o", "out", "--json", "--models")
    facts = json.loads(call("mean", "nearest", "--given", 3, 5)[1])
    assert facts["setting"] == "layout" and set(facts["methods"]) == {"mean, 3", "mean, 5", "nearest, 3", "nearest, 5"}
    assert json.loads((tmp_path / "out" / "results.json").read_text())["methods"] == facts["methods"]
    names = {path.name for path in (tmp_path / "out").iterdir()}
    # Another method is added with the same training time, although it has none.
    assert len(json.loads(call("inverse-distance", "--given", 3, "--budget", 5)[1])["methods"]) == 5
    kept = {"protocol.json", "results.jsonl"}
    assert {"results.json", "rooms.pdf", "rooms.png", "table.csv", "table.tex"} | kept == names


class StopsAtFive(Truth):
    """Cannot be fitted to five known spectra."""

    def fit(self, room):
        if len(room.known) == 5:
            raise RuntimeError("stopped")
        super().fit(room)


def test_an_interrupted_comparison_goes_on_with_the_missing_rows(rooms, tmp_path):
    output = tmp_path / "kept"
    with pytest.raises(bisplat.InputError, match="found RuntimeError: stopped"):
        bisplat.compare_rooms(rooms, {"a": Truth, "b": StopsAtFive}, given=[3, 5], output=output)
    kept = (output / "results.jsonl").read_text().splitlines()
    assert [json.loads(line)["label"] for line in kept] == ["a", "a", "b"]
    Truth.learned, Truth.seen = [], []
    rows = bisplat.compare_rooms(rooms, {"a": Truth, "nearest": "nearest"}, given=[3, 5], seeds=2, output=output).rows
    assert [(row["label"], row["seed"], row["train_size"]) for row in rows] == [
        ("a", 0, 3), ("a", 0, 5), ("b", 0, 3), ("nearest", 0, 3), ("nearest", 0, 5),
        ("a", 1, 3), ("a", 1, 5), ("nearest", 1, 3), ("nearest", 1, 5),
    ]  # fmt: skip
    assert len(Truth.learned) == 1 and len(Truth.seen) == 2  # with the second seed alone
    again = bisplat.compare_rooms(rooms, ["nearest"], given=[3], output=output)
    assert again.rows == rows and len(Truth.seen) == 2


def test_a_comparison_of_other_settings_or_rooms_is_not_continued(rooms, tmp_path):
    folder = shutil.copytree(rooms.folder, tmp_path / "rooms")
    output = tmp_path / "kept"
    bisplat.compare_rooms(folder, ["mean"], given=[3], output=output)
    with pytest.raises(bisplat.InputError, match="test_rooms 2, found one with"):
        bisplat.compare_rooms(folder, ["mean"], given=[3], test_rooms=2, output=output)
    other = sorted((folder / "room-000" / "spectrum").iterdir())
    shutil.copyfile(other[0], other[1])
    with pytest.raises(bisplat.InputError, match="found one of other data"):
        bisplat.compare_rooms(folder, ["mean"], given=[3], output=output)


def test_seeds_have_a_spread_and_a_single_one_has_none(rooms):
    for seeds in (1, 2):
        comparison = bisplat.compare_rooms(rooms, ["nearest"], given=[3, 5], seeds=seeds, test_spectra=3)
        assert ("± seeds" in comparison.cells()[0]) == (seeds == 2)
