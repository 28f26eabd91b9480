"""Export of a dataset to one HDF5 file for other programs, such as MATLAB. The documentation describes its content."""

from __future__ import annotations

import json
from dataclasses import asdict
from io import FileIO
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from scenes.files.atomic import written_atomically
from scenes.files.progress import progress_bar
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import given_dataset
from simulate.spectra.angular_grid import COLUMNS, ROWS
from simulate.spectra.array import PlanarArray

AT_ONCE = 100  # Spectra written at a time. This bounds the memory.


def export_hdf5(dataset: Dataset | Path | str, path: Path) -> None:
    """Write a dataset, simulated or measured, as one HDF5 file, for example for MATLAB.

    The file has these arrays; those that the dataset lacks are missing or empty:

    - ``spectra``: grey levels, uint8, [K, 90, 360];
    - ``responses`` and ``retrieved_responses``: element responses, complex64, [K, elements];
    - ``band_responses``: responses at all subcarriers, complex64, [K, elements, subcarriers];
    - ``positions_m``: positions of what moves, by default the transmitter, metres, world frame, [K, 3];
    - ``receivers_m``: middle of the array for each spectrum, if both ends move, metres, world frame, [K, 3];
    - ``names``: names of the pictures, [K];
    - ``train_index`` and ``test_index``: indices of spectra, from 0;
    - ``metadata_json``: content of metadata.json, a text.

    A dataset of received powers (RSSI) has ``rssi_dbm``, [K, G], NaN where nothing was received, and ``gateway_names``
    and ``gateway_positions_m`` instead of spectra, responses and names, and the attribute ``floor_dbm``.

    Attributes of the file state the gateway's position and orientation, the frequency, the array and the grid. Their
    names end with the unit, such as ``frequency_hz``.
    """
    dataset = given_dataset(dataset, "spectrum", "power")
    with written_atomically(path) as unfinished, _Disk(unfinished, "w+") as disk:
        try:
            with h5py.File(disk, "w") as file:
                file["positions_m"] = dataset.positions
                file["train_index"], file["test_index"] = dataset.train, dataset.test
                file["metadata_json"] = json.dumps(dataset.metadata, ensure_ascii=False)
                if "power" in dataset.values:
                    _write_powers(file, dataset)
                else:
                    _write_attributes(file, dataset)
                    _write_responses(file, dataset)
                    _write_spectra(file, dataset, disk)
        except (OSError, RuntimeError, ValueError, KeyError):  # from HDF5, when it reads what could not be written
            disk.check()
            raise
        disk.check()


class _Disk(FileIO):
    """A file for HDF5 that hides errors until ``check`` raises them; HDF5 crashes the process when the disk is full."""

    failure: OSError | None = None

    def write(self, content: Any) -> int:
        rest = memoryview(content).cast("B")
        size = len(rest)
        try:
            while len(rest):
                rest = rest[super().write(rest) :]
        except OSError as error:
            self.failure = self.failure or error
        return size

    def truncate(self, size: int | None = None) -> int:
        try:
            return super().truncate(size)
        except OSError as error:
            self.failure = self.failure or error
            return size or 0

    def check(self) -> None:
        if self.failure is not None:
            raise self.failure


def _write_powers(file: h5py.File, dataset: Dataset) -> None:
    file.attrs["floor_dbm"] = dataset.floor_dbm
    if dataset.frequency.source != "assumed":
        file.attrs["frequency_hz"] = dataset.frequency.hertz
    file["rssi_dbm"] = dataset.powers
    file["gateway_positions_m"] = dataset.gateway_positions
    file["gateway_names"] = np.array([name.encode() for name in dataset.gateway_names], dtype="S")


def _write_attributes(file: h5py.File, dataset: Dataset) -> None:
    """Write the attributes: single numbers and texts. Their names end with the unit."""
    array = dataset.array
    file.attrs.update(
        {
            "gateway_position_m": dataset.gateway_position,
            "gateway_orientation_xyzw": dataset.gateway_orientation,
            "frequency_hz": dataset.frequency.hertz,
            "frequency_source": dataset.frequency.source,
            "moving": dataset.moving,
            "array_source": dataset.identification.source,
            **asdict(dataset.grid),
        }
    )
    if isinstance(array, PlanarArray):
        file.attrs["array_rows"], file.attrs["array_columns"] = array.rows, array.columns
        file.attrs["array_spacing_wavelengths"] = array.spacing
    else:
        file.attrs["element_positions_m"] = np.array(array.stated()["positions_m"])


def _write_responses(file: h5py.File, dataset: Dataset) -> None:
    """Write the names, the receivers if both ends move, and the responses that there are."""
    if dataset.moving == "both":
        file["receivers_m"] = dataset.receivers
    file["names"] = np.array(dataset.names, dtype="S")
    kinds = {}
    if "response" in dataset.values:
        kinds["responses"] = dataset.responses
    if "retrieved" in dataset.values:
        kinds["retrieved_responses"] = dataset.retrieved
    if dataset.band is not None:
        file.attrs["bandwidth_hz"] = dataset.band.bandwidth
        kinds["band_responses"] = dataset.band_responses
    for name, responses in kinds.items():
        file.create_dataset(name, data=responses, chunks=True, compression="gzip", shuffle=True)


def _write_spectra(file: h5py.File, dataset: Dataset, disk: _Disk) -> None:
    """Write the pictures' grey levels, one chunk for each picture."""
    pictures = dataset.pictures
    spectra = file.create_dataset("spectra", pictures.shape, "u1", chunks=(1, ROWS, COLUMNS), compression="gzip")
    with progress_bar() as progress:
        bar = progress.add_task("spectra", total=len(pictures))
        for start in range(0, len(pictures), AT_ONCE):
            part = pictures[start : start + AT_ONCE]
            spectra[start : start + len(part)] = part
            disk.check()
            progress.advance(bar, len(part))
