"""The panel of spectra: predicted, true, and their difference; on a hemisphere the same, and paths."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, cast, get_args

import numpy as np
from jaxtyping import Float
from viser import BatchedMeshHandle

from learn.view.chart import LINEAR, Colours, Kind, colour_of, draw
from learn.view.compared_spectra import PREDICTED, TRUE, numbers, panels
from learn.view.hemisphere import DOT_DEG, disc, dots, ellipses
from learn.view.panel import Panel
from learn.view.room_view import POSITION, RoomView
from learn.view.subject import Position, Spectrum, SpectrumArray

if TYPE_CHECKING:  # importing the paths needs the ray tracer
    from learn.view.tracing import Traced
    from simulate.rays.core.multipath import TracedPath


PATHS_SHOWN = 40  # Largest number of traced paths that are drawn, the strongest ones

PATH_COLOURS = Colours("plasma", -30.0, 0.0, " dB")
"""Colours of traced paths by their gain relative to the strongest path, dB."""

BLACK = (0, 0, 0)  # RGB of the hemisphere before it has a spectrum

NO_LINE = np.zeros((1, 2, 3), np.float32)  # viser does not accept empty arrays


class SpectrumPanel(Panel):
    """Spectra at the transmitter's position."""

    def __init__(self, view: RoomView, quantity: str):
        super().__init__(view, quantity)
        gui, names = view.client.gui, tuple(view.subject.predictors)
        with gui.add_folder("Spectrum"):
            self._by = gui.add_dropdown("predicted by", names or ("nothing",), visible=bool(names))
            self._kind = gui.add_dropdown("view", get_args(Kind))
            self._part = gui.add_dropdown("quantity", ("magnitude", "phase"))
            self._scale = gui.add_dropdown("scale", ("linear", "dB"))
        view.redraw_on(self._by, self._kind, self._part, self._scale)

    def add_layers(self) -> None:
        view, subject, api, gui = self.view, self.view.subject, self.view.client.scene, self.view.client.gui
        self._radius = 0.09 * view.size
        elements = (subject.beamformer.array.positions * subject.wavelength).astype(np.float32)
        api.add_point_cloud("/gateway/elements", elements, (60, 0, 20), point_size=0.003 * view.size)
        places, self._pixel = dots(self._radius, subject.beamformer.grid)
        size = 0.09 * np.radians(DOT_DEG)
        self._sphere = view.add_dots("/gateway/spectrum", places, BLACK, size)
        add_lines = partial(api.add_line_segments, thickness_units="screen")
        self._predicted = add_lines("/gateway/predicted", NO_LINE, PREDICTED, thickness=5)
        self._true = add_lines("/gateway/true", NO_LINE, TRUE, thickness=5)
        self._paths = add_lines("/paths", NO_LINE, NO_LINE.astype(np.uint8), thickness=2)
        self._splats: BatchedMeshHandle | None = None
        self._on_sphere = gui.add_dropdown("hemisphere shows", ("predicted", "recorded or traced"))
        view.switch("spectrum on the hemisphere", [self._sphere])
        view.switch("dominant directions", [self._predicted, self._true])
        view.switch("traced paths", [self._paths] if subject.traced is not None else [])
        self._primitives = gui.add_checkbox("primitives (colour: phase)", False, visible=subject.has_primitives)
        view.redraw_on(self._on_sphere, self._primitives)
        threading.Thread(target=view.shield(self._colour_tested), daemon=True).start()

    def show(self, position: Position, index: int | None, traced: Traced | None) -> str:
        subject, began = self.view.subject, time.perf_counter()
        predictors, beamformer = subject.predictors, subject.beamformer
        prediction = predictors[self._by.value](position) if predictors else None
        milliseconds = 1e3 * (time.perf_counter() - began)
        name, truth = "ray-traced", None if traced is None else traced.spectrum
        if index is not None:
            name, truth = "recorded", subject.recorded(index)
        in_phase = self._part.value == "phase"
        field = subject.field(position) if in_phase and self._by.value == next(iter(predictors), None) else None
        predicted = None if prediction is None else Spectrum(prediction, field)
        in_db = self._scale.value == "dB"
        drawn = panels(self._by.value, predicted, name, truth, beamformer.grid, in_phase, in_db)
        self.draw(draw(drawn, cast(Kind, self._kind.value), beamformer.grid))
        self._show_in_room(position, prediction, truth, [] if traced is None else traced.paths)
        return numbers(predicted, name, truth, beamformer, milliseconds)

    def _show_in_room(
        self, position: Position, predicted: SpectrumArray | None, truth: Spectrum | None, paths: Sequence[TracedPath]
    ) -> None:
        true = None if truth is None else truth.values
        first, second = (predicted, true) if self._on_sphere.value == "predicted" else (true, predicted)
        spectrum = second if first is None else first
        if spectrum is not None:
            self._sphere.colors = colour_of(spectrum[self._pixel], LINEAR)  # RGB of each dot
        for node, each in ((self._predicted, predicted), (self._true, true)):
            node.points = NO_LINE if each is None else self._ray(each)
        with self.view.client.atomic():  # the browser must always see as many colours as points
            self._paths.points, self._paths.colors = lines_of(paths)
        if self._primitives.value:
            drawn = ellipses(self.view.subject.splats(position), 1.02 * self._radius)
            with self.view.client.atomic():
                self._splats = self.view.client.scene.add_batched_meshes_simple(
                    "/gateway/primitives",
                    *disc(),
                    **drawn,
                    side="double",
                    lod="off",
                    cast_shadow=False,
                    receive_shadow=False,
                )
        elif self._splats is not None:
            self._splats.visible = False

    def _ray(self, spectrum: SpectrumArray) -> Float[np.ndarray, "1 2 3"]:
        """A line from the hemisphere towards a spectrum's maximum."""
        towards = self.view.subject.beamformer.grid.dominant_direction(spectrum)
        return np.array([[self._radius * towards, 0.5 * self.view.size * towards]], np.float32)

    def _colour_tested(self) -> None:
        """Colour the test positions by their SSIM; the first call computes the scores, which takes seconds."""
        subject = self.view.subject
        if subject.dataset is not None and len(subject.scores):
            colours = np.full(subject.dataset.positions.shape, POSITION, np.uint8)
            colours[subject.tested] = colour_of(subject.scores, LINEAR)
            self.view.colour_rows(colours)


def lines_of(paths: Sequence[TracedPath]) -> tuple[Float[np.ndarray, "n 2 3"], np.ndarray]:
    """Segments of the strongest paths, metres, and the colours of their ends."""
    segments, colours = [NO_LINE], [NO_LINE.astype(np.uint8)]
    for path in list(paths)[:PATHS_SHOWN]:
        segments.append(np.stack([path.vertices[:-1], path.vertices[1:]], axis=1))
        gain = 20 * np.log10(abs(path.response) / abs(paths[0].response))
        colour = colour_of(np.array(gain), PATH_COLOURS)
        colours.append(np.broadcast_to(colour, (len(path.vertices) - 1, 2, 3)))
    return np.concatenate(segments).astype(np.float32), np.concatenate(colours)
