"""Layers of a run: how sure its predictions are over the region, and transmitters that were located with it."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from viser import SceneNodeHandle

from learn.localisation.located_places import read_places
from learn.localisation.place_search import grid_in
from learn.reports.plots import MAGNITUDE
from learn.view.chart import Colours, colour_of
from learn.view.room_view import RoomView
from learn.view.subject import Subject
from scenes.files.errors import InputError

CLOUD = 1200  # Number of positions in the region at which the standard deviation is drawn

LOCATED = (230, 120, 0)

LOCATIONS = "evaluation/locations.csv"  # File in a run folder, written by ``bisplat evaluate --locate``


def cloud(subject: Subject) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, " n"]] | None:
    """Positions over the region of the known ones, metres, and the run's standard deviations there. None: no such."""
    run, region = subject.run, subject.known_region
    if run is None or region is None or run.deviation(region[:1]) is None:
        return None
    spacing = float(np.prod(np.maximum(region[1] - region[0], 1e-3)) / CLOUD) ** (1 / 3)
    positions = grid_in(region, spacing, CLOUD)
    deviations = run.deviation(positions)
    assert deviations is not None
    return positions, deviations


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


def add_located(view: RoomView) -> None:
    """Draw located transmitters with their errors, if there are any."""
    lines = located(view.subject)
    if lines is not None:
        errors = view.client.scene.add_line_segments(
            "/located/errors", lines.astype(np.float32), LOCATED, thickness=2, thickness_units="screen"
        )
        places = view.add_dots("/located/places", lines[:, 1], LOCATED, 0.005)
        view.switch(f"located transmitters, with errors ({len(lines)})", [errors, places])


def add_cloud(view: RoomView) -> None:
    """Add a checkbox for the cloud of standard deviations, which are computed when it is first drawn."""
    box = view.client.gui.add_checkbox("standard deviation of the prediction (yellow: large)", False)
    drawn: list[SceneNodeHandle] = []

    @box.on_update
    @view.shield
    def _(event) -> None:
        if box.value and not drawn:
            found = cloud(view.subject)
            if found is None:
                raise InputError("expected a run that states its standard deviation, found one that does not")
            positions, deviations = found
            scale = Colours(MAGNITUDE, float(deviations.min()), float(deviations.max()) + 1e-9, "")
            drawn.append(view.add_dots("/deviation", positions, colour_of(deviations, scale), 0.003))
            box.label = f"standard deviation ({scale.low:.3f} to {scale.high:.3f}; yellow: large)"
        for node in drawn:
            node.visible = box.value
