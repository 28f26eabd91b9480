"""Layers of the viewer about uses of a field."""

import json

import numpy as np
import pytest

import bisplat
from learn.localisation.located_places import NEW, Located, Place, read_places
from learn.view.run_layers import CLOUD, LOCATIONS, cloud, located
from learn.view.subject import subject
from scenes.files.errors import InputError


@pytest.fixture(scope="module")
def run(tmp_path_factory, write_folder):
    folder = tmp_path_factory.mktemp("uses")
    return bisplat.train(write_folder(folder / "data", 150), folder / "run", model="mlp", steps=2)


def test_cloud_fills_the_region_of_the_known_positions(run):
    shown = subject(str(run.folder))
    positions, deviations = cloud(shown)
    np.testing.assert_allclose([positions.min(axis=0), positions.max(axis=0)], shown.known_region)
    assert CLOUD / 3 < len(positions) < 3 * CLOUD
    np.testing.assert_allclose(deviations, run.deviation(positions))


def test_what_a_run_does_not_say_has_no_layer(run):
    shown = subject(run.config.dataset)
    assert cloud(shown) is None and located(shown) is None and shown.planned is None
    path = run.folder / "training.json"
    before = path.read_text()
    path.write_text(json.dumps({**json.loads(before), "deviation": None}))
    assert cloud(subject(str(run.folder))) is None
    path.write_text(before)


def test_lines_go_from_true_to_located_positions(run):
    shown = subject(str(run.folder))
    assert located(shown) is None
    places = [
        [Place(np.array([1.0, 2.0, number]), np.eye(3), 0.9, 0.1), Place(np.zeros(3), np.eye(3), 0.1, 0.2)]
        for number in (0.0, 1.0)
    ]
    path = run.folder / LOCATIONS
    path.parent.mkdir()
    Located(places, ["00003", "00008"], [NEW] * 2).write(path)
    lines = located(shown)
    np.testing.assert_allclose(lines[:, 0], shown.dataset.positions[[2, 7]])
    np.testing.assert_allclose(lines[:, 1], [[1, 2, 0], [1, 2, 1]])


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        (lambda text: text.replace("probability", "chance"), "line 1: expected the header"),
        (lambda text: text.replace("1.0000,2.0000", "a,b"), "line 2: expected a position"),
    ],
)
def test_damaged_places_are_refused(changed, message, tmp_path):
    path = tmp_path / "places.csv"
    Located([[Place(np.array([1.0, 2.0, 3.0]), np.eye(3), 1.0, 0.0)]], ["00001"], [NEW]).write(path)
    np.testing.assert_allclose(read_places(path)["00001"], [1, 2, 3])
    path.write_text(changed(path.read_text()))
    with pytest.raises(InputError, match=message):
        read_places(path)
