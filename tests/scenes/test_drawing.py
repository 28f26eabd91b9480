"""The picture shows something and the description is plain data."""

import json
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.image import imread

from scenes.description import SceneObject
from scenes.drawing import describe_scene, draw_scene
from scenes.materials import p2040_material
from scenes.scene_yaml import load_scene
from scenes.shapes import box, sheet


def colored(image, color):
    return np.mean(np.all(np.abs(image[..., :3] - np.array(color)) < 0.02, axis=-1))


def test_lab_is_drawn(tmp_path):
    lab = load_scene("lab")
    draw_scene(lab, tmp_path / "lab.png")
    image = imread(tmp_path / "lab.png")
    assert image.shape[1] > image.shape[0] > 500
    assert colored(image, lab.materials["concrete"].color) > 0.1  # the floor, seen from above: no ceiling
    assert colored(image, lab.materials["wood"].color) > 0.005


def share(image, color):
    """Share of the picture in this hue, however it is shaded."""
    pixels = image[..., :3] / np.linalg.norm(image[..., :3], axis=-1, keepdims=True).clip(1e-6)
    return np.mean(pixels @ (np.array(color) / np.linalg.norm(color)) > 0.9995)


def test_one_can_look_in(scene, tmp_path):
    """The ceiling and the near walls are left out, whether the room is one mesh or many."""
    materials = {name: p2040_material(name, 915e6) for name in ("brick", "marble", "metal", "wood")}
    crate = SceneObject("crate", box((-3, -3, 0.1), (-1, -1, 1)), "wood")
    sheets = (
        SceneObject("floor", sheet((-5, -5, 0), (10, 0, 0), (0, 10, 0)), "marble"),
        SceneObject("ceiling", sheet((-5, -5, 3), (10, 0, 0), (0, 10, 0)), "metal"),
        SceneObject("near", sheet((-5, -5, 0), (10, 0, 0), (0, 0, 3)), "brick"),
    )
    draw_scene(replace(scene, objects=(*sheets, crate), materials=materials), tmp_path / "many.png")
    image = imread(tmp_path / "many.png")
    assert share(image, materials["metal"].color) < 0.01 and share(image, materials["brick"].color) < 0.01

    shell = SceneObject("room", box((-5, -5, -0.01), (5, 5, 3)), "brick")
    draw_scene(replace(scene, objects=(shell, crate), materials=materials), tmp_path / "one.png")
    for file in ("many.png", "one.png"):
        assert share(imread(tmp_path / file), materials["wood"].color) > 0.003


def test_description_is_json(scene):
    description = json.loads(json.dumps(describe_scene(scene)))
    assert description["frequency"] == 915e6
    assert description["bounds"] == {"min": [-5, -5, 0], "max": [5, 5, 0.3333]}
    assert description["gateway"]["boresight"] == [-1, 0, 0]
    floor, crate = description["objects"]
    assert floor == {
        "name": "floor",
        "material": "concrete",
        "size": [10, 10, 0],
        "triangles": 2,
        "closed": False,
    }
    assert crate["closed"] and crate["triangles"] == 12
    wood = description["materials"][1]
    assert wood["name"] == "wood" and wood["relative_permittivity"] == pytest.approx(1.99)
