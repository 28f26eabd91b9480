"""One tab of spectra, predicted and true at its transmitter's position, and the thread that traces for all tabs."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from threading import Condition, Thread
from typing import TYPE_CHECKING, cast, get_args

import numpy as np
from jaxtyping import UInt8
from viser import ClientHandle, GuiImageHandle

from learn.view.channel_tab import delay_profile, draw_delays
from learn.view.chart import Kind, draw
from learn.view.compared_spectra import numbers, panels
from learn.view.layers import Layers
from learn.view.subject import Position, Spectrum, Subject
from learn.view.tab import Tab, outside
from scenes.browser.moved_antennas import MovedAntennas
from scenes.files.optional_packages import MissingExtraError
from scenes.files.plain_text import in_markdown
from scenes.scene.description import Scene
from simulate.rays.core.propagation import Propagation
from simulate.spectra.beamformer import Beamformer

if TYPE_CHECKING:  # importing it needs the ray tracer, which a viewer without a scene does not need
    from simulate.rays.core.multipath import TracedPath
    from simulate.rays.tracer import Tracer


class Session(Tab):
    """The control panel and the 3D view of a tab that shows spectra. All tabs share the subject and the ray tracer."""

    def __init__(self, client: ClientHandle, subject: Subject, tracing: Tracing | None):
        recorded = np.zeros((0, 3)) if subject.dataset is None else subject.dataset.positions
        super().__init__(client, recorded, subject.region.mean(axis=0))
        self._subject, self._tracing = subject, tracing
        self._traced: Traced | None = None
        self._build("recorded spectrum")
        self._layers = Layers(client, subject, self._position, self._changed.set)
        if subject.scene is not None and subject.run is None and subject.dataset is None:
            MovedAntennas(client, subject.scene)
        self._begin(self._layers.transmitter)
        threading.Thread(target=self._shield(self._layers.colour_test_positions), daemon=True).start()

    def close(self) -> None:
        """End the tab's thread, and withdraw its request to the ray tracer."""
        super().close()
        if self._tracing is not None:
            self._tracing.forget(self)

    def _build(self, recorded: str) -> None:
        gui, subject = self._gui, self._subject
        for sentence in subject.missing:
            gui.add_markdown(f"**Note.** {in_markdown(sentence)}")
        self._image: GuiImageHandle | None = None  # made when the first panels are drawn
        self._what = "Receiver" if subject.array_moves else self._what
        super()._build(recorded)
        self._live = gui.add_checkbox("trace while dragging", True, visible=self._tracing is not None)
        with gui.add_folder("Spectrum"):
            names = tuple(subject.predictors)
            self._by = gui.add_dropdown("predicted by", names or ("nothing",), visible=bool(names))
            self._kind = gui.add_dropdown("view", get_args(Kind))
            self._quantity = gui.add_dropdown("quantity", ("magnitude", "phase"))
            self._scale = gui.add_dropdown("scale", ("linear", "dB"))
        for each in (self._by, self._kind, self._quantity, self._scale):
            each.on_update(self._shield(self._switched))

    def _moved(self, finished: bool) -> None:
        if self._tracing is not None and self._open and (finished or self._live.value):
            self._tracing.request(self, self._position, self._keep_traced)
        super()._moved(finished)

    def _status(self) -> str:
        return "" if self._tracing is None else self._tracing.state

    def _keep_traced(self, traced: Traced) -> None:
        self._traced = traced
        self._changed.set()

    def _true_at(self, position: Position) -> tuple[str, Spectrum | None, Traced | None]:
        """The true spectrum at a position: the recorded one if there is one, otherwise the traced one."""
        traced = self._traced
        if traced is not None and not np.array_equal(traced.position, position):
            traced = None
        index = self._recorded_at(position)
        if index is not None:
            assert self._subject.dataset is not None
            return f"recorded, spectrum {self._subject.dataset.names[index]}", self._subject.recorded(index), traced
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
        if subject.dataset is not None and subject.dataset.band is not None:
            image = np.concatenate([image, self._delays(position, traced, image.shape[1])])
        if self._image is None:
            self._image = self._gui.add_image(image, format="jpeg", jpeg_quality=92, order=-3)
        else:
            self._image.image = image
        self._numbers.content = numbers(predicted, name, truth, subject.beamformer, milliseconds) + self._warning(
            position
        )
        self._layers.show(position, prediction, truth.values if truth else None, traced.paths if traced else None)

    def _delays(self, position: Position, traced: Traced | None, width: int) -> UInt8[np.ndarray, "H W 3"]:
        """The panel of power over delay at a position, with the traced paths where there are some."""
        dataset, index = self._subject.dataset, self._recorded_at(position)
        assert dataset is not None and dataset.band is not None
        if index is None:
            return draw_delays("power over delay: none recorded at this position", None, width)
        profile = delay_profile(dataset.band_responses[index], dataset.band)
        paths = traced.paths if traced else []
        title = f"power over delay, recorded{' (orange: traced paths)' if paths else ''}"
        return draw_delays(title, profile, width, paths)

    def _warning(self, position: Position) -> str:
        """Warnings at a position where the prediction extrapolates, or where the ray tracer may miss paths."""
        subject, warnings = self._subject, ""
        if subject.known_region is not None and outside(position, subject.known_region):
            warnings += "  \n**The position is outside the bounding box of the known positions.**"
        if self._tracing is not None and outside(position, subject.region):
            warnings += "  \n**The position is outside the transmitter region: ray tracing may miss paths.**"
        return warnings


@dataclass(frozen=True)
class Traced:
    """Result of ray tracing for one transmitter position."""

    position: Position  # position of the transmitter, metres, world frame
    spectrum: Spectrum  # the spectrum of the traced responses
    paths: list[TracedPath]  # the paths, the strongest first


class Tracing:
    """Traces transmitter positions that tabs request."""

    def __init__(
        self, scene: Scene, beamformer: Beamformer, propagation: Propagation, region: np.ndarray, seed: int = 1
    ):
        self.state = "ray tracing: finding paths"
        self._arguments = scene, propagation, region, seed
        self._beamformer = beamformer
        self._requests: dict[object, tuple[Position, Callable[[Traced], None]]] = {}
        self._condition = Condition()
        Thread(target=self._trace_requests, daemon=True, name="tracing").start()  # Ctrl-C does not wait for a daemon

    def request(self, tab: object, position: Position, done: Callable[[Traced], None]) -> None:
        """Request the tracing of a position. The request replaces a pending one of the same tab."""
        with self._condition:
            self._requests[tab] = position, done
            self._condition.notify()

    def forget(self, tab: object) -> None:
        """Withdraw the pending request of a tab."""
        with self._condition:
            self._requests.pop(tab, None)

    def _trace_requests(self) -> None:
        try:
            tracer = self._prepared()
        except MissingExtraError as error:
            self.state = f"no ray tracing: {error}"
            return
        except Exception as error:  # the page says why there is no ray tracing, and shows everything else
            logging.getLogger("bisplat").exception("the viewer has no ray tracing")
            self.state = f"no ray tracing: {error}"
            return
        self.state = ""
        while True:
            with self._condition:
                while not self._requests:
                    self._condition.wait()
                tab = next(iter(self._requests))  # the tab that has waited longest
                position, done = self._requests.pop(tab)
            try:
                spectrum = Spectrum.of(self._beamformer, tracer.responses(position[None])[0])
                done(Traced(position, spectrum, tracer.paths(position)))
                self.state = ""
            except Exception as error:  # tracing may still work at other positions, and for other tabs
                logging.getLogger("bisplat").exception("the viewer cannot trace rays to %s", position)
                self.state = f"no ray tracing: {error}"

    def _prepared(self) -> Tracer:
        from simulate.rays.tracer import Tracer

        def report(sentence: str) -> None:
            self.state = f"ray tracing: finding paths, {sentence}"

        return Tracer(*self._arguments, report)
