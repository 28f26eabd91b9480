"""Show a scene in a browser with viser: objects in the colours of their materials, gateways, transmitter region."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation
from viser import ClientHandle, FrameHandle, LineSegmentsHandle, SceneApi, SceneNodeHandle

from scenes.checks.enclosure import enclosing
from scenes.drawing.perspective import box_edges
from scenes.scene.antennas import Gateway
from scenes.scene.description import Scene
from scenes.scene.orientation import Quaternion

GATEWAY, REGION = (220, 20, 60), (40, 160, 80)
WALL_OPACITY = 0.18  # Opacity of floor, walls and ceiling, so that the inside is visible from outside

FIELD_OF_VIEW = 45.0  # Vertical field of view of the camera, degrees


def wxyz(orientation: Quaternion) -> tuple[float, float, float, float]:
    """Convert a quaternion from SciPy's order to viser's."""
    x, y, z, w = orientation
    return w, x, y, z


def xyzw(orientation: np.ndarray) -> Quaternion:
    """Convert a quaternion from viser's order to SciPy's."""
    w, x, y, z = (float(c) for c in orientation)
    return x, y, z, w


def add_objects(api: SceneApi, scene: Scene) -> dict[str, list[SceneNodeHandle]]:
    """Draw the objects. Return the nodes of "walls" and "furniture"."""
    nodes: dict[str, list[SceneNodeHandle]] = {"walls": [], "furniture": []}
    for item in scene.objects:
        colour = np.array(scene.materials[item.material].color)
        encloses = enclosing(scene, item, item.mesh.triangles)
        for group, chosen, opacity in (("walls", encloses, WALL_OPACITY), ("furniture", ~encloses, None)):
            if chosen.any():
                corners = np.asarray(item.mesh.triangles[chosen], np.float32).reshape(-1, 3)
                nodes[group].append(
                    api.add_mesh_simple(
                        f"/{group}/{item.name}",
                        corners,
                        np.arange(len(corners), dtype=np.uint32).reshape(-1, 3),
                        color=colour,
                        opacity=opacity,
                        flat_shading=True,
                        side="double",
                        cast_shadow=False,
                        receive_shadow=False,
                    )
                )
    return nodes


def add_gateway(api: SceneApi, gateway: Gateway, wavelength: float, size: float, name: str = "/gateway") -> FrameHandle:
    """Draw a gateway as a plate of the array's size, or its elements at given positions, with an arrow along its
    boresight.
    """
    frame = api.add_frame(
        name, wxyz=wxyz(gateway.orientation), position=gateway.position, axes_length=size / 3, axes_radius=size / 120
    )
    if gateway.elements is None:
        pitch = gateway.spacing * wavelength
        plate = (gateway.columns * pitch, gateway.rows * pitch, 0.01)
        api.add_box(f"{name}/array", color=GATEWAY, dimensions=plate, opacity=0.5, cast_shadow=False)
    else:
        places = np.array(gateway.elements, np.float32)
        api.add_point_cloud(f"{name}/array", places, GATEWAY, point_size=size / 30, point_shape="circle")
    arrow = np.array([[[0, 0, 0], [0, 0, size]]], np.float32)
    api.add_arrows(f"{name}/boresight", arrow, GATEWAY, shaft_radius=size / 60, head_radius=size / 25)
    return frame


def add_region(api: SceneApi, region: Float[np.ndarray, "2 3"], name: str = "/region") -> LineSegmentsHandle:
    return api.add_line_segments(name, box_edges(region), REGION, thickness=2, thickness_units="screen")


def from_outside(bounds: Float[np.ndarray, "2 3"]) -> tuple[np.ndarray, np.ndarray]:
    """Return the position of a camera that sees a whole box, and the point that it looks at, metres."""
    low, high = bounds
    size = float(np.linalg.norm(high - low))
    direction = Rotation.from_euler("ZY", [-125.0, -45.0], degrees=True).apply([1, 0, 0])  # from low x and low y
    return (low + high) / 2 + 1.3 * size * direction, (low + high) / 2


def set_up(client: ClientHandle, bounds: Float[np.ndarray, "2 3"]) -> None:
    """Set up the light, the panel and the camera of a tab, with the whole box in view."""
    client.scene.set_up_direction("+z")
    client.scene.configure_default_lights(cast_shadow=False)
    style: dict[str, Any] = {"control_layout": "fixed", "control_width": "large"}
    client.gui.configure_theme(show_logo=False, show_share_button=False, **style)
    client.camera.fov = np.radians(FIELD_OF_VIEW)
    client.camera.position, client.camera.look_at = from_outside(bounds)
