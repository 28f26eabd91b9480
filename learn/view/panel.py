"""A panel of the viewer: the picture of a quantity at the transmitter's position, with its controls and its layers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, Num, UInt8
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from viser import GuiImageHandle

from learn.methods.method_table import named_for
from learn.quantities.quantity_table import quantity_named
from learn.view.compared_spectra import PREDICTED, TRUE
from learn.view.room_view import RoomView
from learn.view.subject import Position
from scenes.files.plain_text import in_figure
from simulate.dataset.dataset import Dataset

if TYPE_CHECKING:
    from learn.view.tracing import Traced


PIXEL = 1 / 100  # Inches of a figure


class Panel(ABC):
    """A panel of a tab, which builds its controls when it is made."""

    def __init__(self, view: RoomView, quantity: str):
        self.view, self.quantity = view, quantity
        self._image: GuiImageHandle | None = None  # made when the first picture is drawn

    @classmethod
    def suits(cls, dataset: Dataset, quantity: str) -> bool:
        """Whether there is something to show of a quantity."""
        return True

    def add_layers(self) -> None:  # noqa: B027
        """Draw what else there is in the room, with a checkbox for each layer."""

    @abstractmethod
    def show(self, position: Position, index: int | None, traced: Traced | None) -> str:
        """Show what is at a position of the transmitter, and return it in words, as Markdown.

        ``index`` is the row that was recorded there, and ``traced`` what rays say of it, if there are such.
        """

    def draw(self, picture: UInt8[np.ndarray, "H W 3"]) -> None:
        """Show a picture at the top of the control panel."""
        if self._image is None:
            self._image = self.view.client.gui.add_image(picture, format="jpeg", jpeg_quality=92, order=-3)
        else:
            self._image.image = picture

    def draw_figure(self, figure: Figure) -> None:
        """Show a figure of Matplotlib, which takes tens of milliseconds to draw."""
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        self.draw(np.asarray(canvas.buffer_rgba())[..., :3])


class ValuesPanel(Panel):
    """Recorded and predicted values of any quantity over their last axis, and the scores of the prediction."""

    def __init__(self, view: RoomView, quantity: str):
        super().__init__(view, quantity)
        self._of = quantity_named(quantity)
        with view.client.gui.add_folder(quantity):
            self._by = view.client.gui.add_dropdown("predicted by", named_for(quantity))
        view.redraw_on(self._by)

    def show(self, position: Position, index: int | None, traced: Traced | None) -> str:
        subject, dataset, of = self.view.subject, self.view.subject.dataset, self._of
        assert dataset is not None
        rows = np.array([] if index is None else [index], int)
        truth, given, words = of.of(dataset, rows), of.given(dataset, rows), ""
        figure, axis = line_chart(of.in_words)
        if len(subject.known) and (given is None or len(rows)):
            method = subject.fitted(self.quantity, self._by.value)
            with subject.alone:
                prediction = method.predict(position[None], given)
            axis.plot(profile(prediction.value[0]), "o-", ms=3, color=of_unit(PREDICTED), label="predicted")
            if len(rows):
                row = of.score(prediction, truth, dataset).row
                stated = {heading: row[key] for key, heading in of.columns.items() if row.get(key) is not None}
                words = ", ".join(f"{heading} {value:.3g}" for heading, value in stated.items())
        for each in truth:
            axis.plot(profile(each), "o-", ms=3, color=of_unit(TRUE), label="recorded")
        axis.legend(fontsize="small")
        self.draw_figure(figure)
        return words


def profile(value: Num[np.ndarray, "..."]) -> Float[np.ndarray, " n"]:
    """The means of a value over all axes but the last, of complex ones those of the magnitude."""
    real = np.atleast_1d(np.abs(value) if np.iscomplexobj(value) else value)
    return real.reshape(-1, real.shape[-1]).mean(axis=0)


def line_chart(title: str) -> tuple[Figure, Axes]:
    """A figure as wide as the spectra are."""
    figure = Figure(figsize=(500 * PIXEL, 200 * PIXEL), dpi=1 / PIXEL)
    axis = figure.add_axes((0.11, 0.22, 0.86, 0.65))
    axis.set_title(in_figure(title), fontsize="medium", loc="left")
    axis.tick_params(labelsize="small")
    axis.grid(alpha=0.3)
    return figure, axis


def of_unit(colour: tuple[int, int, int]) -> tuple[float, ...]:
    """A colour as Matplotlib takes it."""
    return tuple(each / 255 for each in colour)
