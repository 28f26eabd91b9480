"""A scene as viser nodes: what is transparent, and where the camera of a page stands."""

import numpy as np
from viser import ViserServer

import scenes.browser.scene_view
from scenes.browser.scene_view import add_objects, add_region, wxyz, xyzw
from scenes.places.built_in import lab


def test_quaternions_go_there_and_back():
    assert xyzw(np.array(wxyz((0.1, 0.2, 0.3, 0.9)))) == (0.1, 0.2, 0.3, 0.9)


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
    assert opacity["ceiling"] == opacity["floor"] == [scenes.browser.scene_view.WALL_OPACITY]
    assert [None] in opacity.values()
