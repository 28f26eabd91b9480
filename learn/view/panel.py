"""A panel of the viewer: the picture of a quantity at the transmitter's position, with its controls and its layers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, Num, UInt8
from viser import GuiImageHandle

from learn.methods.method_table import named_for
from learn.quantities.quantity_table import quantity_named
from learn.view.compared_spectra import PREDICTED, TRUE
from learn.view.line_chart import Curve, draw_curves
from learn.view.subject import Position
from simulate.dataset.dataset import Dataset

if TYPE_CHECKING:
    from learn.view.tab import Tab
    from learn.view.tracing import Traced


POSITION = (110, 110, 130)  # RGB of a recorded position without a score


class Panel(ABC):
    """A panel of a tab, which builds its controls when it is made."""

    def __init__(self, tab: Tab, quantity: str):
        self.tab, self.quantity = tab, quantity
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
            self._image = self.tab.client.gui.add_image(picture, format="jpeg", jpeg_quality=92, order=-3)
        else:
            self._image.image = picture


class ValuesPanel(Panel):
    """Recorded and predicted values of any quantity over their last axis, and the scores of the prediction."""

    def __init__(self, tab: Tab, quantity: str):
        super().__init__(tab, quantity)
        self._of = quantity_named(quantity)
        with tab.client.gui.add_folder(quantity):
            self._by = tab.client.gui.add_dropdown("predicted by", named_for(quantity))
        tab.redraw_on(self._by)

    def show(self, position: Position, index: int | None, traced: Traced | None) -> str:
        subject, dataset, of = self.tab.subject, self.tab.subject.dataset, self._of
        assert dataset is not None
        rows = np.array([] if index is None else [index], int)
        truth, given, curves, words = of.of(dataset, rows), of.given(dataset, rows), [], ""
        if len(subject.known) and (given is None or len(rows)):
            method = subject.fitted(self.quantity, self._by.value)
            with subject.alone:
                prediction = method.predict(position[None], given)
            curves.append(Curve(profile(prediction.value[0]), PREDICTED))
            if len(rows):
                row = of.score(prediction, truth, dataset).row
                stated = {heading: row[key] for key, heading in of.columns.items() if row.get(key) is not None}
                words = ", ".join(f"{heading} {value:.3g}" for heading, value in stated.items())
        curves += [Curve(profile(each), TRUE) for each in truth]
        self.draw(draw_curves(f"{of.in_words}: recorded (blue), predicted (orange)", curves, "number"))
        return words


def profile(value: Num[np.ndarray, "..."]) -> Float[np.ndarray, "n 2"]:
    """The last axis of a value: the numbers of its entries, and their means, of complex ones of the magnitude."""
    real = np.abs(value) if np.iscomplexobj(value) else value.astype(float)
    means = np.atleast_1d(real).reshape(-1, np.atleast_1d(real).shape[-1]).mean(axis=0)
    return np.column_stack([np.arange(1, len(means) + 1), means])
