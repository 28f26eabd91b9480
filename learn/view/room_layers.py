"""What every 3D view of the viewer has: the room, a movable transmitter, dots, and checkboxes that hide them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from jaxtyping import Float, UInt8
from viser import ClientHandle, PointCloudHandle, SceneNodeHandle, TransformControlsHandle

from scenes.browser.scene_view import add_objects
from scenes.browser.served_page import shield
from scenes.scene.description import Scene

PLANNED, TRANSMITTER = (200, 0, 200), (255, 210, 0)
"""RGB of planned positions and of the transmitter."""


def add_room(client: ClientHandle, scene: Scene | None) -> tuple[list[SceneNodeHandle], list[SceneNodeHandle]]:
    """Draw a scene."""
    nodes = [] if scene is None else [node for each in add_objects(client.scene, scene).values() for node in each]
    walls = [node for node in nodes if node.name.startswith("/walls")]
    return walls, [node for node in nodes if not node.name.startswith("/walls")]


def add_transmitter(
    client: ClientHandle,
    position: Float[np.ndarray, " 3"],
    size: float,
    colour: tuple[int, int, int] = TRANSMITTER,
) -> TransformControlsHandle:
    """Draw the transmitter with the arrows by which it is dragged."""
    handle = client.scene.add_transform_controls(
        "/transmitter", scale=0.1 * size, disable_rotations=True, depth_test=False, position=position
    )
    client.scene.add_icosphere("/transmitter/tag", radius=0.008 * size, color=colour)
    return handle


def add_dots(
    client: ClientHandle, name: str, positions: Float[np.ndarray, "n 3"], colours: UInt8[np.ndarray, "n 3"], size: float
) -> PointCloudHandle:
    """Draw round dots of a size in metres."""
    return client.scene.add_point_cloud(
        name, positions.astype(np.float32), colours, point_size=size, point_shape="circle", point_shading="flat"
    )


def add_planned(client: ClientHandle, planned: Float[np.ndarray, "n 3"] | None, size: float) -> None:
    """Draw planned positions with their checkbox."""
    if planned is not None:
        dots = add_dots(client, "/planned", planned, np.full(planned.shape, PLANNED, np.uint8), 0.008 * size)
        switch(client, f"planned positions ({len(planned)})", [dots])


def switch(client: ClientHandle, label: str, nodes: Sequence[SceneNodeHandle]) -> None:
    """Add a checkbox that shows and hides nodes; none if there are no nodes."""
    if nodes:
        box = client.gui.add_checkbox(label, nodes[0].visible)

        @box.on_update
        @partial(shield, client)
        def _(event) -> None:
            for node in nodes:
                node.visible = box.value
