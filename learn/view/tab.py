"""The tab of the viewer: a transmitter that the user moves about the room, and the panels of what is measured there.

The transmitter is dragged, typed, or put at a recorded position, one after the other if the recorded path is played. A
thread shows what is at its position.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from jaxtyping import Float, UInt8
from scipy.spatial import cKDTree
from viser import ClientHandle, GuiInputHandle, PointCloudHandle, SceneNodeHandle, TransformControlsEvent

from learn.view.delay_panel import DelayPanel
from learn.view.panel import POSITION, Panel, ValuesPanel
from learn.view.power_panel import PowerPanel
from learn.view.run_layers import add_cloud, add_located
from learn.view.spectrum_panel import SpectrumPanel
from learn.view.subject import Position, Subject
from learn.view.tracing import Traced, Tracing
from scenes.browser.moved_antennas import MovedAntennas
from scenes.browser.scene_view import GATEWAY, add_gateway, add_objects, add_region, set_up
from scenes.browser.served_page import shield
from scenes.files.plain_text import in_markdown
from scenes.scene.shapes import bounding_box

PANELS: dict[str, type[Panel]] = {
    "spectrum": SpectrumPanel,
    "response": DelayPanel,
    "retrieved": DelayPanel,
    "power": PowerPanel,
    "channel": DelayPanel,
}
"""The panel of each quantity by its name. A quantity that is not here has a ``ValuesPanel``."""

PLAY_SECONDS = 0.4  # Time between two positions when the recorded path is played, seconds

AT_A_POSITION = 1e-4
"""Largest distance between the transmitter and a recorded position that counts as the same position, metres."""

PLANNED, TRANSMITTER = (200, 0, 200), (255, 210, 0)  # RGB of planned positions and of the transmitter


class Tab:
    """The control panel and the 3D view. All tabs share the subject and the ray tracer."""

    def __init__(self, client: ClientHandle, subject: Subject, tracing: Tracing | None = None):
        self.client, self.subject, self.shield = client, subject, partial(shield, client)
        self._tracing = tracing
        self._traced: Traced | None = None
        self._recorded = np.zeros((0, 3)) if subject.dataset is None else subject.dataset.positions
        start = self._recorded[0] if len(self._recorded) else subject.region.mean(axis=0)
        self._position: Position = start.astype(float)
        self._asked, self._changed, self._open = 0, threading.Event(), True
        self._build()
        bounds = [] if subject.scene is None else [subject.scene.bounds]
        whole = bounding_box(np.vstack([subject.region, subject.gateways, *bounds]))
        self.size = float(np.linalg.norm(whole[1] - whole[0])) or 1.0  # length of the diagonal, metres
        set_up(client, whole)
        self._panels = [panel(self, name) for name, panel in panels_of(subject).items()]
        self._add_layers()
        if subject.scene is not None and subject.run is None and subject.dataset is None:
            MovedAntennas(client, subject.scene)
        self._handle = client.scene.add_transform_controls(
            "/transmitter", scale=0.1 * self.size, disable_rotations=True, depth_test=False, position=self._position
        )
        colour = GATEWAY if subject.array_moves else TRANSMITTER
        client.scene.add_icosphere("/transmitter/tag", radius=0.008 * self.size, color=colour)
        self._handle.on_update(self.shield(self._dragged))
        self._moved(finished=True)
        threading.Thread(target=self._keep_up_to_date, daemon=True).start()

    def close(self) -> None:
        """End the tab's thread, and withdraw its request to the ray tracer."""
        self._open = False
        self._changed.set()
        if self._tracing is not None:
            self._tracing.forget(self)

    def redraw_on(self, *controls: GuiInputHandle) -> None:
        """Show the position anew when one of the controls changes."""
        for each in controls:
            each.on_update(self.shield(self._switched))

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

    def _build(self) -> None:
        """Build the panel above the controls of the quantities."""
        gui, subject = self.client.gui, self.subject
        for sentence in subject.missing:
            gui.add_markdown(f"**Note.** {in_markdown(sentence)}")
        self._words = gui.add_markdown("", order=-2)
        self._state = gui.add_markdown("", order=-1)
        count = len(self._recorded)
        with gui.add_folder("Receiver" if subject.array_moves else "Transmitter"):
            self._place = gui.add_vector3("position (m)", self._position, step=0.001)
            self._place.on_update(self.shield(self._typed))
            self._number = gui.add_slider(
                "recorded position", 1, max(count, 2), 1, 1, visible=count > 1, hint="in the order of tx_pos.csv"
            )
            self._number.on_update(self.shield(self._chosen))
            self._play = gui.add_checkbox("play along the recorded path", False, visible=count > 1)
            self._play.on_update(self.shield(self._switched))
        self._live = gui.add_checkbox("trace while dragging", True, visible=self._tracing is not None)

    def _add_layers(self) -> None:
        """Draw what stands in the room, and the checkboxes that hide it."""
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
        places, apart = self._recorded, 1.0
        if len(places) > 1:  # smaller where they are dense, so that a map shows between them
            apart = float(np.median(cKDTree(places).query(places, k=2)[0][:, 1])) / self.size
        dot = float(np.clip(0.3 * apart, 0.001, 0.004))
        with self.client.gui.add_folder("Layers"):
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
            for panel in self._panels:
                panel.add_layers()
            if subject.run is not None:
                self.shield(add_located)(self)
                add_cloud(self)

    def _moved(self, finished: bool) -> None:
        """The transmitter has moved; ``finished``: it is not being dragged on."""
        if self._tracing is not None and self._open and (finished or self._live.value):
            self._tracing.request(self, self._position, self._keep_traced)
        self._changed.set()

    def _keep_traced(self, traced: Traced) -> None:
        self._traced = traced
        self._changed.set()

    async def _dragged(self, event: TransformControlsEvent) -> None:
        self._position = np.array(event.target.position, dtype=float)
        self._write_place()
        self._moved(finished=event.phase == "end")

    async def _typed(self, event) -> None:
        if event.client is not None:  # the user typed it; an event of this program has no client
            self._move_to(np.array(self._place.value))

    async def _chosen(self, event) -> None:
        if event.client is not None:
            self._go_to(int(self._number.value) - 1)

    async def _switched(self, event) -> None:
        self._changed.set()

    def _recorded_at(self, position: Position) -> int | None:
        """Index of the recorded position at which the transmitter is; None: it is at none."""
        if not len(self._recorded):
            return None
        distance = np.linalg.norm(self._recorded - position, axis=1)
        index = self._asked if distance[self._asked] < AT_A_POSITION else int(distance.argmin())
        return index if distance[index] < AT_A_POSITION else None

    def _go_to(self, index: int) -> None:
        self._asked = index
        self._move_to(self._recorded[index].astype(float))
        self._write_place()

    def _advance(self) -> None:
        next_index = int(self._number.value) % int(self._number.max)
        self._number.value = next_index + 1  # type: ignore[misc]
        self._go_to(next_index)

    def _move_to(self, position: Position) -> None:
        self._position = position
        self._handle.position = position
        self._moved(finished=True)

    def _write_place(self) -> None:
        """Write the transmitter's position into its input field."""
        self._place.value = tuple(self._position.round(4))  # type: ignore[misc, assignment]

    def _keep_up_to_date(self) -> None:
        while True:
            playing = self._play.value
            if not self._changed.wait(PLAY_SECONDS if playing else 1.0) and playing:
                self.shield(self._advance)()
            if not self._open:
                return
            self._state.content = "" if self._tracing is None else in_markdown(self._tracing.state)
            if self._changed.is_set():
                self._changed.clear()
                try:
                    self._show(self._position)
                except Exception as error:  # without this thread, the tab would never change again
                    logging.getLogger("bisplat").exception(
                        "the viewer cannot show the transmitter at %s", self._position
                    )
                    self._words.content = f"**Cannot be shown:** {in_markdown(str(error))}"

    def _show(self, position: Position) -> None:
        """Show what is at a position of the transmitter, metres, world frame."""
        index, traced = self._recorded_at(position), self._traced
        if traced is not None and not np.array_equal(traced.position, position):
            traced = None
        if self.subject.array_moves:
            self.gateway.position = position
        words = [panel.show(position, index, traced) for panel in self._panels]
        self._words.content = "\n\n".join([self._where(position, index), *words])

    def _where(self, position: Position, index: int | None) -> str:
        """The recorded position at which the transmitter is, and warnings where less is known of it, as Markdown."""
        subject, words = self.subject, []
        if index is not None:
            assert subject.dataset is not None
            learned = "learned from it" if index in subject.known else "did not learn from it"
            name = in_markdown(subject.dataset.names[index])
            words.append(f"Recorded position {index + 1} ({name} in files); methods {learned}.")
        if subject.known_region is not None and outside(position, subject.known_region):
            words.append("**The position is outside the bounding box of the known positions.**")
        if self._tracing is not None and outside(position, subject.region):
            words.append("**The position is outside the transmitter region: ray tracing may miss paths.**")
        return "  \n".join(words)


def panels_of(subject: Subject) -> dict[str, type[Panel]]:
    """The panels of a subject by the names of their quantities; of a scene or a run alone, those of spectra."""
    if subject.dataset is None:
        return {"spectrum": SpectrumPanel}
    chosen = {name: PANELS.get(name, ValuesPanel) for name in subject.dataset.quantities}
    return {name: panel for name, panel in chosen.items() if panel.suits(subject.dataset, name)}


def outside(position: Position, box: Float[np.ndarray, "2 3"]) -> bool:
    """Whether a position is outside a box."""
    return bool((position < box[0] - 1e-9).any() or (position > box[1] + 1e-9).any())
