"""The room in 3D: what stands in it, recorded positions, and checkboxes that hide each layer."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from jaxtyping import Float, UInt8
from scipy.spatial import cKDTree
from viser import ClientHandle, GuiInputHandle, PointCloudHandle, SceneNodeHandle

from learn.view.subject import Subject
from scenes.browser.scene_view import GATEWAY, add_gateway, add_objects, add_region, set_up
from scenes.browser.served_page import shield
from scenes.scene.shapes import bounding_box

PLANNED, TRANSMITTER, POSITION = (200, 0, 200), (255, 210, 0), (110, 110, 130)
"""RGB of planned positions, of the transmitter, and of recorded positions without a score."""


class RoomView:
    """The 3D view of a tab. ``changed`` asks for the tab to be drawn anew."""

    def __init__(self, client: ClientHandle, subject: Subject, changed: Callable[[], None]):
        self.client, self.subject, self.shield, self._changed = client, subject, partial(shield, client), changed
        bounds = [] if subject.scene is None else [subject.scene.bounds]
        whole = bounding_box(np.vstack([subject.region, subject.gateways, *bounds]))
        self.size = float(np.linalg.norm(whole[1] - whole[0])) or 1.0  # length of the diagonal, metres
        set_up(client, whole)

    def add_layers(self) -> None:
        """Draw what stands in the room, with the checkboxes that hide it, in the folder of the control panel."""
        subject, api = self.subject, self.client.scene
        objects = {} if subject.scene is None else add_objects(api, subject.scene)
        labels: list[SceneNodeHandle] = []
        self.gateway: Any  # the frame of the array, or the dots of antennas of one element each
        if subject.gateway is not None:
            self.gateway = add_gateway(api, subject.gateway, subject.wavelength, 0.07 * self.size)
        else:
            assert subject.dataset is not None
            self.gateway = self.add_dots("/gateways", subject.gateways, GATEWAY, 0.014)
            for name, place in zip(subject.dataset.gateway_names, subject.gateways, strict=True):
                labels.append(api.add_label(f"/names/{len(labels)}", name, position=place))
        if subject.array_moves:
            stands = tuple(subject.gateways[0])
            api.add_icosphere("/standing", radius=0.008 * self.size, color=TRANSMITTER, position=stands)
        places = np.zeros((0, 3)) if subject.dataset is None else subject.dataset.positions
        apart = 1.0
        if len(places) > 1:  # smaller where they are dense, so that a map shows between them
            apart = float(np.median(cKDTree(places).query(places, k=2)[0][:, 1])) / self.size
        dot = float(np.clip(0.3 * apart, 0.001, 0.004))
        self.switch("walls, floor, ceiling", objects.get("walls", []))
        self.switch("furniture", objects.get("furniture", []))
        self.switch("gateways", [self.gateway, *labels] if labels else [])
        what = "receiver region" if subject.array_moves else "transmitter region"
        self.switch(what, [add_region(api, subject.region)])
        self._rows = []
        for what, rows, size in (("training", subject.known, dot), ("test", subject.tested, 1.5 * dot)):
            if len(rows):
                self._rows.append((self.add_dots(f"/{what}", places[rows], POSITION, size), rows))
                self.switch(f"{what} positions", [self._rows[-1][0]])
        if subject.planned is not None:
            planned = self.add_dots("/planned", subject.planned, PLANNED, 0.008)
            self.switch(f"planned positions ({len(subject.planned)})", [planned])

    def redraw_on(self, *controls: GuiInputHandle) -> None:
        """Show the position anew when one of the controls changes."""
        for each in controls:
            each.on_update(self.shield(lambda event: self._changed()))

    def add_dots(
        self, name: str, positions: Float[np.ndarray, "n 3"], colours: tuple[int, int, int] | np.ndarray, size: float
    ) -> PointCloudHandle:
        """Draw round dots, whose size is relative to that of the whole."""
        colours = np.broadcast_to(np.asarray(colours, np.uint8), positions.shape)
        style = {"point_size": size * self.size, "point_shape": "circle", "point_shading": "flat"}
        return self.client.scene.add_point_cloud(name, positions.astype(np.float32), colours, **style)  # type: ignore[arg-type]

    def switch(self, label: str, nodes: Sequence[SceneNodeHandle]) -> None:
        """Add a checkbox that shows and hides nodes; none if there are no nodes."""
        if nodes:
            box = self.client.gui.add_checkbox(label, nodes[0].visible)

            @box.on_update
            @self.shield
            def _(event) -> None:
                for node in nodes:
                    node.visible = box.value

    def colour_rows(self, colours: UInt8[np.ndarray, "K 3"]) -> None:
        """Colour the recorded positions, each of which has a row."""
        for dots, rows in self._rows:
            dots.colors = colours[rows]
