"""What may be wrong with a scene, and scenes that differ by it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scenes.files.errors import ParameterError
from scenes.places.built_in import closet
from scenes.scene.description import SceneObject
from scenes.scene.shapes import box
from scenes.scene.tolerances import Tolerances
from scenes.scene.unknowns import Unknown, movable, unknowns, vary
from scenes.storage.scene_yaml import load_scene
from tests.small_scene import CABINET, small_scene


def test_walls_stay_and_conductors_have_no_properties():
    labels = [each.label for each in unknowns(closet(), Tolerances(carrier=0.01))]
    assert labels[:7] == [
        *("gateway x", "gateway y", "gateway z"),
        *("gateway rotation about x", "gateway rotation about y", "gateway rotation about z", "frequency"),
    ]
    assert {"panel x", "shelf y", "brick thickness", "wood relative permittivity"} <= set(labels)
    assert not any(label.startswith(("wall", "floor", "door", "metal")) for label in labels)


def test_columns_and_inner_walls_stay():
    labels = {each.name for each in unknowns(load_scene("office"), Tolerances()) if each.kind == "object"}
    assert {"duct", "desk 1 south", "partition 1 south"} <= labels
    assert not any(label.startswith(("column", "glass", "wall")) for label in labels)


def test_in_the_open_everything_that_stands_on_the_floor_moves():
    assert movable(small_scene(CABINET)) == [1]
    low = SceneObject("low", box((4.0, 1.5, 0.001), (5.0, 2.0, 1.0)), "metal")
    assert movable(small_scene(low, replace(low, name="other", mesh=box((6.0, 1.5, 0.001), (7.0, 2.0, 1.0))))) == [1, 2]


def test_nothing_that_is_known_is_unknown():
    assert unknowns(closet(), Tolerances(0, 0, 0, 0, 0)) == []
    with pytest.raises(ParameterError, match="objects"):
        Tolerances(objects=-1)


def test_changes_are_those_asked_for():
    scene = closet()
    which = [
        Unknown("position", "", 2, 1),
        Unknown("rotation", "", 2, 1),
        Unknown("frequency", "", 0, 1),
        Unknown("object", "panel", 0, 1),
        Unknown("thickness", "wood", 0, 1),
        Unknown("relative_permittivity", "brick", 0, 1),
    ]
    other = vary(scene, which, np.array([0.02, np.pi / 2, np.log(1.01), -0.05, np.log(2), np.log(0.01)]))
    np.testing.assert_allclose(np.subtract(other.gateway.position, scene.gateway.position), [0, 0, 0.02])
    turn = Rotation.from_quat(other.gateway.orientation) * Rotation.from_quat(scene.gateway.orientation).inv()
    np.testing.assert_allclose(turn.as_rotvec(), [0, 0, np.pi / 2], atol=1e-12)
    assert other.frequency == pytest.approx(1.01 * scene.frequency)
    assert other.gateway.spacing * other.wavelength == pytest.approx(scene.gateway.spacing * scene.wavelength)
    before, after = ({item.name: item for item in each.objects} for each in (scene, other))
    np.testing.assert_allclose(after["panel"].mesh.bounds - before["panel"].mesh.bounds, [[-0.05, 0, 0]] * 2)
    assert after["table"] == before["table"]
    assert after["door"].thickness == 2 * before["door"].thickness  # its own, of wood
    assert other.materials["wood"].thickness == 2 * scene.materials["wood"].thickness
    assert other.materials["brick"].relative_permittivity == 1  # of air, the least there is


def test_no_change_is_the_same_scene():
    which = unknowns(closet(), Tolerances())
    same = vary(closet(), which, np.zeros(len(which)))
    assert same.objects == closet().objects and same.materials == closet().materials
    np.testing.assert_allclose(same.gateway.orientation, closet().gateway.orientation, atol=1e-15)
