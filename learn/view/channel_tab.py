"""One tab of a folder of channels (CSI): the power over delay of each row, which the tab of spectra draws, too."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jaxtyping import Complex, Float, UInt8
from PIL import Image, ImageDraw
from viser import ClientHandle, GuiImageHandle

from learn.view.chart import BACKGROUND, BOTTOM, INK, LEFT, MISSING, RIGHT, TOP, font
from learn.view.compared_spectra import PREDICTED, TRUE
from learn.view.room_layers import add_dots, add_planned, add_transmitter, switch
from learn.view.subject import Position
from learn.view.tab import AT_A_POSITION, Tab
from scenes.browser.scene_view import GATEWAY, set_up
from scenes.files.errors import InputError, printable
from scenes.files.plain_text import in_markdown
from scenes.scene.description import SPEED_OF_LIGHT
from scenes.scene.shapes import bounding_box
from simulate.dataset.dataset import Dataset
from simulate.spectra.band import Band

if TYPE_CHECKING:  # importing it needs the ray tracer
    from simulate.rays.core.multipath import TracedPath


WIDTH = 500  # Width of the panel, pixels


def require_places_and_band(dataset: Dataset) -> None:
    """Refuse channels that the viewer cannot show."""
    if dataset.places is None:
        raise InputError(f"{dataset.folder / 'tx_pos.csv'}: expected the positions of the client, found no such file")
    if dataset.band is None:
        stated = "expected the entry band, without which delays are unknown, found none"
        raise InputError(f"{dataset.folder / 'metadata.json'}: {stated}")


class ChannelTab(Tab):
    """The control panel and the 3D view of a tab that shows channels."""

    def __init__(self, client: ClientHandle, dataset: Dataset, planned: np.ndarray | None):
        super().__init__(client, dataset.positions, dataset.positions[0])
        self._dataset = dataset
        self._image: GuiImageHandle | None = None
        self._build("row")
        whole = bounding_box(np.vstack([dataset.positions, dataset.gateway_positions]))
        size = float(np.linalg.norm(whole[1] - whole[0])) or 1.0
        set_up(client, whole)
        antennas, places = dataset.gateway_positions, dataset.positions
        marks = add_dots(client, "/antennas", antennas, np.full(antennas.shape, GATEWAY, np.uint8), 0.006 * size)
        rows = add_dots(client, "/rows", places, np.full(places.shape, 110, np.uint8), 0.005 * size)
        with self._gui.add_folder("Layers"):
            switch(client, "antennas", [marks])
            switch(client, "positions of the rows", [rows])
            add_planned(client, planned, size)
        self._begin(add_transmitter(client, self._position, size))

    def _show(self, position: Position) -> None:
        index = self._recorded_at(position)
        if index is None:
            index = int(np.linalg.norm(self._dataset.positions - position, axis=1).argmin())
        panel, words = self._profile(index)
        distance = float(np.linalg.norm(self._dataset.positions[index] - position))
        near = "" if distance < AT_A_POSITION else f", the nearest one, {distance:.2f} m from the transmitter"
        self._numbers.content = in_markdown(f"Row {index + 1}{near} (number {index} in files): {words}")
        if self._image is None:
            self._image = self._gui.add_image(panel, format="png", order=-3)
        else:
            self._image.image = panel

    def _profile(self, index: int) -> tuple[UInt8[np.ndarray, "H W 3"], str]:
        """The panel of a row, and its strongest delay in words."""
        band = self._dataset.band
        assert band is not None
        whole = np.concatenate([self._dataset.uplink[index], self._dataset.downlink[index]], axis=-1)
        profile = delay_profile(whole.astype(complex), band)
        title = f"power over delay, row {index + 1}, mean of {len(whole)} antennas"
        peak = 1e9 * profile.delays[profile.decibels.argmax()]
        return draw_delays(title, profile, WIDTH), f"strongest delay {peak:.4g} ns"


FINER = 8  # Points of the profile for each resolution cell

BEFORE, SHOWN = 3, 16  # Resolution cells that are drawn before the strongest delay, and at most in all

LEAST = -40.0  # Lower end of the axis, dB below the maximum

HEIGHT, SECOND_LINE = 110, 18  # Height of the plot and of the line below the axis, pixels


class DelayProfile(NamedTuple):
    """Power over delay around the strongest one."""

    # seconds. The band cannot tell a delay from one that differs by ``period``, so they may be negative.
    delays: Float[np.ndarray, " n"]
    decibels: Float[np.ndarray, " n"]  # power, dB relative to the maximum
    resolution: float  # smallest difference of two delays that the band tells apart, 1 / B, seconds
    period: float  # delays repeat after this, 1 / (distance of the subcarriers), seconds

    def sentence(self) -> str:
        """The resolution in words."""
        metres = SPEED_OF_LIGHT * self.resolution
        return f"resolution 1 / bandwidth: {1e9 * self.resolution:.3g} ns, or {metres:.3g} m of path"


def delay_profile(responses: Complex[np.ndarray, "elements subcarriers"], band: Band) -> DelayProfile:
    """The mean over the elements of the squared magnitude of the inverse Fourier transform over the subcarriers."""
    count = band.subcarriers
    impulse = np.fft.ifft(responses, n=FINER * count, axis=1)
    power = np.square(np.abs(impulse)).mean(axis=0)
    shown = FINER * min(SHOWN, count)
    first = int(power.argmax()) - FINER * BEFORE
    index = np.arange(first, first + shown + 1)
    taken = power[index % len(power)]
    with np.errstate(divide="ignore"):
        decibels = 10 * np.log10(taken / max(float(power.max()), np.finfo(float).tiny))
    return DelayProfile(index / (FINER * band.bandwidth), decibels, 1 / band.bandwidth, 1 / band.spacing)


def draw_delays(
    title: str, profile: DelayProfile | None, width: int, paths: Sequence[TracedPath] = ()
) -> UInt8[np.ndarray, "H W 3"]:
    """Draw a profile."""
    image = Image.new("RGB", (width, TOP + HEIGHT + BOTTOM + SECOND_LINE), BACKGROUND)
    pen = ImageDraw.Draw(image)
    right, bottom, small = width - RIGHT, TOP + HEIGHT, font(11)
    pen.text((6, 18), printable(title), fill=INK, font=font(13), anchor="ls")
    filled = MISSING if profile is None else BACKGROUND
    pen.rectangle((LEFT - 1, TOP - 1, right, bottom), outline=INK, fill=filled)
    if profile is None:
        return np.asarray(image)
    start, end = 1e9 * profile.delays[[0, -1]]

    def where(delay: float, decibels: float) -> tuple[float, float]:
        share = (max(decibels, LEAST) - LEAST) / -LEAST
        return LEFT + (right - LEFT) * (delay - start) / (end - start), bottom - HEIGHT * share

    for decibels in (0, -10, -20, -30, -40):
        y = where(start, decibels)[1]
        pen.line((LEFT - 5, y, LEFT, y), fill=INK)
        pen.line((LEFT, y, right - 1, y), fill=MISSING)
        pen.text((LEFT - 8, y), f"{decibels:g} dB".replace("-", "−"), fill=INK, font=small, anchor="rm")
    for delay in _ticks(start, end):
        x = where(delay, 0)[0]
        pen.line((x, bottom, x, bottom + 5), fill=INK)
        pen.text((x, bottom + 7), f"{delay:g}".replace("-", "−"), fill=INK, font=small, anchor="mt")
    pen.text((right + 8, bottom + 7), "delay (ns)", fill=INK, font=small, anchor="lt")
    for path in paths:
        delay = 1e9 * np.linalg.norm(np.diff(path.vertices, axis=0), axis=1).sum() / SPEED_OF_LIGHT
        decibels = 20 * np.log10(abs(path.response) / abs(paths[0].response))
        if start <= delay <= end and decibels > LEAST:
            x, y = where(delay, decibels)
            pen.line((x, bottom - 1, x, y), fill=PREDICTED)
            pen.ellipse((x - 2, y - 2, x + 2, y + 2), fill=PREDICTED)
    line = [where(*each) for each in zip(1e9 * profile.delays, profile.decibels, strict=True)]
    pen.line(line, fill=TRUE, width=2, joint="curve")
    pen.text((6, bottom + 36), profile.sentence(), fill=INK, font=small, anchor="lm")
    return np.asarray(image)


def _ticks(start: float, end: float) -> Float[np.ndarray, " n"]:
    """Four to ten round numbers between two."""
    rough = (end - start) / 5
    power = 10.0 ** np.floor(np.log10(rough))
    step = power * next(each for each in (1, 2, 5, 10) if each * power >= rough)
    return np.arange(np.ceil(start / step), np.floor(end / step) + 1) * step + 0.0  # no −0
