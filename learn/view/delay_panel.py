"""The panel of responses over a band and of channels (CSI): the power over delay of a row."""

from __future__ import annotations

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

FINER = 8  # Points of the profile for each resolution cell

BEFORE, SHOWN = 3, 16  # Resolution cells that are drawn before the strongest delay, and at most in all

LEAST = -40.0  # Lower end of the axis, dB below the maximum

STEMS: dict[str, Any] = {"linefmt": "C1-", "markerfmt": "C1.", "basefmt": " ", "label": "traced paths"}


class DelayPanel(Panel):
    """Power over delay of the recorded row that is nearest to the transmitter, with the traced paths if it is there."""

    @classmethod
    def suits(cls, dataset: Dataset, quantity: str) -> bool:
        if quantity == "channel" and dataset.band is None:
            stated = "expected the entry band, without which delays are unknown, found none"
            raise InputError(f"{dataset.folder / 'metadata.json'}: {stated}")
        return dataset.band is not None

    def show(self, position: Position, index: int | None, traced: Traced | None) -> str:
        dataset = self.view.subject.dataset
        assert dataset is not None and dataset.band is not None
        distances = np.linalg.norm(dataset.positions - position, axis=1)
        row = int(distances.argmin()) if index is None else index
        profile = delay_profile(dataset.values[self.quantity][row].astype(complex), dataset.band)
        away = "" if index is not None else f", the nearest one, {distances[row]:.2f} m away"
        figure, axis = line_chart(f"power over delay, position {row + 1}{away}")
        axis.plot(1e9 * profile.delays, profile.decibels, color=of_unit(TRUE), label="recorded")
        if index is not None and traced is not None and traced.paths:
            lengths = [np.linalg.norm(np.diff(path.vertices, axis=0), axis=1).sum() for path in traced.paths]
            gains = np.abs([path.response for path in traced.paths])
            axis.stem(1e9 * np.array(lengths) / SPEED_OF_LIGHT, 20 * np.log10(gains / gains[0]), bottom=LEAST, **STEMS)
            axis.legend(fontsize="small")
        axis.set(xlim=1e9 * profile.delays[[0, -1]], ylim=(LEAST, 2), ylabel="dB")
        cell = 1 / dataset.band.bandwidth  # smallest difference of two delays that the band tells apart, seconds
        resolution = f"resolution 1 / bandwidth: {1e9 * cell:.3g} ns, or {cell * SPEED_OF_LIGHT:.3g} m of path"
        axis.set_xlabel(f"delay (ns); {resolution}", fontsize="small")
        self.draw_figure(figure)
        return f"strongest delay {1e9 * profile.delays[profile.decibels.argmax()]:.4g} ns"


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
