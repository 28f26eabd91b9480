"""What a method learns from, made of arrays alone: received powers, and both links of channels."""

from types import SimpleNamespace

import numpy as np

from learn.quantities.channels import Channels
from learn.quantities.known import Known
from learn.quantities.powers import Powers


def taught_powers(positions, powers, gateways, floor=-100.0, wavelength=0.125, seed=0) -> Known:
    """Known powers [n, G] at all positions."""
    dataset = SimpleNamespace(
        positions=positions, rssi_dbm=powers, gateway_positions=gateways, floor_dbm=floor, wavelength=wavelength
    )
    return Known.of(dataset, Powers(), np.arange(len(powers)), seed)


class InOwnUnit(Channels):
    """Channels as they are."""

    def of(self, dataset, rows):
        return dataset.downlink[rows]

    def given(self, dataset, rows):
        return dataset.uplink[rows]


def taught_links(uplink, downlink, positions=None, *, seed=0, antennas=None, wavelength=0.125) -> Known:
    """Known channels [n, A, S] of both links, in their own unit."""
    dataset = SimpleNamespace(
        uplink=uplink,
        downlink=downlink,
        positions=positions,
        antenna_positions=antennas,
        frequency=SimpleNamespace(wavelength=wavelength),
    )
    return Known.of(dataset, InOwnUnit(), np.arange(len(uplink)), seed)
