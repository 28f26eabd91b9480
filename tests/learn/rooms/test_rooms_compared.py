"""Methods in unseen rooms: all know the same spectra, no test spectrum is among them, and training rooms are others."""

import itertools
import json
import shutil
from dataclasses import replace
from functools import partial
from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

import bisplat
from learn.quantities.known import Known
from learn.quantities.spectra import SpectraInRooms
from learn.reports.comparison_report import write_comparison
from learn.rooms.neighbour_attention import RoomTensors, local_places, to_all_pixels
from learn.rooms.room_methods import AttentionOverNeighbours
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
        self.minutes = minutes  # which is no setting of a new method
        self.learned.append([dataset.folder.name for dataset in rooms])

    def fit(self, room):
        self.room = room

    def predict(self, positions):
        data = self.room.dataset
        tested = [int(np.flatnonzero((data.positions == place).all(axis=1))[0]) for place in positions]
        self.seen.append((data.folder.name, self.room.rows.tolist(), tested))
        return data.spectra[tested]


def test_all_know_the_same_spectra_and_none_that_is_tested(rooms):
    Truth.seen, Truth.learned = [], []
    comparison = bisplat.compare(rooms, {"a": Truth, "b": Truth}, sizes=[5, 3], test_rooms=2)
    assert Truth.learned == [["room-000", "room-001"]] * 2
    assert {row["ssim_mean"] for row in comparison if row["label"] in "ab"} == {1.0} and comparison.rows[0]["test"] == 6
    half = len(Truth.seen) // 2
    assert Truth.seen[:half] == Truth.seen[half:]
    for (name, few, tested), (_, more, again) in zip(Truth.seen[:2], Truth.seen[2:half], strict=True):
        assert name in ("room-002", "room-003") and set(few) < set(more) and tested == again
        assert len(tested) == 3 and not set(more) & set(tested)


def test_a_room_keeps_its_test_spectra_and_seeds_know_others(rooms):
    Truth.seen = []
    for number in (1, 2):
        bisplat.compare(rooms, {"a": Truth}, sizes=[3], test_rooms=number)
    assert Truth.seen[0] == Truth.seen[2]
    Truth.seen = []
    bisplat.compare(rooms, {"a": Truth}, sizes=[3], seeds=2, tested=1)
    (_, first, tested), (_, second, again) = Truth.seen
    assert first != second and tested == again and len(tested) == 1


def test_methods_by_name_and_the_usual_numbers(rooms):
    comparison = bisplat.compare(rooms, ["mean", "nearest", "inverse-distance", "attention"], budget=0.001)
    assert sorted({row["train_size"] for row in comparison}) == [5, 10]
    assert all(0 < row["ssim_median"] <= 1 for row in comparison)
    assert "attention" in comparison.remark() and "<table>" in comparison._repr_html_()


def test_the_report_names_setting_and_rooms(rooms, tmp_path):
    comparison = bisplat.compare(rooms, ["mean"], sizes=[3], test_rooms=1, tested=1)
    write_comparison(comparison, tmp_path)
    facts = json.loads((tmp_path / "results.json").read_text())
    assert facts["setting"] == "layout" and facts["test_rooms"] == ["room-003"]
    assert facts["training_rooms"] == ["room-000", "room-001", "room-002"]
    page = (tmp_path / "table.html").read_text()
    assert all(name in page for name in ("layout", *facts["training_rooms"], *facts["test_rooms"]))


def test_models_of_one_room(rooms):
    names = ["helmholtz", "helmholtz-pictures", "mirror-images"]
    comparison = bisplat.compare(rooms, names, sizes=[4], tested=1)
    assert min(row["ssim_mean"] for row in comparison if row["label"] in names) > 0.2
    assert comparison.rows[-1]["ssim_mean"] > 0.9  # in sight of the gateway, one wave explains nearly everything


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"sizes": [13]}, "room-003: expected 13 known spectra"),
        ({"sizes": [3, 3]}, "sizes: expected"),
        ({"methods": ["krig"]}, "methods: expected"),
    ],
)
def test_refusals(rooms, options, sentence):
    with pytest.raises(bisplat.InputError, match=sentence):
        bisplat.compare(rooms, **{"methods": ["mean"], **options})


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
        bisplat.compare(folder, ["mean"], sizes=[3])


def test_without_training_rooms_the_others_are_compared(rooms, monkeypatch):
    monkeypatch.setattr("learn.comparison.compare.usual_names", lambda *_: ["mean", "attention"])
    comparison = bisplat.compare(rooms.folder, test_rooms=4, sizes=[2], tested=1)
    assert {row["label"] for row in comparison} == {"mean", "nearest", "inverse-distance"}


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
        places=turn.apply(dataset.positions) + shift,
        receiver=replace(
            dataset.receiver,
            position=turn.apply(dataset.gateway_position) + shift,
            orientation=(turn * Rotation.from_quat(dataset.gateway_orientation)).as_quat(),
        ),
    )
    np.testing.assert_allclose(
        local_places(moved, moved.positions), local_places(dataset, dataset.positions), atol=1e-4
    )
    torch.manual_seed(0)
    method, known, test = AttentionOverNeighbours(), np.arange(5), np.arange(5, 9)
    method.fit(Known.of(dataset, SpectraInRooms(), known))
    found = method.predict(dataset.positions[test]).value
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
    call = partial(bisplat_command, "compare", rooms.folder, "-o", "out", "--json", "--methods")
    facts = json.loads(call("nearest", "--sizes", 3, 5)[1])
    baselines = ("mean", "nearest", "inverse-distance")
    assert set(facts["methods"]) == {f"{name}, {size}" for name in baselines for size in (3, 5)}
    assert len(next(iter(facts["methods"].values()))) and (tmp_path / "out" / "sweep.png").exists()


class StopsAtFive(Truth):
    """Cannot be fitted to five known spectra."""

    def fit(self, room):
        if len(room.rows) == 5:
            raise RuntimeError("stopped")
        super().fit(room)


def test_a_method_that_fails_leaves_the_rows_before_and_the_others_go_on(rooms, tmp_path):
    output = tmp_path / "kept"
    with pytest.raises(bisplat.InputError, match="found RuntimeError: stopped"):
        bisplat.compare(rooms, {"a": Truth, "b": StopsAtFive}, sizes=[3, 5], output=output)
    kept = [json.loads(line) for line in (output / "results.jsonl").read_text().splitlines()]
    assert [(row["label"], row["train_size"]) for row in kept[-3:]] == [("a", 3), ("a", 5), ("b", 3)]
    Truth.learned, Truth.seen = [], []
    rows = bisplat.compare(rooms, {"a": Truth}, sizes=[3, 5], seeds=2, output=output).rows
    assert [row["seed"] for row in rows if row["label"] == "a"] == [0, 0, 1, 1]
    assert len(Truth.learned) == 1 and len(Truth.seen) == 2  # with the second seed alone
