"""Describe a folder of channels over subcarriers (CSI) in words, for ``bisplat check``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from scenes.scene.shapes import bounding_box
from simulate.csi.csi_dataset import OF_EACH, CsiDataset, inspect_csi
from simulate.dataset.dataset_kinds import TAKE_CHANNELS, TAKE_PLACED_CHANNELS
from simulate.dataset.dataset_reader import Inspection


@dataclass(frozen=True)
class CsiCheck(Inspection[CsiDataset]):
    """Result of the check of a folder of channels over subcarriers.

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
        antennas, each = dataset.uplink.shape[1:]
        split = f"{len(dataset.train)} / {len(dataset.test)}"
        use = f"by bisplat {TAKE_CHANNELS}, which predict the downlink, by bisplat.read_csi, NeRF² and GSRF"
        if dataset.positions is not None:
            use += f"; by bisplat {TAKE_PLACED_CHANNELS}; bisplat dataset makes spectra of csidata.npy and tx_pos.csv"
        return {
            "holds": f"channels (CSI): {len(dataset)} rows × {antennas} antennas × {2 * each} subcarriers",
            "task": f"the downlink (the last {each} subcarriers) from the uplink (the first {each})",
            "training / test": split if len(dataset.train) + len(dataset.test) else "no index files",
            "antennas (m)": _box(dataset.antenna_positions),
            "positions (m)": "not stated" if dataset.positions is None else _box(dataset.positions),
            "frequency": self._frequency(dataset),
            "magnitudes": f"median {np.median(np.abs(dataset.uplink)):.3g} (uplink), "
            f"{np.median(np.abs(dataset.downlink)):.3g} (downlink); the unit is not stated",
            "can be used": use,
        }

    def _frequency(self, dataset: CsiDataset) -> str:
        if dataset.frequency is None:
            return "not stated"
        if dataset.band is None:
            return f"{dataset.frequency} (metadata.json); bandwidth not stated"
        return f"{dataset.frequency}, {dataset.band.bandwidth / 1e6:g} MHz wide (metadata.json)"

    def figures(self) -> dict[str, Any]:
        """The description in numbers, as ``bisplat check --json`` prints it; empty if there are problems."""
        dataset = self.dataset
        if dataset is None:
            return {}
        return {
            "kind": "csi",
            "rows": len(dataset),
            "antennas": dataset.uplink.shape[1],
            "subcarriers_of_each_link": dataset.uplink.shape[2],
            "frequency_hz": None if dataset.frequency is None else dataset.frequency.hertz,
            "bandwidth_hz": None if dataset.band is None else dataset.band.bandwidth,
            "has_positions": dataset.positions is not None,
            "train": len(dataset.train),
            "test": len(dataset.test),
        }


def check_csi(folder: Path) -> CsiCheck:
    """Check a folder of channels. An invalid folder raises no error; the result lists its faults."""
    inspection = inspect_csi(folder)
    odd = [] if inspection.dataset is None else _oddities(inspection.dataset)
    return CsiCheck(inspection.problems, [*inspection.warnings, *odd], inspection.dataset)


def _oddities(dataset: CsiDataset) -> list[str]:
    """A sentence for each oddity of the channels, and for each assumption."""
    found = dataset.assumptions()
    each = dataset.uplink.shape[2]
    if each != OF_EACH:
        found.append(
            f"the loaders of NeRF² and GSRF take {OF_EACH} subcarriers for the uplink and the rest for the downlink, "
            f"and there are {2 * each} in all"
        )
    if np.array_equal(dataset.uplink, dataset.downlink):
        found.append("the downlink equals the uplink, so there is nothing to predict")
    silent = int((~(dataset.uplink.any(axis=(1, 2)) & dataset.downlink.any(axis=(1, 2)))).sum())
    if silent:
        found.append(f"{silent} of {len(dataset)} rows have a link of zeros alone")
    return found


def _box(points: np.ndarray) -> str:
    low, high = (corner.round(3).tolist() for corner in bounding_box(points))
    return f"{low} to {high}"
