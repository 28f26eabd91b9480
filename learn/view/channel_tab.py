"""One browser tab of channels over subcarriers (CSI): the delay profile of each row, and where its client was.

The uplink and the downlink are shown as one band.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import UInt8
from viser import ClientHandle, GuiImageHandle

from learn.view.delay_chart import delay_profile, draw_delays
from learn.view.room_layers import add_dots, add_planned, add_transmitter, switch
from learn.view.subject import Position
from learn.view.tab import AT_A_POSITION, Tab
from scenes.browser.scene_view import GATEWAY, set_up
from scenes.files.errors import InputError
from scenes.files.plain_text import in_markdown
from scenes.scene.shapes import bounding_box
from simulate.csi.csi_dataset import CsiDataset

WIDTH = 500
"""Width of the panel, pixels."""


def require_places_and_band(dataset: CsiDataset) -> None:
    """Refuse channels that the viewer cannot show."""
    if dataset.positions is None:
        raise InputError(f"{dataset.folder / 'tx_pos.csv'}: expected the positions of the client, found no such file")
    if dataset.band is None:
        stated = "expected the entry band, without which delays are unknown, found none"
        raise InputError(f"{dataset.folder / 'metadata.json'}: {stated}")


class ChannelTab(Tab):
    """The control panel and the 3D view of a tab that shows channels."""

    def __init__(self, client: ClientHandle, dataset: CsiDataset, planned: np.ndarray | None):
        assert dataset.positions is not None
        super().__init__(client, dataset.positions, dataset.positions[0])
        self._dataset = dataset
        self._image: GuiImageHandle | None = None
        self._build("row")
        whole = bounding_box(np.vstack([dataset.positions, dataset.antenna_positions]))
        size = float(np.linalg.norm(whole[1] - whole[0])) or 1.0
        set_up(client, whole)
        antennas, places = dataset.antenna_positions, dataset.positions
        marks = add_dots(client, "/antennas", antennas, np.full(antennas.shape, GATEWAY, np.uint8), 0.006 * size)
        rows = add_dots(client, "/rows", places, np.full(places.shape, 110, np.uint8), 0.005 * size)
        with self._gui.add_folder("Layers"):
            switch(client, "antennas", [marks])
            switch(client, "positions of the rows", [rows])
            add_planned(client, planned, size)
        self._begin(add_transmitter(client, self._position, size))

    def _show(self, position: Position) -> None:
        assert self._dataset.positions is not None
        index = self._recorded_at(position)
        if index is None:
            index = int(np.linalg.norm(self._dataset.positions - position, axis=1).argmin())
        panel, words = self._profile(index)
        distance = float(np.linalg.norm(self._dataset.positions[index] - position))
        near = "" if distance < AT_A_POSITION else f", the nearest one, {distance:.2f} m from the transmitter"
        self._numbers.content = in_markdown(f"Row {index + 1}{near} (number {index} in files): {words}")
        if self._image is None:
            self._image = self._gui.add_image(panel, format="png", order=-3)
        else:
            self._image.image = panel

    def _profile(self, index: int) -> tuple[UInt8[np.ndarray, "H W 3"], str]:
        """The panel of a row, and its strongest delay in words."""
        band = self._dataset.band
        assert band is not None
        whole = np.concatenate([self._dataset.uplink[index], self._dataset.downlink[index]], axis=-1)
        profile = delay_profile(whole.astype(complex), band)
        title = f"power over delay, row {index + 1}, mean of {len(whole)} antennas"
        peak = 1e9 * profile.delays[profile.decibels.argmax()]
        return draw_delays(title, profile, WIDTH), f"strongest delay {peak:.4g} ns"
