"""One tab of received powers: the coverage map of a gateway over the room, survey positions, and a table of powers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, UInt8
from PIL import Image, ImageDraw
from scipy.spatial import cKDTree
from viser import ClientHandle, GuiImageHandle, ImageHandle

from learn.fitted.coverage import NO_GATEWAY, CoverageMap
from learn.methods.method_table import named_for
from learn.quantities.quantity import Prediction
from learn.reports.coverage_report import INTERVAL, distinct
from learn.reports.plots import MAGNITUDE
from learn.view.chart import BACKGROUND, INK, Colours, colour_of, font
from learn.view.power_subject import PowerSubject
from learn.view.room_layers import add_dots, add_planned, add_room, add_transmitter, switch
from learn.view.subject import Position
from learn.view.tab import Tab, outside
from scenes.browser.scene_view import GATEWAY, add_region, set_up
from scenes.files.errors import printable
from scenes.files.plain_text import in_markdown
from scenes.scene.shapes import bounding_box

ROWS = 24  # Most gateways in the table of powers, the strongest ones


class PowerTab(Tab):
    """The control panel and the 3D view of a tab that shows received powers. All tabs share the subject."""

    def __init__(self, client: ClientHandle, subject: PowerSubject):
        super().__init__(client, subject.dataset.positions, subject.region.mean(axis=0))
        self._subject, self._client = subject, client
        self._image: GuiImageHandle | None = None
        self._map: ImageHandle | None = None
        self._mapped: tuple[str, ...] = ()
        self._build("survey position")
        names = subject.dataset.gateway_names
        with self._gui.add_folder("Map"):
            self._shown = self._gui.add_dropdown("gateway", (*names, STRONGEST), initial_value=names[0])
            self._quantity = self._gui.add_dropdown("quantity", (POWER, WIDTH))
            self._by = self._gui.add_dropdown("predicted by", named_for("power"), initial_value="helmholtz")
            self._height = self._gui.add_number("height (m)", round(subject.middle_height, 2), step=0.01)
        for each in (self._shown, self._quantity, self._by, self._height):
            each.on_update(self._shield(self._switched))
        self._add_layers()
        self._begin(add_transmitter(client, self._position, self._size))

    def _build(self, recorded: str) -> None:
        for sentence in self._subject.missing:
            self._gui.add_markdown(f"**Note.** {in_markdown(sentence)}")
        super()._build(recorded)

    def _add_layers(self) -> None:
        subject, client = self._subject, self._client
        gateways = subject.dataset.gateway_positions
        bounds = [] if subject.scene is None else [subject.scene.bounds]
        whole = bounding_box(np.vstack([subject.dataset.positions, gateways, *bounds]))
        self._size = float(np.linalg.norm(whole[1] - whole[0])) or 1.0
        set_up(client, whole)
        walls, furniture = add_room(client, subject.scene)
        marks = add_dots(client, "/gateways", gateways, np.full(gateways.shape, GATEWAY, np.uint8), 0.014 * self._size)
        labels = [
            client.scene.add_label(f"/names/{number}", name, position=place)
            for number, (name, place) in enumerate(zip(subject.dataset.gateway_names, gateways, strict=True))
        ]
        grey = np.full(subject.dataset.positions.shape, 170, np.uint8)
        self._survey = add_dots(client, "/survey", subject.dataset.positions, grey, self._dot_size())
        region = add_region(client.scene, subject.known_region)
        with self._gui.add_folder("Layers"):
            self._on = self._gui.add_checkbox("map", True)
            switch(client, "survey positions, by measured power", [self._survey])
            switch(client, "gateways", [marks])
            switch(client, "names of the gateways", labels)
            switch(client, "walls, floor, ceiling", walls)
            switch(client, "furniture", furniture)
            switch(client, "box of the known positions", [region])
            add_planned(client, subject.planned, self._size)
        self._on.on_update(self._shield(self._hide))

    def _dot_size(self) -> float:
        """Size of a survey position, metres: small enough that the map shows between them."""
        positions = self._subject.dataset.positions
        if len(positions) < 2:
            return 0.005 * self._size
        nearest = cKDTree(positions).query(positions, k=2)[0][:, 1]
        return float(np.clip(0.3 * np.median(nearest), 0.0005 * self._size, 0.005 * self._size))

    async def _hide(self, event) -> None:
        if self._map is not None:
            self._map.visible = self._on.value

    def _show(self, position: Position) -> None:
        method = self._by.value
        self._state.content = f"{method} is computing"
        predicted = self._subject.predict(method, position)
        self._numbers.content = self._table(predicted, position)
        asked = (method, f"{self._height.value:.3f}", self._shown.value, self._quantity.value)
        if asked != self._mapped:
            self._draw(method)
            self._mapped = asked
        self._state.content = ""

    def _draw(self, method: str) -> None:
        """Draw the map, the colours of the survey positions and the key."""
        coverage = self._subject.coverage(method, float(self._height.value))
        found = drawn(self._subject, coverage, self._shown.value, self._quantity.value)
        left, bottom, right, top = coverage.edges
        middle = ((left + right) / 2, (bottom + top) / 2, coverage.height)
        # viser draws the first row of an image at the smallest y of its own frame, which is the world's here.
        self._map = self._client.scene.add_image(
            "/map", found.image, right - left, top - bottom, position=middle, cast_shadow=False, receive_shadow=False
        )
        self._map.visible = self._on.value
        self._survey.colors = found.points
        self._draw_key(found)

    def _draw_key(self, found: Drawn) -> None:
        if self._image is None:
            self._image = self._gui.add_image(found.key, format="png", order=-3)
        else:
            self._image.image = found.key

    def _table(self, predicted: Prediction, position: Position) -> str:
        """The powers at the transmitter, as Markdown."""
        subject = self._subject
        lines = []
        index = self._recorded_at(position)
        measured = None if index is None else subject.dataset.powers[index]
        if index is not None:
            learned = "learned from it" if index in subject.known else "did not learn from it"
            lines += [f"Survey position {index + 1} (number {index} in files); {self._by.value} {learned}", ""]
        lines += power_rows(subject.dataset.gateway_names, subject.dataset.floor_dbm, predicted, measured)
        if outside(position, subject.known_region):
            lines += ["", "**The position is outside the bounding box of the known positions.**"]
        return "\n".join(lines)


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


STRONGEST = "strongest gateway"  # What the map shows, if it is not one gateway

POWER, WIDTH = "power", "90 % interval"  # Quantities of a map

SILENT = (190, 190, 190)  # RGB where nothing is received

ENDS = (1, 99)  # Percentiles of the measured powers at which the colours end

OPAQUE = 215  # Opacity of the map, 0 to 255: the floor shines through

KEY_WIDTH, LINE = 400, 20  # Width of the key and height of its lines, pixels


class Drawn(NamedTuple):
    """What to draw."""

    # RGBA of the cells; row 0 is the smallest y. Nothing is drawn where the map says nothing.
    image: UInt8[np.ndarray, "ny nx 4"]
    points: UInt8[np.ndarray, "K 3"]  # RGB of the survey positions
    key: UInt8[np.ndarray, "H W 3"]  # the colour bar, or the colours of the gateways


def drawn(subject: PowerSubject, coverage: CoverageMap, shown: str, quantity: str) -> Drawn:
    """Colours of a map and of the survey positions.

    Positions have the colour of the measured power on the scale of the map, so that a position that looks like the map
    around it is predicted rightly. On a map of intervals they are grey.
    """
    dataset, powers = subject.dataset, subject.dataset.powers
    names = dataset.gateway_names
    gateway = names.index(shown) if shown in names else None
    if quantity == WIDTH and coverage.width is not None:
        silent = coverage.strongest == NO_GATEWAY
        title = f"width of the 90 % interval, {shown}"
        if gateway is not None:
            width = coverage.width[gateway]
        else:
            width = np.where(silent, np.nan, _taken(coverage.width, np.maximum(coverage.strongest, 0)))
            title += "; grey: nothing received"
        told = width[np.isfinite(width)]
        low, high = (float(told.min()), float(told.max())) if told.size else (0.0, 0.0)
        scale = Colours(INTERVAL, low, high + 1e-6, " dB")
        cells = colour_of(np.nan_to_num(width, nan=low), scale)
        cells[np.isnan(width)] = SILENT
        points = np.broadcast_to(np.array(SILENT, np.uint8), (len(dataset), 3))
        return Drawn(_image(cells, coverage), points, _bar(scale, title))
    if gateway is None:
        table = np.round(255 * np.array([each[:3] for each in distinct(len(names))])).astype(np.uint8)
        table = np.vstack([table, [SILENT]]).astype(np.uint8)  # −1 is the last
        cells, points = table[coverage.strongest], table[subject.strongest_measured]
        seen = sorted({*np.unique(coverage.strongest), *np.unique(subject.strongest_measured)} - {NO_GATEWAY})
        return Drawn(_image(cells, coverage), points, _list([(names[each], table[each]) for each in seen]))
    measured = powers[~np.isnan(powers)]
    low, high = np.percentile(measured, ENDS) if measured.size else (dataset.floor_dbm, 0.0)
    scale = Colours(MAGNITUDE, float(low), max(float(high), float(low) + 1e-6), " dBm")
    cells = colour_of(np.nan_to_num(coverage.median[gateway]), scale)
    cells[~coverage.received[gateway]] = SILENT
    points = colour_of(np.nan_to_num(powers[:, gateway]), scale)
    points[np.isnan(powers[:, gateway])] = SILENT
    return Drawn(_image(cells, coverage), points, _bar(scale, f"power at {shown}; grey: nothing received"))


def _taken(values: Float[np.ndarray, "G ny nx"], index: np.ndarray) -> Float[np.ndarray, "ny nx"]:
    return np.take_along_axis(values, index[None], axis=0)[0]


def _image(cells: UInt8[np.ndarray, "ny nx 3"], coverage: CoverageMap) -> UInt8[np.ndarray, "ny nx 4"]:
    opacity = np.where(np.isnan(coverage.median[0]), 0, OPAQUE).astype(np.uint8)
    return np.dstack([cells, opacity])


def _bar(scale: Colours, title: str) -> UInt8[np.ndarray, "H W 3"]:
    """A horizontal colour bar with three values below it."""
    image = Image.new("RGB", (KEY_WIDTH, 66), BACKGROUND)
    pen = ImageDraw.Draw(image)
    pen.text((6, 16), printable(title), fill=INK, font=font(13), anchor="ls")
    pixels = np.array(image)
    pixels[26:42, 6 : KEY_WIDTH - 6] = colour_of(np.linspace(scale.low, scale.high, KEY_WIDTH - 12), scale)
    image = Image.fromarray(pixels)
    pen = ImageDraw.Draw(image)
    for share, anchor in ((0.0, "lt"), (0.5, "mt"), (1.0, "rt")):
        value = scale.low + share * (scale.high - scale.low)
        place = (6 + share * (KEY_WIDTH - 12), 47)
        pen.text(place, f"{value:.1f}{scale.unit}".replace("-", "−"), fill=INK, font=font(11), anchor=anchor)
    return np.asarray(image)


def _list(entries: Sequence[tuple[str, np.ndarray]]) -> UInt8[np.ndarray, "H W 3"]:
    """The names of gateways beside their colours, in two columns."""
    rows = -(-(len(entries) + 1) // 2)
    image = Image.new("RGB", (KEY_WIDTH, 24 + LINE * rows), BACKGROUND)
    pen = ImageDraw.Draw(image)
    pen.text((6, 16), STRONGEST, fill=INK, font=font(13), anchor="ls")
    for number, (name, colour) in enumerate([*entries, ("nothing received", np.array(SILENT))]):
        x, y = 6 + (KEY_WIDTH // 2) * (number // rows), 24 + LINE * (number % rows)
        pen.rectangle((x, y + 2, x + 12, y + 14), fill=tuple(int(each) for each in colour))
        pen.text((x + 20, y + 8), printable(name)[:24], fill=INK, font=font(12), anchor="lm")
    return np.asarray(image)
