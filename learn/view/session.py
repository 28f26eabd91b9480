"""One browser tab: its transmitter, its controls, and the predicted and the true spectrum at its position."""

from __future__ import annotations

import logging
import threading
import time
from functools import partial
from typing import cast, get_args

import numpy as np
from jaxtyping import Float
from viser import ClientHandle, GuiImageHandle, TransformControlsEvent

from learn.view.chart import Kind, draw
from learn.view.compared_spectra import numbers, panels
from learn.view.layers import Layers
from learn.view.subject import Position, Spectrum, Subject
from learn.view.tracing import Traced, Tracing
from scenes.browser.callbacks import shield
from scenes.files.plain_text import in_markdown

PLAY_SECONDS = 0.4
"""Time between two positions when the recorded path is played, seconds."""

AT_A_POSITION = 1e-4
"""Largest distance between the transmitter and a position of the dataset that counts as the same position, metres."""


class Session:
    """The control panel and the 3D view of a tab, and the thread that keeps them up to date.

    Each tab has its own transmitter and controls; all tabs share the subject and the ray tracer.

    Args:
        client: the tab.
        subject: the run, dataset or scene that is shown.
        tracing: the ray tracer. None: there is no scene.
    """

    def __init__(self, client: ClientHandle, subject: Subject, tracing: Tracing | None):
        self._subject, self._tracing = subject, tracing
        self._shield = partial(shield, client)
        self._position: Position = subject.region.mean(axis=0)
        if subject.dataset is not None:
            self._position = subject.dataset.positions[0].astype(float)
        self._traced: Traced | None = None
        self._changed, self._open = threading.Event(), True
        self._build(client)
        self._layers = Layers(client, subject, self._position, self._changed.set)
        self._layers.transmitter.on_update(self._shield(self._dragged))
        self._trace()
        self._changed.set()
        threading.Thread(target=self._keep_up_to_date, daemon=True).start()
        threading.Thread(target=self._shield(self._layers.colour_test_positions), daemon=True).start()

    def close(self) -> None:
        """End the tab's thread, and withdraw its request to the ray tracer."""
        self._open = False
        self._changed.set()
        if self._tracing is not None:
            self._tracing.forget(self)

    # --- the panel -----------------------------------------------------------------------------------------

    def _build(self, client: ClientHandle) -> None:
        gui, subject = client.gui, self._subject
        self._gui = gui
        for sentence in subject.missing:
            gui.add_markdown(f"**Note.** {in_markdown(sentence)}")
        self._image: GuiImageHandle | None = None  # made when the first panels are drawn
        self._numbers = gui.add_markdown("", order=-2)
        self._state = gui.add_markdown("", order=-1)
        with gui.add_folder("Transmitter"):
            self._place = gui.add_vector3("position (m)", self._position, step=0.001)
            self._place.on_update(self._shield(self._typed))
            self._live = gui.add_checkbox("trace while dragging", True, visible=self._tracing is not None)
            recorded = 0 if subject.dataset is None else len(subject.dataset.names)
            self._number = gui.add_slider(
                "recorded spectrum", 1, max(recorded, 2), 1, 1, visible=recorded > 1, hint="in the order of tx_pos.csv"
            )
            self._number.on_update(self._shield(self._chosen))
            self._play = gui.add_checkbox("play along the recorded path", False, visible=recorded > 1)
            self._play.on_update(self._shield(self._switched))
        with gui.add_folder("Spectrum"):
            names = tuple(subject.predictors)
            self._by = gui.add_dropdown("predicted by", names or ("nothing",), visible=bool(names))
            self._kind = gui.add_dropdown("view", get_args(Kind))
            self._quantity = gui.add_dropdown("quantity", ("magnitude", "phase"))
            self._scale = gui.add_dropdown("scale", ("linear", "dB"))
        for each in (self._by, self._kind, self._quantity, self._scale):
            each.on_update(self._shield(self._switched))

    # --- what the user does --------------------------------------------------------------------------------

    async def _dragged(self, event: TransformControlsEvent) -> None:
        self._position = np.array(event.target.position, dtype=float)
        self._write_place()
        if event.phase == "end" or self._live.value:
            self._trace()
        self._changed.set()

    async def _typed(self, event) -> None:
        if event.client is not None:  # the user typed it; an event of this program has no client
            self._move_to(np.array(self._place.value))

    async def _chosen(self, event) -> None:
        if event.client is not None:
            self._go_to(int(self._number.value) - 1)

    async def _switched(self, event) -> None:
        self._changed.set()

    def _go_to(self, index: int) -> None:
        assert self._subject.dataset is not None
        self._move_to(self._subject.dataset.positions[index].astype(float))
        self._write_place()

    def _advance(self) -> None:
        next_index = int(self._number.value) % int(self._number.max)
        self._number.value = next_index + 1  # type: ignore[misc]
        self._go_to(next_index)

    def _move_to(self, position: Position) -> None:
        self._position = position
        self._layers.transmitter.position = position
        self._trace()
        self._changed.set()

    def _write_place(self) -> None:
        """Write the transmitter's position into its input field.

        It is not called after the user typed a coordinate, since the user may be typing the next one.
        """
        self._place.value = tuple(self._position.round(4))  # type: ignore[misc, assignment]

    # --- what is shown -------------------------------------------------------------------------------------

    def _trace(self) -> None:
        if self._tracing is not None and self._open:
            self._tracing.request(self, self._position, self._keep_traced)

    def _keep_traced(self, traced: Traced) -> None:
        self._traced = traced
        self._changed.set()

    def _keep_up_to_date(self) -> None:
        while True:
            playing = self._play.value and self._subject.dataset is not None
            if not self._changed.wait(PLAY_SECONDS if playing else 1.0) and playing:
                self._shield(self._advance)()
            if not self._open:
                return
            self._state.content = in_markdown(self._tracing.state) if self._tracing else ""
            if self._changed.is_set():
                self._changed.clear()
                try:
                    self._show(self._position)
                except Exception as error:  # without this thread, the tab would never change again
                    logging.getLogger("bisplat").exception(
                        "the viewer cannot show the transmitter at %s", self._position
                    )
                    self._numbers.content = f"**Cannot be shown:** {in_markdown(str(error))}"

    def _true_at(self, position: Position) -> tuple[str, Spectrum | None, Traced | None]:
        """The true spectrum at a position: the recorded one if there is one, otherwise the traced one.

        Returns:
            The name of the spectrum; the spectrum (None: there is none, or it is not traced yet); and the result of
            ray tracing at exactly this position (None: it is not traced yet).
        """
        traced = self._traced
        if traced is not None and not np.array_equal(traced.position, position):
            traced = None
        dataset = self._subject.dataset
        if dataset is not None:
            distance = np.linalg.norm(dataset.positions - position, axis=1)
            index = int(distance.argmin())
            if distance[index] < AT_A_POSITION:
                return f"recorded, spectrum {dataset.names[index]}", self._subject.recorded(index), traced
        return "ray-traced", traced.spectrum if traced else None, traced

    def _show(self, position: Position) -> None:
        began = time.perf_counter()
        subject = self._subject
        predictors = subject.predictors
        prediction = predictors[self._by.value](position) if predictors else None
        milliseconds = 1e3 * (time.perf_counter() - began)
        name, truth, traced = self._true_at(position)
        in_phase = self._quantity.value == "phase"
        field = subject.field(position) if in_phase and self._by.value == next(iter(predictors), None) else None
        predicted = None if prediction is None else Spectrum(prediction, field)
        grid = subject.beamformer.grid
        drawn = panels(self._by.value, predicted, name, truth, grid, in_phase, self._scale.value == "dB")
        image = draw(drawn, cast(Kind, self._kind.value), grid)
        if self._image is None:
            self._image = self._gui.add_image(image, format="jpeg", jpeg_quality=92, order=-3)
        else:
            self._image.image = image
        self._numbers.content = numbers(predicted, name, truth, subject.beamformer, milliseconds) + self._warning(
            position
        )
        self._layers.show(position, prediction, truth.values if truth else None, traced.paths if traced else None)

    def _warning(self, position: Position) -> str:
        """Warnings at a position where the prediction extrapolates, or where the ray tracer may miss paths."""
        subject, warnings = self._subject, ""
        if subject.known_region is not None and outside(position, subject.known_region):
            warnings += "  \n**The position is outside the bounding box of the known positions.**"
        if self._tracing is not None and outside(position, subject.region):
            warnings += "  \n**The position is outside the transmitter region: ray tracing may miss paths.**"
        return warnings


def outside(position: Position, box: Float[np.ndarray, "2 3"]) -> bool:
    """Whether a position is outside a box.

    Args:
        position: a position, metres, world frame.
        box: corners (min, max) of the box, metres, world frame.

    >>> box = np.array([[0.0, 0.0, 0.0], [4.0, 3.0, 2.0]])
    >>> outside(np.array([1.0, 1.0, 1.0]), box), outside(np.array([1.0, 3.5, 1.0]), box)
    (False, True)
    """
    return bool((position < box[0] - 1e-9).any() or (position > box[1] + 1e-9).any())
