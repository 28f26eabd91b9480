"""The tab of the viewer: a transmitter that the user moves about the room, and the panels of what is measured there.

The transmitter is dragged, typed, or put at a recorded position, one after the other if the recorded path is played. A
thread shows what is at its position.
"""

from __future__ import annotations

import logging
import threading
from functools import partial

import numpy as np
from jaxtyping import Float
from viser import ClientHandle, TransformControlsEvent

from learn.view.delay_panel import DelayPanel
from learn.view.panel import Panel, ValuesPanel
from learn.view.power_panel import PowerPanel
from learn.view.room_view import TRANSMITTER, RoomView
from learn.view.run_layers import add_cloud, add_located
from learn.view.spectrum_panel import SpectrumPanel
from learn.view.subject import Position, Subject
from learn.view.tracing import Traced, Tracing
from scenes.browser.moved_antennas import MovedAntennas
from scenes.browser.scene_view import GATEWAY
from scenes.browser.served_page import shield
from scenes.files.plain_text import in_markdown

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
        self._view = RoomView(client, subject, self._changed.set)
        self._panels = [panel(self._view, name) for name, panel in panels_of(subject).items()]
        with client.gui.add_folder("Layers"):
            self._view.add_layers()
            for panel in self._panels:
                panel.add_layers()
            if subject.run is not None:
                self.shield(add_located)(self._view)
                add_cloud(self._view)
        if subject.scene is not None and subject.run is None and subject.dataset is None:
            MovedAntennas(client, subject.scene)
        self._handle = client.scene.add_transform_controls(
            "/transmitter",
            scale=0.1 * self._view.size,
            disable_rotations=True,
            depth_test=False,
            position=self._position,
        )
        colour = GATEWAY if subject.array_moves else TRANSMITTER
        client.scene.add_icosphere("/transmitter/tag", radius=0.008 * self._view.size, color=colour)
        self._handle.on_update(self.shield(self._dragged))
        self._moved(finished=True)
        threading.Thread(target=self._keep_up_to_date, daemon=True).start()

    def close(self) -> None:
        """End the tab's thread, and withdraw its request to the ray tracer."""
        self._open = False
        self._changed.set()
        if self._tracing is not None:
            self._tracing.forget(self)

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
            self._view.gateway.position = position
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
