"""Folders of rooms: what differs between rooms is what the setting says, and the same call finishes the folder."""

import json

import numpy as np
import pytest

import bisplat
from scenes.storage.scene_yaml import load_scene
from simulate.dataset.rooms_folder import read_rooms

SIGHT = bisplat.Propagation(max_depth=0, diffraction=False, rays=100)
WALLS = 6


def made(folder, setting, **options):
    rooms = bisplat.simulate_rooms(folder / setting, 2, setting, spectra=4, propagation=SIGHT, **options)
    scenes = [load_scene(folder / setting / name / "scene" / "scene.yaml") for name in rooms.names]
    return rooms, scenes


def walls(scene):
    return [item.mesh.vertices.tolist() for item in scene.objects[:WALLS]]


def pieces(scene):
    return [(item.name, item.mesh.vertices.tolist()) for item in scene.objects[WALLS:]]


@pytest.mark.parametrize(
    ("setting", "same_walls", "same_pieces"), [("same", 1, 1), ("furniture", 1, 0), ("layout", 0, 0)]
)
def test_what_differs_between_rooms(tmp_path, setting, same_walls, same_pieces):
    rooms, (first, second) = made(tmp_path, setting)
    assert (walls(first) == walls(second)) == same_walls
    assert (pieces(first) == pieces(second)) == same_pieces
    assert (first.gateway == second.gateway) == same_walls
    one, other = rooms
    assert not np.isin(one.positions, other.positions).any() and one.responses.shape == (4, 16)
    assert (rooms.folder / "rooms.png").stat().st_size > 1000
    assert read_rooms(rooms.folder) == rooms


def test_every_second_layout_is_l_shaped(tmp_path):
    _, (first, second) = made(tmp_path, "layout", shape="both")
    assert len(first.objects[0].mesh.faces) == 2 and len(second.objects[0].mesh.faces) == 4


def test_the_same_call_finishes_a_folder_and_another_is_refused(tmp_path):
    rooms, _ = made(tmp_path, "layout")
    picture = rooms.folder / "room-001" / "spectrum" / "00002.png"
    content = picture.read_bytes()
    picture.unlink()
    made(tmp_path, "layout")
    assert picture.read_bytes() == content
    with pytest.raises(bisplat.InputError, match=r"expected .* an earlier folder of rooms with seed 1, found"):
        made(tmp_path, "layout", seed=1)
    with pytest.raises(bisplat.InputError, match=r"with rooms .*'room-002'"):
        bisplat.simulate_rooms(rooms.folder, 3, "layout", spectra=4, propagation=SIGHT)
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "file").write_text("precious")
    with pytest.raises(bisplat.InputError, match="expected a new folder"):
        bisplat.simulate_rooms(tmp_path / "other", 1)
    assert [path.name for path in (tmp_path / "other").iterdir()] == ["file"]


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"rooms": ["../elsewhere"]}, "expected the names of rooms"),
        ({"setting": "x"}, "found 'x'"),
        ({"rooms": ["room-007"]}, "room-007: expected a room, found none"),
    ],
)
def test_a_wrong_description_is_refused(tmp_path, change, sentence):
    facts = {"setting": "same", "rooms": ["room-000"]} | change
    (tmp_path / "rooms.json").write_text(json.dumps(facts))
    with pytest.raises(bisplat.InputError, match=sentence):
        read_rooms(tmp_path)
