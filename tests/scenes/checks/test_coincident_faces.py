"""Triangles that are drawn twice are found, whatever the order of their corners."""

from dataclasses import replace

import numpy as np
from trimesh import Trimesh

from scenes.importing.drawn_walls import drawn_twice
from scenes.scene.description import SceneObject
from scenes.scene.shapes import box, sheet
from tests.small_scene import small_scene

WALL = sheet((1, -1, 0.1), (0, 2, 0), (0, 0, 2))


def test_twins_are_counted_within_and_between_objects():
    turned = Trimesh(WALL.vertices + 1e-6, WALL.faces[:, ::-1], process=False)
    both_sides = Trimesh(WALL.vertices, np.vstack([WALL.faces, WALL.faces[:, [2, 0, 1]]]), process=False)
    beside = WALL.copy().apply_translation((0.01, 0, 0))
    objects = [
        SceneObject(name, mesh, "concrete") for name, mesh in (("wall", WALL), ("paint", turned), ("other", beside))
    ]
    assert drawn_twice(small_scene(*objects)) == {("wall", "paint"): 2}
    assert drawn_twice(small_scene(SceneObject("wall", both_sides, "concrete"))) == {("wall", "wall"): 2}


def test_metal_on_metal_is_one_conductor():
    scene = small_scene(*(SceneObject(name, box((1, 1, 0.1), (2, 2, 1)), "metal") for name in "ab"))
    assert drawn_twice(scene) == {}
    coated = (*scene.objects[:-1], replace(scene.objects[-1], material="concrete"))
    assert drawn_twice(replace(scene, objects=coated)) == {("a", "b"): 12}


def test_triangles_with_the_same_centre_are_no_twins():
    angles = np.linspace(0, 2 * np.pi, 3, endpoint=False)
    meshes = []
    for turn in np.linspace(0, 2, 50):
        corners = np.stack([2 + np.cos(angles + turn), np.sin(angles + turn), np.ones(3)], axis=1)
        meshes.append(Trimesh(corners.round(3), [[0, 1, 2]], process=False))
    assert drawn_twice(small_scene(*(SceneObject(f"t{k}", mesh, "concrete") for k, mesh in enumerate(meshes)))) == {}
