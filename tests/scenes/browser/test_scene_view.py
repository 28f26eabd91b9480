"""A scene as viser nodes: what is transparent, and where the camera of a page stands."""

import numpy as np
from viser import ViserServer

from scenes.browser.scene_view import WALL_OPACITY, add_objects, add_region
from scenes.places.built_in import lab


def test_walls_are_glass_and_every_object_is_drawn():
    scene = lab()
    server = ViserServer(host="127.0.0.1", port=8610, verbose=False)
    try:
        nodes = add_objects(server.scene, scene)
        add_region(server.scene, np.array([[0, 0, 0], [1, 1, 1]]))
        triangles = sum(len(node.faces) for node in (*nodes["walls"], *nodes["furniture"]))
        opacity = {group: {node.opacity for node in each} for group, each in nodes.items()}
        outer = {node.name for node in nodes["walls"]}
    finally:
        server.stop()
    assert triangles == scene.triangles and {"/walls/ceiling", "/walls/floor"} <= outer
    assert opacity == {"walls": {WALL_OPACITY}, "furniture": {None}}
