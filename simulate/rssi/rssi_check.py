"""Describe a folder of received powers (RSSI) in words, for ``bisplat check``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from scenes.scene.shapes import bounding_box
from simulate.dataset.dataset_kinds import TAKE_POWERS
from simulate.dataset.dataset_reader import Inspection
from simulate.rssi.power_receiver import NOT_RECEIVED
from simulate.rssi.rssi_dataset import USUAL_FREQUENCY, RssiDataset, inspect_rssi

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
    positive = int((powers > 0).sum())
    if positive:
        found.append(f"{positive} of {heard.sum()} powers lie above 0 dBm, which NeRF² reads as amplitudes above 1")
    law = DistanceLaw.of(dataset)
    if law is not None and np.median(law.exponents) < 0:
        found.append("the powers rise with the distance: do the positions and the powers belong together, row by row?")
    return found + _too_strong(dataset)


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


LISTED = 6  # Gateways whose position is printed


@dataclass(frozen=True)
class RssiCheck(Inspection[RssiDataset]):
    """Result of the check of a folder of received powers.

    Attributes:
        problems: one sentence for each fault that makes the folder unusable.
        warnings: one sentence for each other oddity.
        dataset: the dataset. None: there are problems.
    """

    def description(self) -> dict[str, str]:
        """Describe the dataset in words.

        Returns:
            Texts by the name of the property, as ``bisplat check`` prints them; empty if there are problems.
        """
        dataset = self.dataset
        if dataset is None:
            return {}
        low, high = (corner.round(3).tolist() for corner in bounding_box(dataset.positions))
        places = zip(dataset.gateway_names, dataset.gateway_positions.round(3).tolist(), strict=True)
        at = [f"{name} {place}" for name, place in places]
        more = f" and {len(at) - LISTED} more" if len(at) > LISTED else ""
        stated = "metadata.json" if "receiver" in dataset.metadata else "the mark of the format"
        heard = ~np.isnan(dataset.rssi_dbm)
        law = DistanceLaw.of(dataset)
        split = f"{len(dataset.train)} / {len(dataset.test)}"
        return {
            "holds": f"received powers (RSSI): {len(dataset)} positions × {len(dataset.gateway_names)} gateways",
            "training / test": split if len(dataset.train) + len(dataset.test) else "no index files",
            "positions (m)": f"{low} to {high}",
            "gateways at (m)": ", ".join(at[:LISTED]) + more,
            "distances": f"{dataset.distances.min():.3g} to {dataset.distances.max():.3g} m",
            "frequency": "not stated" if dataset.frequency is None else f"{dataset.frequency} (metadata.json)",
            "floor": f"{dataset.floor_dbm:g} dBm ({stated})",
            "not received": f"{1 - heard.mean():.1%} of the powers, {NOT_RECEIVED:g} in the file",
            "powers (dBm)": self._range(),
            "distance law": "too few powers or distances to tell" if law is None else str(law),
            "can be used": f"by bisplat {TAKE_POWERS}, by bisplat.read_rssi, NeRF² and GSRF",
        }

    def _range(self) -> str:
        assert self.dataset is not None
        powers = self.dataset.rssi_dbm[~np.isnan(self.dataset.rssi_dbm)]
        if not powers.size:
            return "none"
        return f"{powers.min():.4g} to {powers.max():.4g}, median {np.median(powers):.4g}"

    def figures(self) -> dict[str, Any]:
        """The description in numbers, as ``bisplat check --json`` prints it; empty if there are problems."""
        dataset = self.dataset
        if dataset is None:
            return {}
        heard = ~np.isnan(dataset.rssi_dbm)
        powers, law = dataset.rssi_dbm[heard], DistanceLaw.of(dataset)
        return {
            "kind": "rssi",
            "positions": len(dataset),
            "gateways": dataset.gateway_names,
            "frequency_hz": None if dataset.frequency is None else dataset.frequency.hertz,
            "floor_dbm": dataset.floor_dbm,
            "not_received": round(1 - float(heard.mean()), 4),
            "weakest_dbm": float(powers.min()) if powers.size else None,
            "strongest_dbm": float(powers.max()) if powers.size else None,
            "distance_exponent": None if law is None else round(float(np.median(law.exponents)), 3),
            "train": len(dataset.train),
            "test": len(dataset.test),
        }


def check_rssi(folder: Path) -> RssiCheck:
    """Check a folder of received powers. An invalid folder raises no error; the result lists its faults."""
    inspection = inspect_rssi(folder)
    odd = [] if inspection.dataset is None else oddities_of_powers(inspection.dataset)
    return RssiCheck(inspection.problems, [*inspection.warnings, *odd], inspection.dataset)
