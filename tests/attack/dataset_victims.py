"""Victims among the kinds of datasets: bands, several frequencies, moving arrays, given elements, CSI, recordings."""

from __future__ import annotations

import json
from pathlib import Path

import h5py
import numpy as np
import scipy.io

from simulate.dataset.written_dataset import write_dataset
from simulate.exchange.csi_export import export_csi
from simulate.spectra.array import PlanarArray
from simulate.spectra.element_array import ElementArray
from tests.attack import changes
from tests.attack.victims import JSON, NPZ, RECORDED, TEXT, YAML, Victim, Ways, victims_of

NPY: Ways = (changes.damaged, changes.npy_of, changes.npy_of)
MAT: Ways = (changes.damaged, changes.mat_of, changes.mat_of)
H5: Ways = (changes.damaged, changes.h5_of, changes.h5_of)

COUNT = 12  # Positions of each dataset

BANDS = victims_of(
    "band",
    [("metadata.json", JSON), ("channels.npz", NPZ), ("channels.npz", NPZ)],
    "check band",
    then="export band --csi out",
)

SEVERAL = victims_of(
    "several",
    [("freq.txt", TEXT), ("metadata.json", JSON), ("tx_pos.csv", TEXT)],
    "check several",
    then="dataset several -o out --frequency 2.4GHz",
)

MOVING = victims_of(
    "moving",
    [("metadata.json", JSON), ("gateway_info.yml", YAML), ("tx_pos.csv", TEXT), ("channels.npz", NPZ)],
    "check moving",
    output=("out.h5",),
    then="export moving --hdf5 out.h5",
)

ELEMENTS = (
    *victims_of("circle", [("metadata.json", JSON), ("channels.npz", NPZ)], "check circle", output=()),
    Victim(
        "elements.csv",
        "dataset recordings/log.npz -o out --frequency 2.4GHz --array elements.csv --boresight 1 0 0",
        TEXT,
        ("elements.csv", "recordings"),
        then="check out",
    ),
)

CHANNELS = (
    *victims_of(
        "csi",
        [
            ("csidata.npy", NPY),
            ("base-station.yml", YAML),
            ("tx_pos.csv", TEXT),
            ("train_index.txt", TEXT),
            ("metadata.json", JSON),
        ],
        "check csi",
        output=(),
    ),
    *victims_of("csi", [("csidata.npy", NPY), ("test_index.txt", TEXT)], "compare csi -o out"),
)

LOGS = tuple(
    victim
    for name, (ways, command) in {
        "H.npy": (NPY, f"dataset logs/H.npy logs/places.csv -o out {RECORDED}"),
        "places.csv": (TEXT, f"dataset logs/H.npy logs/places.csv -o out {RECORDED}"),
        "polar.csv": (TEXT, "dataset logs/polar.csv -o out --frequency 2.4GHz --array 1x1@0.5"),
        "log.mat": (MAT, f"dataset logs/log.mat -o out {RECORDED}"),
        "band.h5": (H5, f"dataset logs/band.h5 -o out --bandwidth 20MHz {RECORDED}"),
        "tag.npz": (NPZ, f"dataset logs/tag.npz -o out --round-trip {RECORDED}"),
    }.items()
    for victim in victims_of("logs", [(name, ways)], command, then="check out")
)

KINDS = {
    "bands": BANDS,
    "several frequencies": SEVERAL,
    "moving receivers": MOVING,
    "given elements": ELEMENTS,
    "channels": CHANNELS,
    "logs": LOGS,
}
"""Each group gets as many attacks as any other."""


def make_kinds(folder: Path) -> None:
    """Write the valid files."""
    generator = np.random.default_rng(1)
    places = generator.uniform((2, -1, 0), (4, 1, 2), (COUNT, 3))
    parts = generator.normal(size=(2, COUNT, 4, 6))
    band = parts[0] + 1j * parts[1]
    narrow, square = band[..., 3], PlanarArray(2, 2)
    write_dataset(folder / "band", places, band, square, 2.4e9, bandwidth=20e6)
    write_dataset(folder / "moving", places, narrow, square, 2.4e9, moving="receiver")
    circle = ElementArray.circle(4, radius_m=0.05)
    write_dataset(folder / "circle", places, narrow, circle, 2.4e9)
    np.savetxt(folder / "elements.csv", circle.positions_m, "%.6f", ",", header="x,y,z", comments="")
    export_csi(folder / "band", folder / "csi")
    (folder / "csi" / "train_index.txt").write_text("0\n1\n2\n3\n4\n5\n6\n7\n8\n")
    (folder / "csi" / "test_index.txt").write_text("9\n10\n11\n")
    _make_several(folder / "several", places, narrow, square)
    _make_logs(folder / "logs", places, band)


def _make_several(folder: Path, places: np.ndarray, narrow: np.ndarray, array: PlanarArray) -> None:
    """Half of the pictures are of one frequency, and half of another one at the same positions."""
    write_dataset(folder, places, narrow, array, 2.4e9)
    metadata = json.loads((folder / "metadata.json").read_text())
    metadata |= {"frequency_hz": 2.4e9, "frequencies_hz": [2.4e9, 5.2e9]}
    (folder / "metadata.json").write_text(json.dumps(metadata))
    (folder / "freq.txt").write_text("2.4\n" * (COUNT // 2) + "5.2\n" * (COUNT // 2))


def _make_logs(folder: Path, places: np.ndarray, band: np.ndarray) -> None:
    """Positions and responses in the files that ``bisplat dataset`` reads."""
    folder.mkdir()
    values = band[..., 3]
    np.save(folder / "H.npy", values)
    np.savetxt(folder / "places.csv", 1000 * places, "%.3f", ",", header="x [mm],y [mm],z [mm]", comments="")
    one = np.column_stack([places, 20 * np.log10(np.abs(values[:, 0])), np.degrees(np.angle(values[:, 0]))])
    np.savetxt(folder / "polar.csv", one, "%.4f", ",", header="x,y,z,rssi,phase_deg", comments="")
    scipy.io.savemat(folder / "log.mat", {"pos": places, "H": values})
    with h5py.File(folder / "band.h5", "w") as file:
        file["pos"], file["H"] = places, band
    np.savez(folder / "tag.npz", position=places[:, :2], phasor=values**2, frequency=np.full(COUNT, 2.4e9))
