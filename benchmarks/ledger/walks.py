"""Datasets along one walk through a built-in place, for benchmarks of powers, channels and a moving receiver."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from learn.data.splits import SplitKind, split
from scenes.scene.description import Scene
from scenes.storage.scene_yaml import load_scene
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import read_dataset
from simulate.exchange.csi_export import export_csi
from simulate.generation.reciprocity import element_offsets
from simulate.generation.simulated_powers import simulate_rssi
from simulate.generation.simulation import simulate
from simulate.positions.placement import AT_IT, place
from simulate.spectra.measurement import Measurement

STRIDE = 4
"""One in so many positions of a simulated path, 8 mm apart, is used: every 3.2 cm, a tenth of λ at 915 MHz."""

GATEWAYS = {
    "north-west": (0.4, 9.6, 2.4),
    "north-east": (15.6, 9.6, 2.4),
    "south-west": (0.4, 0.4, 2.4),
    "south-east": (15.6, 0.4, 2.4),
    "middle": (8.0, 4.0, 2.3),
    "desk": (11.0, 3.0, 1.1),
}
"""Of the office, metres."""


def walk(scene: Scene, count: int, moving: str = "transmitter") -> Float[np.ndarray, "count 3"]:
    """Positions on the walk, metres, in whole millimetres so that no rounding changes them."""
    offsets = AT_IT if moving == "transmitter" else element_offsets(scene.gateway, scene.wavelength)
    return place(scene, "path", STRIDE * count, 0, offsets)[::STRIDE].round(3)


def powers_in_office(folder: Path) -> Dataset:
    """Powers (RSSI) at six gateways, 915 MHz, 2,200 positions; simulated where the folder lacks them."""
    scene = load_scene("office")
    if not folder.exists():
        simulate_rssi(scene, folder, GATEWAYS, positions=walk(scene, 2200), seed=0)
    return read_dataset(folder)


def channels_in_lab(folder: Path) -> Dataset:
    """Channels of 8 antennas and 26 + 26 subcarriers over 20 MHz, 2.4 GHz, SNR 25 dB, 1,400 positions.

    The responses that they are exported from are in the folder ``band``.
    """
    scene = load_scene("lab").at_frequency(2.4e9).with_array(1, 8)
    band = {"bandwidth": 20e6, "subcarriers": 52, "measurement": Measurement(snr_db=25.0)}
    export_csi(simulate(scene, folder / "band", positions=walk(scene, 1400), seed=0, **band), folder, force=True)
    return read_dataset(folder)


def receiver_in_bedroom(folder: Path) -> Dataset:
    """Spectra of an array that moves, 915 MHz, 600 positions."""
    scene = load_scene("bedroom")
    positions = walk(scene, 600, "receiver")
    return simulate(scene, folder, positions=positions, seed=0, moving="receiver")


def with_known(dataset: Dataset, kind: SplitKind, known: int) -> Dataset:
    """The dataset with the test part of a split, and so many of the other rows known; fewer are among more."""
    parts = split(dataset, kind, 0)
    drawn = np.random.default_rng(0).permutation(parts.known)
    return replace(dataset, train=np.sort(drawn[:known]), test=parts.test)
