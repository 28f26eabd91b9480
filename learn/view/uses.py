"""Layers of the viewer for uses of a run: its standard deviation, located transmitters, and planned positions."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from viser import ClientHandle, SceneNodeHandle

from learn.localisation.located_places import read_places
from learn.localisation.refine import grid_in
from learn.reports.plots import MAGNITUDE
from learn.view.chart import Colours, colour_of
from learn.view.room_layers import add_dots, add_planned, switch
from learn.view.subject import Subject
from scenes.browser.served_page import shield
from scenes.files.errors import InputError

CLOUD = 1200
"""Number of positions in the region at which the standard deviation is drawn."""

LOCATED = (230, 120, 0)

LOCATIONS = "evaluation/locations.csv"
"""File in a run folder, written by ``bisplat evaluate --locate``."""


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
