"""Describe a folder of received powers (RSSI) in words, for ``bisplat check``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from scenes.scene.shapes import bounding_box
from simulate.dataset.folder_kinds import TAKE_POWERS
from simulate.dataset.inspection import Inspection
from simulate.rssi.distance_law import DistanceLaw, oddities_of_powers
from simulate.rssi.power_range import NOT_RECEIVED
from simulate.rssi.rssi_dataset import RssiDataset, inspect_rssi

LISTED = 6
"""Gateways whose position is printed."""


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
