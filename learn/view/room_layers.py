"""Layers that several tabs have: the room, the transmitter, positions, and what a run says of uses of its field."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, UInt8
from viser import ClientHandle, PointCloudHandle, SceneNodeHandle, TransformControlsHandle

from learn.localisation.located_places import read_places
from learn.localisation.place_search import grid_in
from learn.reports.plots import MAGNITUDE
from learn.view.chart import Colours, colour_of
from learn.view.subject import Subject
from scenes.browser.scene_view import add_objects
from scenes.browser.served_page import shield
from scenes.files.errors import InputError
from scenes.scene.description import Scene

PLANNED, TRANSMITTER = (200, 0, 200), (255, 210, 0)  # RGB of planned positions and of the transmitter


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


CLOUD = 1200  # Number of positions in the region at which the standard deviation is drawn

LOCATED = (230, 120, 0)

LOCATIONS = "evaluation/locations.csv"  # File in a run folder, written by ``bisplat evaluate --locate``


class Cloud(NamedTuple):
    """Standard deviations over the region."""

    positions: Float[np.ndarray, "n 3"]  # metres, world frame
    deviations: Float[np.ndarray, " n"]  # standard deviations of a spectrum's values, 0…1


def cloud(subject: Subject) -> Cloud | None:
    """Standard deviations of the run over the region of its known positions. None: the run states none."""
    run, region = subject.run, subject.known_region
    if run is None or region is None or run.deviation(region[:1]) is None:
        return None
    spacing = float(np.prod(np.maximum(region[1] - region[0], 1e-3)) / CLOUD) ** (1 / 3)
    positions = grid_in(region, spacing, CLOUD)
    deviations = run.deviation(positions)
    assert deviations is not None
    return Cloud(positions, deviations)


def located(subject: Subject) -> Float[np.ndarray, "K 2 3"] | None:
    """Lines from true to located positions of test transmitters. None: none have been located."""
    if subject.run is None or subject.dataset is None:
        return None
    path = subject.run.folder / LOCATIONS
    if not path.exists():
        return None
    index = {name: number for number, name in enumerate(subject.dataset.names)}
    found = [(index[name], position) for name, position in read_places(path).items() if name in index]
    if not found:
        return None
    return np.array([[subject.dataset.positions[number], position] for number, position in found])


def add_uses(client: ClientHandle, subject: Subject, size: float) -> None:
    """Draw the layers that the subject has, each with its checkbox."""
    add_planned(client, subject.planned, size)
    lines = shield(client, located)(subject)
    if lines is not None:
        errors = client.scene.add_line_segments(
            "/located/errors", lines.astype(np.float32), LOCATED, thickness=2, thickness_units="screen"
        )
        colours = np.full(lines[:, 1].shape, LOCATED, np.uint8)
        places = add_dots(client, "/located/places", lines[:, 1], colours, 0.005 * size)
        switch(client, f"located transmitters, with errors ({len(lines)})", [errors, places])
    if subject.run is not None:
        _add_cloud(client, subject, size)


def _add_cloud(client: ClientHandle, subject: Subject, size: float) -> None:
    """A checkbox for the cloud of standard deviations, which are computed when it is first drawn."""
    box = client.gui.add_checkbox("standard deviation of the prediction (yellow: large)", False)
    drawn: list[SceneNodeHandle] = []

    @box.on_update
    @partial(shield, client)
    def _(event) -> None:
        if box.value and not drawn:
            found = cloud(subject)
            if found is None:
                raise InputError("expected a run that states its standard deviation, found one that does not")
            scale = Colours(MAGNITUDE, float(found.deviations.min()), float(found.deviations.max()) + 1e-9, "")
            colours = colour_of(found.deviations, scale)
            drawn.append(add_dots(client, "/deviation", found.positions, colours, 0.003 * size))
            box.label = f"standard deviation ({scale.low:.3f} to {scale.high:.3f}; yellow: large)"
        for node in drawn:
            node.visible = box.value
