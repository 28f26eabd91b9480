"""Rays that are traced for the positions of the viewer's tabs, by one thread for all of them."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass
from threading import Condition, Thread
from typing import TYPE_CHECKING

import numpy as np

from learn.view.subject import Position, Spectrum
from scenes.files.optional_packages import MissingExtraError
from scenes.scene.description import Scene
from simulate.rays.core.propagation import Propagation
from simulate.spectra.beamformer import Beamformer

if TYPE_CHECKING:  # importing it needs the ray tracer, which a viewer without a scene does not need
    from simulate.rays.core.multipath import TracedPath
    from simulate.rays.tracer import Tracer


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
        except Exception as error:  # the page says why there is no ray tracing, and shows everything else
            if not isinstance(error, MissingExtraError):
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
