"""Ray tracing beside the viewer: one tracer in one thread, shared by all tabs."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from threading import Lock
from typing import TYPE_CHECKING

import numpy as np

from learn.view.subject import Position, Spectrum
from scenes.description import Scene
from scenes.errors import InputError
from simulate.propagation import Propagation
from simulate.spectrum import PlanarArray

if TYPE_CHECKING:  # imported where it is used: a viewer without a scene does not need the ray tracer
    from simulate.trace import TracedPath, Tracer


@dataclass(frozen=True)
class Traced:
    """What the ray tracer says of one transmitter."""

    spectrum: Spectrum
    paths: list[TracedPath]


class Tracing:
    """Traces on request. Finding the scene's chains, before the first, takes some ten seconds; then it is live.

    Args:
        scene: where to trace.
        propagation: what to follow.
        region: corners of the box all transmitters are in, metres.

    Attributes:
        state: a sentence on what goes on, for the user.
    """

    def __init__(self, scene: Scene, propagation: Propagation, region: np.ndarray):
        self.state = "ray tracing: finding paths"
        self._arguments = scene, propagation, region
        self._array = PlanarArray.of(scene.gateway)
        self._thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="tracing")
        self._latest: dict[object, object] = {}
        self._lock = Lock()
        self._tracer: Tracer | None = None
        self._thread.submit(self._prepare)

    def request(self, tab: object, position: Position, done: Callable[[Traced], None]) -> None:
        """Trace a position for a tab, unless the tab has asked for another one by the time it is its turn."""
        ticket = object()
        with self._lock:
            self._latest[tab] = ticket
        self._thread.submit(self._trace, tab, ticket, position, done)

    def forget(self, tab: object) -> None:
        """A tab is closed: what it waits for is not traced."""
        with self._lock:
            self._latest.pop(tab, None)

    def stop(self) -> None:
        """Forget what waits; what runs is not waited for."""
        self._thread.shutdown(wait=False, cancel_futures=True)

    def _prepare(self) -> None:
        try:
            from simulate.trace import Tracer

            scene, propagation, region = self._arguments
            self._tracer = Tracer(scene, propagation, region, self._report)
            self.state = ""
        except (InputError, ImportError) as error:
            self.state = f"no ray tracing: {error}"

    def _report(self, sentence: str) -> None:
        self.state = f"ray tracing: finding paths, {sentence}"

    def _trace(self, tab: object, ticket: object, position: Position, done: Callable[[Traced], None]) -> None:
        with self._lock:
            if self._latest.get(tab) is not ticket:
                return
        if self._tracer is not None:
            channels = self._tracer.responses(position[None])[0]
            done(Traced(Spectrum.of(self._array, channels), self._tracer.paths(position)))
