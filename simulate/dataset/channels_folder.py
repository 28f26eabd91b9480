"""The folder of channels over subcarriers (CSI), as NeRF²'s MIMO data have it: read, written, and described."""

from __future__ import annotations

import os
from dataclasses import asdict
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Complex, Float
from msgspec import Struct
from numpy.typing import ArrayLike

from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError, ParameterError, check_array, shown
from scenes.files.input_file import MEGABYTE
from scenes.files.json_yaml_xml import read_yaml
from scenes.files.npz_file import Expected, read_npy
from scenes.files.schema import conform
from scenes.scene.frequency import read_bandwidth
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_frequency import Frequency, stated_frequency
from simulate.dataset.dataset_kinds import CHANNELS, TAKE_CHANNELS, TAKE_PLACED_CHANNELS
from simulate.dataset.index_files import read_split, write_drawn_split
from simulate.dataset.inspection import Coordinate, Inspection
from simulate.dataset.metadata import made_here, write_metadata
from simulate.dataset.receivers import Antennas
from simulate.positions.positions import box_in_words, check_points, write_positions
from simulate.spectra.band import Band

STATION = "base-station.yml"

OF_EACH = 26
"""Subcarriers that the published loaders take for the uplink. They take the others for the downlink."""

LARGEST_CHANNELS = 4000 * MEGABYTE
"""Most bytes of csidata.npy. A million rows of 8 antennas and 52 subcarriers take 3,328 MB."""


class Station(Struct):
    """The content of base-station.yml."""

    base_station: list[tuple[Coordinate, Coordinate, Coordinate]]


def read_channels(found: Inspection, wanted: float | None) -> Dataset | None:
    """Read a folder of channels, and note every problem and oddity."""
    folder, problems = found.folder, found.problems
    channels = found.noting(None, _read_array, folder / CHANNELS)
    antennas = found.noting(None, _read_station, folder / STATION)
    positions = found.positions() if os.path.lexists(folder / "tx_pos.csv") else None
    metadata = found.metadata()
    frequency = found.noting(Frequency(), stated_frequency, folder, metadata, wanted)
    if channels is None:
        return None
    count, elements, subcarriers = channels.shape
    for name, points, number, things in (
        (STATION, antennas, elements, "antennas"),
        ("tx_pos.csv", positions, count, "rows"),
    ):
        if points is not None and len(points) != number:
            problems.append(
                f"{folder / name}: expected a position for each of the {number} {things} of {CHANNELS}, found "
                f"{len(points)}"
            )
    band = found.band(metadata, None if frequency.source == "assumed" else frequency.hertz)
    if band is not None and band.subcarriers != subcarriers:
        wrong = f"expected the {subcarriers} of {CHANNELS}, found {band.subcarriers}"
        problems.append(f"{folder / 'metadata.json'}: band.subcarriers: {wrong}")
    rows = [str(number) for number in range(count)]
    train, test = read_split(found, rows, "rows")
    if problems or antennas is None:
        return None
    at = Antennas([str(number) for number in range(elements)], antennas)
    return Dataset(folder, rows, {"channel": channels}, at, positions, train, test, band, metadata, frequency)


def _read_array(path: Path) -> Complex[np.ndarray, "K A subcarriers"]:
    """Read csidata.npy. Raise an InputError if it is not finite, all zero, empty or of an odd number of subcarriers."""
    what = "channels of rows × antennas × subcarriers"
    channels = read_npy(path, Expected(what, "c", (None, None, None)), LARGEST_CHANNELS)
    if not channels.size:
        raise InputError(f"{path}: expected {what}, found none: shape {channels.shape}")
    if channels.shape[2] % 2:
        raise InputError(
            f"{path}: expected an even number of subcarriers, half of them for the uplink, found {channels.shape[2]}"
        )
    whole = np.isfinite(channels).all(axis=(1, 2))
    if not whole.all():
        row = int(np.flatnonzero(~whole)[0])
        raise InputError(
            f"{path}: expected finite numbers, found others in {int((~whole).sum())} of {len(channels)} rows, first in "
            f"row {row} (counted from 0)"
        )
    if not channels.any():
        raise InputError(f"{path}: expected channels, found zeros alone")
    return channels


def _read_station(path: Path) -> Float[np.ndarray, "A 3"]:
    content = read_yaml(path, "the antenna positions of a base station")
    if not isinstance(content, dict) or not content.get("base_station"):
        found = "nothing" if content is None else shown(content)
        raise InputError(f"{path}: expected base_station with the position [x, y, z] of each antenna, found {found}")
    return np.array(conform(content, Station, str(path), numbers_as_text=True).base_station, float)


def write_channels(
    folder: Path,
    positions: Float[np.ndarray, "K 3"] | None,
    antennas: Float[np.ndarray, "A 3"],
    channels: Complex[np.ndarray, "K A subcarriers"],
    metadata: dict[str, Any],
) -> None:
    """Write the files of a folder of channels, but for index files, into an empty folder."""
    buffer = BytesIO()
    np.save(buffer, channels)
    write_atomically(folder / CHANNELS, buffer.getvalue())
    lines = "".join(f"  - [{', '.join(f'{value:.6f}' for value in place)}]\n" for place in antennas)
    write_atomically(folder / STATION, f"base_station:\n{lines}".encode())
    if positions is not None:
        write_positions(folder / "tx_pos.csv", positions)
    write_metadata(folder / "metadata.json", metadata)


def write_given_channels(
    folder: Path,
    positions: Float[np.ndarray, "K 3"] | None,
    channels: Complex[ArrayLike, "K A subcarriers"],
    antennas: Float[ArrayLike, "A 3"] | None,
    hertz: float,
    bandwidth: float | str | None,
) -> None:
    """Write the files of channels from Python into an empty folder."""
    if antennas is None:
        raise ParameterError("antennas", "expected the positions of the antennas beside channels, found none")
    at = check_points(antennas, "antennas")
    count = None if positions is None else len(positions)
    what = f"channels of {'some' if count is None else count} positions × {len(at)} antennas × subcarriers"
    found = check_array("channels", channels, (count, len(at), None), what, "c").astype(np.complex64)
    if found.shape[2] % 2:
        raise ParameterError("channels", f"expected an even number of subcarriers, found {found.shape[2]}")
    band = given_band(found.shape, "channels", bandwidth, hertz)
    stated = {"kind": "csi", **({} if band is None else {"band": asdict(band)}), "frequency_hz": hertz}
    write_channels(folder, positions, at, found, made_here() | stated)
    write_drawn_split(folder, len(found), 0)


def given_band(shape: tuple[int, ...], name: str, bandwidth: float | str | None, hertz: float) -> Band | None:
    """The band of responses or channels; None if no bandwidth is given."""
    if bandwidth is None:
        return None
    if len(shape) != 3:
        wrong = f"expected subcarriers along the third axis beside a bandwidth, found shape {shape}"
        raise ParameterError(name, wrong)
    band = Band(read_bandwidth(bandwidth), shape[2])
    band.frequencies(hertz)  # refuses one that is too wide
    return band


def assumptions_of_channels(dataset: Dataset) -> list[str]:
    """A sentence for everything that the folder does not state and that was assumed."""
    found, each = [], dataset.uplink.shape[2]
    if dataset.metadata.get("kind") != "csi":
        halves = f"took the first {each} of {2 * each} subcarriers for the uplink and the others for the downlink"
        found.append(f"{halves}, and {STATION} for metres, as NeRF² and GSRF do")
    if dataset.frequency.source == "assumed":
        found.append("the carrier frequency is not stated, so nothing is known of the subcarriers' frequencies")
    return found


def describe_channels(dataset: Dataset) -> dict[str, str]:
    """What ``bisplat check`` prints of channels alone."""
    antennas, each = dataset.uplink.shape[1:]
    medians = [f"{np.median(np.abs(link)):.3g}" for link in (dataset.uplink, dataset.downlink)]
    takers = f"bisplat {TAKE_CHANNELS}, which predict the downlink, by NeRF² and GSRF"
    if dataset.places is not None:
        takers += f"; by bisplat {TAKE_PLACED_CHANNELS}; bisplat dataset makes spectra of csidata.npy and tx_pos.csv"
    return {
        "holds": f"channels (CSI): {len(dataset)} rows × {antennas} antennas × {2 * each} subcarriers",
        "band": "not stated" if dataset.band is None else f"{dataset.band.bandwidth / 1e6:g} MHz wide (metadata.json)",
        "task": f"the downlink (the last {each} subcarriers) from the uplink (the first {each})",
        "antennas (m)": box_in_words(dataset.gateway_positions),
        "magnitudes": f"median {medians[0]} (uplink), {medians[1]} (downlink); the unit is not stated",
        "can be used": f"by {takers}",
    }


def figures_of_channels(dataset: Dataset) -> dict[str, Any]:
    """What ``bisplat check --json`` prints of channels alone."""
    return {
        "kind": "csi",
        "rows": len(dataset),
        "antennas": dataset.uplink.shape[1],
        "subcarriers_of_each_link": dataset.uplink.shape[2],
        "bandwidth_hz": None if dataset.band is None else dataset.band.bandwidth,
        "has_positions": dataset.places is not None,
    }


def oddities_of_channels(dataset: Dataset) -> list[str]:
    """A sentence for each oddity of channels."""
    found, each = [], dataset.uplink.shape[2]
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
