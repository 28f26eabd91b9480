"""Ray tracing for the viewer: one tracer in a thread of its own, which all tabs share."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass
from threading import Condition, Thread
from typing import TYPE_CHECKING

import numpy as np

from learn.view.subject import Position, Spectrum
from scenes.description import Scene
from simulate.array import PlanarArray
from simulate.propagation import Propagation

if TYPE_CHECKING:  # importing it needs the ray tracer, which a viewer without a scene does without
    from simulate.trace import TracedPath, Tracer


@dataclass(frozen=True)
class Traced:
    """What the ray tracer found for one transmitter.

    Attributes:
        position: of the transmitter, metres, world frame.
        spectrum: the spectrum of the traced responses.
        paths: the paths, the strongest first.
    """

    position: Position
    spectrum: Spectrum
    paths: list[TracedPath]


class Tracing:
    """Traces a transmitter when a tab asks for it.

    Before the first one the tracer looks for the chains of reflections in the scene, which takes some ten seconds;
    from then on a transmitter takes milliseconds.

    Args:
        scene: the scene that is traced.
        propagation: the effects that are traced.
        region: corners (min, max) of the box that holds all transmitters, metres.
        seed: seed of the rays.

    Attributes:
        state: what the tracer is doing, or why it cannot trace, for the page; empty: it is ready.
    """

    def __init__(self, scene: Scene, propagation: Propagation, region: np.ndarray, seed: int = 1):
        self.state = "ray tracing: finding paths"
        self._arguments = scene, propagation, region, seed
        self._array = PlanarArray.of(scene.gateway)
        self._wanted: dict[object, tuple[Position, Callable[[Traced], None]]] = {}
        self._asked = Condition()
        Thread(target=self._trace_what_is_wanted, daemon=True, name="tracing").start()  # a daemon: Ctrl-C does not wait

    def request(self, tab: object, position: Position, done: Callable[[Traced], None]) -> None:
        """Ask for a position to be traced. It replaces what the same tab asked for before and has not got yet.

        Args:
            tab: who asks.
            position: of the transmitter, metres, world frame.
            done: called with the result, in the tracing thread.
        """
        with self._asked:
            self._wanted[tab] = position, done
            self._asked.notify()

    def forget(self, tab: object) -> None:
        """Withdraw what a tab has asked for, since it is closed."""
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
                    tab = next(iter(self._wanted))  # the tab that has waited longest
                    position, done = self._wanted.pop(tab)
                spectrum = Spectrum.of(self._array, tracer.responses(position[None])[0])
                done(Traced(position, spectrum, tracer.paths(position)))
        except Exception as error:  # the page says why there is no tracing, and shows everything else
            logging.getLogger("bisplat").exception("ray tracing for the viewer has ended")
            self.state = f"no ray tracing: {error}"

    def _prepared(self) -> Tracer:
        from simulate.trace import Tracer

        def report(sentence: str) -> None:
            self.state = f"ray tracing: finding paths, {sentence}"

        return Tracer(*self._arguments, report)
