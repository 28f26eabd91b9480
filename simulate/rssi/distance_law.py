"""How received powers fall with the distance, and what is odd about them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from simulate.rssi.power_range import NOT_RECEIVED
from simulate.rssi.rssi_dataset import USUAL_FREQUENCY, RssiDataset

LEAST_POWERS, LEAST_RATIO = 10, 2.0
"""A gateway tells an exponent if it has received so many powers, from distances that differ by such a factor."""

USUAL_POWER = 20.0
"""dBm; transmit power if none is stated: the largest of most radios without a licence."""

BELIEVED = 10.0
"""dB by which the median power may exceed that of free space. Metres taken for millimetres add 60 dB."""


@dataclass(frozen=True)
class DistanceLaw:
    """Powers as P = P_1 − 10 n log10(d / 1 m), fitted for each gateway by least squares."""

    exponents: Float[np.ndarray, " g"]  # exponent n of each gateway that tells one. Free space has 2.
    scatter_db: float  # median over the gateways of the standard deviation of what is left, dB

    @classmethod
    def of(cls, dataset: RssiDataset) -> DistanceLaw | None:
        """The law of a dataset; None if no gateway tells one."""
        exponents, scatter = [], []
        for distance, power in zip(dataset.distances.T, dataset.rssi_dbm.T, strict=True):
            heard = ~np.isnan(power) & (distance > 0)
            if heard.sum() < LEAST_POWERS or distance[heard].max() < LEAST_RATIO * distance[heard].min():
                continue
            decades = 10 * np.log10(distance[heard])
            slope, level = np.polyfit(decades, power[heard], 1)
            exponents.append(-slope)
            scatter.append(np.std(power[heard] - level - slope * decades))
        return cls(np.array(exponents), float(np.median(scatter))) if exponents else None

    def __str__(self) -> str:
        """The law in words."""
        count = len(self.exponents)
        of = "one gateway" if count == 1 else f"median of {count} gateways"
        return (
            f"exponent {np.median(self.exponents):.1f} ({of}; free space has 2), "
            f"{self.scatter_db:.1f} dB left unexplained"
        )


def oddities_of_powers(dataset: RssiDataset) -> list[str]:
    """A sentence for each oddity of received powers."""
    found = []
    powers, heard = dataset.rssi_dbm, ~np.isnan(dataset.rssi_dbm)
    names = np.array(dataset.gateway_names)
    if not heard.any():
        return ["no gateway has received anything"]
    silent = names[~heard.any(axis=0)].tolist()
    if silent:
        found.append(f"{_listed(silent)} received nothing")
    lost = int((~heard.any(axis=1)).sum())
    if lost:
        found.append(f"{lost} of {len(dataset)} positions were received by no gateway")
    weak = int((powers < NOT_RECEIVED).sum())
    if weak:
        found.append(
            f"{weak} of {heard.sum()} powers lie below {NOT_RECEIVED:g} dBm, which NeRF² reads as negative amplitudes "
            f"and GSRF leaves out; put {NOT_RECEIVED:g} where nothing was received"
        )
    below = int((powers < dataset.floor_dbm).sum()) - weak
    if below > 0:
        found.append(f"{below} of {heard.sum()} powers lie below the stated floor of {dataset.floor_dbm:g} dBm")
    positive = int((powers > 0).sum())
    if positive:
        found.append(f"{positive} of {heard.sum()} powers lie above 0 dBm, which NeRF² reads as amplitudes above 1")
    constant = [
        name
        for name, power, each in zip(names.tolist(), powers.T, heard.T, strict=True)
        if each.sum() >= LEAST_POWERS and np.ptp(power[each]) == 0
    ]
    if constant:
        found.append(f"{_listed(constant)} received the same power from everywhere")
    law = DistanceLaw.of(dataset)
    if law is not None and np.median(law.exponents) < 0:
        found.append("the powers rise with the distance: do the positions and the powers belong together, row by row?")
    found += _too_strong(dataset)
    return found


def _too_strong(dataset: RssiDataset) -> list[str]:
    """Powers that are stronger than free space allows, as with positions in millimetres."""
    hertz = USUAL_FREQUENCY if dataset.frequency is None else dataset.frequency.hertz
    stated = dataset.metadata.get("receiver", {}).get("tx_power_dbm")
    sent = USUAL_POWER if stated is None else float(stated)
    distance = np.maximum(dataset.distances, dataset.wavelength)
    excess = np.nanmedian(dataset.rssi_dbm - sent - 20 * np.log10(dataset.wavelength / (4 * np.pi * distance)))
    if excess <= BELIEVED:
        return []
    return [
        f"half of the powers are more than {excess:.0f} dB above those of free space at {hertz / 1e6:g} MHz with "
        f"{sent:g} dBm: are the positions in metres (the median distance is {np.median(dataset.distances):.4g} m)?"
    ]


def _listed(names: list[str]) -> str:
    shown = ", ".join(names[:5]) + (f" and {len(names) - 5} more" if len(names) > 5 else "")
    return f"gateway {shown}" if len(names) == 1 else f"gateways {shown}"
