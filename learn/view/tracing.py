"""Ray tracing beside the viewer: one tracer in one thread, shared by all tabs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from threading import Condition, Thread
from typing import TYPE_CHECKING

import numpy as np

from learn.view.subject import Position, Spectrum
from scenes.description import Scene
from simulate.array import PlanarArray
from simulate.propagation import Propagation

if TYPE_CHECKING:  # imported where it is used: a viewer without a scene does not need the ray tracer
    from simulate.trace import TracedPath, Tracer


@dataclass(frozen=True)
class Traced:
    """What the ray tracer says of one transmitter."""

    position: Position
    spectrum: Spectrum
    paths: list[TracedPath]


class Tracing:
    """Traces on request. Finding the scene's chains, before the first, takes some ten seconds; then it is live.

    Args:
        scene: where to trace.
        propagation: what to follow.
        region: corners of the box all transmitters are in, metres.
        seed: seed of the rays.

    Attributes:
        state: a sentence on what goes on, for the user.
    """

    def __init__(self, scene: Scene, propagation: Propagation, region: np.ndarray, seed: int = 1):
        self.state = "ray tracing: finding paths"
        self._arguments = scene, propagation, region, seed
        self._array = PlanarArray.of(scene.gateway)
        self._wanted: dict[object, tuple[Position, Callable[[Traced], None]]] = {}
        self._asked = Condition()
        Thread(target=self._trace_what_is_wanted, daemon=True, name="tracing").start()  # Ctrl-C does not wait for it

    def request(self, tab: object, position: Position, done: Callable[[Traced], None]) -> None:
        """Trace a position for a tab, instead of what the tab asked for before and has not got yet."""
        with self._asked:
            self._wanted[tab] = position, done
            self._asked.notify()

    def forget(self, tab: object) -> None:
        """A tab is closed: what it waits for is not traced."""
        with self._asked:
            self._wanted.pop(tab, None)

    def _trace_what_is_wanted(self) -> None:
        try:
            tracer = self._prepared()
            self.state = ""
            while True:
                with self._asked:
                    while not self._wanted:
                        self._asked.wait()
                    tab = next(iter(self._wanted))  # the one that waits longest
                    position, done = self._wanted.pop(tab)
                spectrum = Spectrum.of(self._array, tracer.responses(position[None])[0])
                done(Traced(position, spectrum, tracer.paths(position)))
        except Exception as error:  # whatever it is, the page says so and shows the rest
            self.state = f"no ray tracing: {error}"

    def _prepared(self) -> Tracer:
        from simulate.trace import Tracer

        def report(sentence: str) -> None:
            self.state = f"ray tracing: finding paths, {sentence}"

        return Tracer(*self._arguments, report)
