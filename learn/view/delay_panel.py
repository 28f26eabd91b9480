"""The panel of responses over a band and of channels (CSI): the power over delay of a row."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from jaxtyping import Complex, Float

from learn.view.compared_spectra import TRUE
from learn.view.panel import Panel, line_chart, of_unit
from learn.view.subject import Position
from scenes.files.errors import InputError
from scenes.scene.description import SPEED_OF_LIGHT
from simulate.dataset.dataset import Dataset
from simulate.spectra.band import Band

if TYPE_CHECKING:
    from learn.view.tracing import Traced
    from simulate.rays.core.multipath import TracedPath

FINER = 8  # Points of the profile for each resolution cell

BEFORE, SHOWN = 3, 16  # Resolution cells that are drawn before the strongest delay, and at most in all

LEAST = -40.0  # Lower end of the axis, dB below the maximum

STEMS: dict[str, Any] = {"linefmt": "C1-", "markerfmt": "C1.", "basefmt": " ", "label": "traced paths"}


class DelayPanel(Panel):
    """Power over delay of the row at the transmitter, with the traced paths; without spectra of the nearest row."""

    _drawn: tuple[int, int] | None = None  # the row that is drawn, and the number of its traced paths

    @classmethod
    def suits(cls, dataset: Dataset, quantity: str) -> bool:
        if quantity == "channel" and dataset.band is None:
            stated = "expected the entry band, without which delays are unknown, found none"
            raise InputError(f"{dataset.folder / 'metadata.json'}: {stated}")
        return dataset.band is not None

    def show(self, position: Position, index: int | None, traced: Traced | None) -> str:
        dataset = self.view.subject.dataset
        assert dataset is not None and dataset.band is not None
        if index is None and "spectrum" in dataset.values:
            return ""  # a drag must stay fast, and the spectra tell of this position
        distances = np.linalg.norm(dataset.positions - position, axis=1)
        row = int(distances.argmin()) if index is None else index
        profile = delay_profile(dataset.values[self.quantity][row].astype(complex), dataset.band)
        paths = traced.paths if traced is not None and index is not None else []
        if self._drawn != (row, len(paths)):
            self._draw(row, profile, paths, 1 / dataset.band.bandwidth)
            self._drawn = row, len(paths)
        away = f" of position {row + 1}, {distances[row]:.2f} m away" if index is None else ""
        return f"strongest delay{away}: {1e9 * profile.delays[profile.decibels.argmax()]:.4g} ns"

    def _draw(self, row: int, profile: DelayProfile, paths: Sequence[TracedPath], cell: float) -> None:
        """Draw the profile of a row, with a stem for each path; ``cell`` is the resolution, seconds."""
        figure, axis = line_chart(f"power over delay, position {row + 1}")
        axis.plot(1e9 * profile.delays, profile.decibels, color=of_unit(TRUE), label="recorded")
        if paths:
            lengths = [np.linalg.norm(np.diff(path.vertices, axis=0), axis=1).sum() for path in paths]
            gains = np.abs([path.response for path in paths])
            axis.stem(1e9 * np.array(lengths) / SPEED_OF_LIGHT, 20 * np.log10(gains / gains[0]), bottom=LEAST, **STEMS)
            axis.legend(fontsize="small")
        axis.set(xlim=1e9 * profile.delays[[0, -1]], ylim=(LEAST, 2), ylabel="dB")
        resolution = f"resolution 1 / bandwidth: {1e9 * cell:.3g} ns, or {cell * SPEED_OF_LIGHT:.3g} m of path"
        axis.set_xlabel(f"delay (ns); {resolution}", fontsize="small")
        self.draw_figure(figure)


class DelayProfile(NamedTuple):
    """Power over delay around the strongest one."""

    # seconds. The band cannot tell a delay from one that differs by 1 / (distance of the subcarriers), so they
    # may be negative.
    delays: Float[np.ndarray, " n"]
    decibels: Float[np.ndarray, " n"]  # power, dB relative to the maximum


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
    return DelayProfile(index / (FINER * band.bandwidth), decibels)
