"""What a method learns from, made of arrays alone: received powers, and both links of channels."""

from pathlib import Path

import numpy as np

from learn.quantities.channels import Channels
from learn.quantities.known import Known
from learn.quantities.powers import Powers
from scenes.scene.description import SPEED_OF_LIGHT
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_frequency import Frequency
from simulate.dataset.receivers import Antennas


def _dataset(values, positions, antennas, wavelength, **metadata) -> Dataset:
    [count] = {len(each) for each in values.values()}
    frequency, none = Frequency(SPEED_OF_LIGHT / wavelength, "metadata"), np.zeros(0, int)
    names, receiver = [str(row) for row in range(count)], Antennas([], antennas)
    return Dataset(Path("taught"), names, values, receiver, positions, none, none, None, metadata, frequency)


def taught_powers(positions, powers, gateways, floor=-100.0, wavelength=0.125, seed=0) -> Known:
    """Known powers [n, G] at all positions."""
    dataset = _dataset({"power": powers}, positions, gateways, wavelength, receiver={"floor_dbm": floor})
    return Known.of(dataset, Powers(), np.arange(len(powers)), seed)


class InOwnUnit(Channels):
    """Channels as they are."""

    def of(self, dataset, rows):
        return dataset.downlink[rows]

    def given(self, dataset, rows):
        return dataset.uplink[rows]


def taught_links(uplink, downlink, positions=None, *, seed=0, antennas=None, wavelength=0.125) -> Known:
    """Known channels [n, A, S] of both links, in their own unit."""
    both = np.concatenate([uplink, downlink], axis=2)
    return Known.of(
        _dataset({"channel": both}, positions, antennas, wavelength), InOwnUnit(), np.arange(len(both)), seed
    )
