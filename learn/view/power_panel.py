"""The panel of received powers: a table of those at the transmitter, and in the room the coverage map of a gateway."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jaxtyping import UInt8
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from viser import ImageHandle

from learn.fitted.coverage import NO_GATEWAY, CoverageMap, coverage_map
from learn.methods.method_table import named_for
from learn.quantities.quantity import Prediction
from learn.reports.coverage_report import INTERVAL, distinct
from learn.reports.plots import MAGNITUDE
from learn.view.chart import Colours, colour_of
from learn.view.panel import PIXEL, Panel
from learn.view.room_view import RoomView
from learn.view.subject import Position, Subject
from scenes.browser.scene_view import GATEWAY
from scenes.files.plain_text import in_figure, in_markdown

if TYPE_CHECKING:
    from learn.view.tracing import Traced

CELLS = 4000  # About the number of cells of a map; more would take longer than a user wants to wait

ROWS = 24  # Most gateways in the table of powers, the strongest ones

STRONGEST = "strongest gateway"  # What the map shows, if it is not one gateway

POWER, WIDTH = "power", "90 % interval"  # Quantities of a map

SILENT = (190, 190, 190)  # RGB where nothing is received

ENDS = (1, 99)  # Percentiles of the measured powers at which the colours end

OPAQUE = 215  # Opacity of the map, 0 to 255: the floor shines through


class PowerPanel(Panel):
    """Powers at the transmitter's position, and their map."""

    def __init__(self, view: RoomView, quantity: str):
        super().__init__(view, quantity)
        assert view.subject.dataset is not None
        self._dataset, gui = view.subject.dataset, view.client.gui
        names = self._dataset.gateway_names
        middle = float(np.median(self._dataset.positions[view.subject.known, 2]))
        with gui.add_folder("Map"):
            self._shown = gui.add_dropdown("gateway", (*names, STRONGEST), initial_value=names[0])
            self._part = gui.add_dropdown("quantity", (POWER, WIDTH))
            self._by = gui.add_dropdown("predicted by", named_for("power"), initial_value="helmholtz")
            self._height = gui.add_number("height (m)", round(middle, 2), step=0.01)
        view.redraw_on(self._shown, self._part, self._by, self._height)
        self._map: ImageHandle | None = None
        self._mapped: tuple[str | float, ...] = ()

    def add_layers(self) -> None:
        self._on = self.view.client.gui.add_checkbox("map", True)
        self.view.redraw_on(self._on)

    def show(self, position: Position, index: int | None, traced: Traced | None) -> str:
        subject, dataset, method = self.view.subject, self._dataset, self._by.value
        with subject.alone:
            predicted = subject.fitted("power", method).predict(position[None])
        asked = (method, self._height.value, self._shown.value, self._part.value)
        if asked != self._mapped:
            self._draw_map(coverage(subject, method, self._height.value))
            self._mapped = asked
        if self._map is not None:
            self._map.visible = self._on.value
        measured = None if index is None else dataset.powers[index]
        return "\n".join(power_rows(dataset.gateway_names, dataset.floor_dbm, predicted, measured))

    def _draw_map(self, found: CoverageMap) -> None:
        """Draw the map, the colours of positions and gateways, and the key."""
        drawn = draw_map(found, self._shown.value, self._part.value)
        left, bottom, right, top = found.edges
        middle = ((left + right) / 2, (bottom + top) / 2, found.height)
        # viser draws the first row of an image at the smallest y of its own frame, which is the world's here.
        self._map = self.view.client.scene.add_image(
            "/map", drawn.image, right - left, top - bottom, position=middle, cast_shadow=False, receive_shadow=False
        )
        self.view.colour_rows(drawn.points)
        self.view.gateway.colors = drawn.gateways
        self.draw_figure(drawn.key)


def coverage(subject: Subject, method: str, height: float) -> CoverageMap:
    """The map of a method at a height in metres, which is computed once for all tabs."""
    assert subject.known_region is not None
    width, depth = np.ptp(subject.known_region, axis=0)[:2]
    step = max(float(np.sqrt(width * depth / CELLS)), float(max(width, depth)) / CELLS, 0.01)
    fitted = subject.fitted("power", method)
    return subject.once(("map", method, height), partial(coverage_map, fitted, height=height, step=step))


def power_rows(names: Sequence[str], floor: float, predicted: Prediction, measured: np.ndarray | None) -> list[str]:
    """A Markdown table of the powers at one position, the strongest gateway first."""
    order = np.argsort(-predicted.value[0])[:ROWS]
    headings = ["gateway", "predicted", *(["90 % interval"] if predicted.low is not None else [])]
    headings += [] if measured is None else ["measured"]
    rows = [f"| {' | '.join(headings)} |", f"| {' | '.join(['---'] * len(headings))} |"]
    for each in order:
        median = predicted.value[0, each]
        cells = [in_markdown(names[each]), f"{median:.1f} dBm" if median >= floor else f"below {floor:g}"]
        if predicted.low is not None and predicted.high is not None:
            cells.append(f"{predicted.low[0, each]:.1f} to {predicted.high[0, each]:.1f}")
        if measured is not None:
            cells.append("nothing" if np.isnan(measured[each]) else f"{measured[each]:.1f}")
        rows.append(f"| {cells[0]} | {' | '.join(cells[1:]).replace('-', '−')} |")
    return rows


class Drawn(NamedTuple):
    """What to draw."""

    # RGBA of the cells; row 0 is the smallest y. Nothing is drawn where the map says nothing.
    image: UInt8[np.ndarray, "ny nx 4"]
    points: UInt8[np.ndarray, "K 3"]  # RGB of the survey positions
    gateways: UInt8[np.ndarray, "G 3"]  # RGB of the gateways
    key: Figure  # the colour bar, or the colours of the gateways


def draw_map(coverage: CoverageMap, shown: str, part: str) -> Drawn:
    """Colours of a map and of the survey positions.

    Positions have the colour of the measured power on the scale of the map, so that a position that looks like the map
    around it is predicted rightly. On a map of intervals they are grey.
    """
    dataset, powers, strongest = coverage.dataset, coverage.dataset.powers, coverage.strongest
    names, scale, title = dataset.gateway_names, None, f"{shown}; grey: nothing received"
    entries: list[tuple[str, np.ndarray]] = []
    points = np.broadcast_to(np.array(SILENT, np.uint8), (len(dataset), 3))
    gateways = np.broadcast_to(np.array(GATEWAY, np.uint8), (len(names), 3))
    if part == WIDTH and coverage.width is not None:
        one = strongest if shown == STRONGEST else np.full(strongest.shape, names.index(shown))
        width = np.take_along_axis(coverage.width, np.maximum(one, 0)[None], axis=0)[0]
        values = np.where(one == NO_GATEWAY, np.nan, width)
        told = values[np.isfinite(values)]
        low, high = (float(told.min()), float(told.max())) if told.size else (0.0, 0.0)
        scale, title = Colours(INTERVAL, low, high + 1e-6, ""), f"width (dB) of the 90 % interval, {title}"
        cells = _coloured(values, scale)
    elif shown == STRONGEST:
        gateways = np.round(255 * np.array([each[:3] for each in distinct(len(names))])).astype(np.uint8)
        table = np.vstack([gateways, [SILENT]]).astype(np.uint8)  # −1 is the last
        measured = np.where(np.isnan(powers), -np.inf, powers)
        heard = np.where(np.isfinite(measured).any(axis=1), measured.argmax(axis=1), NO_GATEWAY)
        cells, points = table[strongest], table[heard]
        entries = [(names[each], table[each]) for each in np.unique([*strongest.flat, *heard]) if each != NO_GATEWAY]
    else:
        heard, gateway = powers[~np.isnan(powers)], names.index(shown)
        low, high = (float(each) for each in np.percentile(heard, ENDS)) if heard.size else (dataset.floor_dbm, 0.0)
        scale, title = Colours(MAGNITUDE, low, max(high, low + 1e-6), ""), f"power (dBm) at {title}"
        cells = _coloured(np.where(coverage.received[gateway], coverage.median[gateway], np.nan), scale)
        points = _coloured(powers[:, gateway], scale)
    opacity = np.where(np.isnan(coverage.median[0]), 0, OPAQUE).astype(np.uint8)
    return Drawn(np.dstack([cells, opacity]), points, gateways, _key(title, scale, entries))


def _coloured(values: np.ndarray, scale: Colours) -> np.ndarray:
    cells = colour_of(np.nan_to_num(values, nan=scale.low), scale)
    cells[np.isnan(values)] = SILENT
    return cells


def _key(title: str, scale: Colours | None, entries: Sequence[tuple[str, np.ndarray]]) -> Figure:
    """A title with a horizontal colour bar, or with the names of gateways beside their colours."""
    if scale is None:
        figure = Figure(figsize=(400 * PIXEL, (30 + 10 * len(entries)) * PIXEL), dpi=1 / PIXEL)
        patches = [Patch(color=tuple(colour / 255), label=in_figure(name)) for name, colour in entries]
        figure.legend(handles=patches, title=title, loc="center", ncols=2, fontsize="small", frameon=False)
        return figure
    figure = Figure(figsize=(400 * PIXEL, 70 * PIXEL), dpi=1 / PIXEL, layout="constrained")
    bar = ScalarMappable(Normalize(scale.low, scale.high), scale.name)
    figure.colorbar(bar, cax=figure.subplots(), orientation="horizontal").set_label(in_figure(title), fontsize="small")
    return figure
