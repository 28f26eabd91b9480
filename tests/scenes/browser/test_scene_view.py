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
        triangles = {name: sum(len(node.faces) for node in parts) for name, parts in nodes.items()}
        opacity = {name: [node.opacity for node in parts] for name, parts in nodes.items()}
    finally:
        server.stop()
    assert triangles == {item.name: len(item.mesh.faces) for item in scene.objects}
    assert opacity["ceiling"] == opacity["floor"] == [WALL_OPACITY]
    assert [None] in opacity.values()
