"""What every tab of the viewer does: a transmitter that the user moves, and a thread that shows what is there.

A transmitter is dragged, typed, or put at a recorded position, one after the other if the recorded path is played.
"""

from __future__ import annotations

import logging
import threading
from abc import ABC, abstractmethod
from functools import partial

import numpy as np
from jaxtyping import Float
from viser import ClientHandle, TransformControlsEvent, TransformControlsHandle

from learn.view.subject import Position
from scenes.browser.served_page import shield
from scenes.files.plain_text import in_markdown

PLAY_SECONDS = 0.4  # Time between two positions when the recorded path is played, seconds

AT_A_POSITION = 1e-4
"""Largest distance between the transmitter and a recorded position that counts as the same position, metres."""


class Tab(ABC):
    """A tab with its own transmitter and controls. Its thread calls ``_show`` when something has changed."""

    def __init__(self, client: ClientHandle, recorded: Float[np.ndarray, "K 3"], start: Position):
        self._shield = partial(shield, client)
        self._gui, self._recorded = client.gui, recorded
        self._position: Position = recorded[0].astype(float) if len(recorded) else start
        self._asked, self._what = 0, "Transmitter"
        self._changed, self._open = threading.Event(), True

    def close(self) -> None:
        """End the tab's thread."""
        self._open = False
        self._changed.set()

    def _build(self, recorded: str) -> None:
        """Build the panel above the further controls."""
        self._numbers = self._gui.add_markdown("", order=-2)
        self._state = self._gui.add_markdown("", order=-1)
        count = len(self._recorded)
        with self._gui.add_folder(self._what):
            self._place = self._gui.add_vector3("position (m)", self._position, step=0.001)
            self._place.on_update(self._shield(self._typed))
            self._number = self._gui.add_slider(
                recorded, 1, max(count, 2), 1, 1, visible=count > 1, hint="in the order of tx_pos.csv"
            )
            self._number.on_update(self._shield(self._chosen))
            self._play = self._gui.add_checkbox("play along the recorded path", False, visible=count > 1)
            self._play.on_update(self._shield(self._switched))

    def _begin(self, transmitter: TransformControlsHandle) -> None:
        """Begin to follow the transmitter, when everything is built."""
        self._handle = transmitter
        transmitter.on_update(self._shield(self._dragged))
        self._moved(finished=True)
        threading.Thread(target=self._keep_up_to_date, daemon=True).start()

    @abstractmethod
    def _show(self, position: Position) -> None:
        """Show what is at a position of the transmitter, metres, world frame."""

    def _moved(self, finished: bool) -> None:
        """The transmitter has moved; ``finished``: it is not being dragged on."""
        self._changed.set()

    def _status(self) -> str:
        """A sentence on what the tab is waiting for; empty if there is nothing."""
        return ""

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
                self._shield(self._advance)()
            if not self._open:
                return
            self._state.content = in_markdown(self._status())
            if self._changed.is_set():
                self._changed.clear()
                try:
                    self._show(self._position)
                except Exception as error:  # without this thread, the tab would never change again
                    logging.getLogger("bisplat").exception(
                        "the viewer cannot show the transmitter at %s", self._position
                    )
                    self._numbers.content = f"**Cannot be shown:** {in_markdown(str(error))}"


def outside(position: Position, box: Float[np.ndarray, "2 3"]) -> bool:
    """Whether a position is outside a box."""
    return bool((position < box[0] - 1e-9).any() or (position > box[1] + 1e-9).any())
