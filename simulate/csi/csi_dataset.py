"""A folder of channels over subcarriers (CSI) in memory, and the check that it is valid.

Rows are numbered from 0, in memory and in the files.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from jaxtyping import Complex, Float, Int
from msgspec import Meta, Struct

from scenes.files.errors import InputError, ParameterError, require_path, shown
from scenes.files.input_file import MEGABYTE, what_is_at
from scenes.files.json_yaml_xml import read_yaml
from scenes.files.long_work import doing
from scenes.files.npz_file import Expected, read_npy
from scenes.files.plain_text import say
from scenes.files.schema import conform
from scenes.scene.description import SPEED_OF_LIGHT
from scenes.scene.frequency import read_frequency
from simulate.dataset.dataset_frequency import Frequency
from simulate.dataset.dataset_kinds import CHANNELS, content_of, is_csi
from simulate.dataset.dataset_reader import Inspection, noting, read_metadata
from simulate.dataset.index_files import numbered_split
from simulate.dataset.metadata import band_of
from simulate.positions.positions import FARTHEST, read_points
from simulate.spectra.band import Band

STATION = "base-station.yml"

OF_EACH = 26
"""Subcarriers that the published loaders take for the uplink. They take the others for the downlink."""

LARGEST_CHANNELS = 4000 * MEGABYTE
"""Most bytes of csidata.npy. A million rows of 8 antennas and 52 subcarriers take 3,328 MB."""

Coordinate = Annotated[float, Meta(ge=-FARTHEST, le=FARTHEST)]


class Station(Struct):
    """The content of base-station.yml."""

    base_station: list[tuple[Coordinate, Coordinate, Coordinate]]


@dataclass(frozen=True)
class CsiDataset:
    """A folder of channels over subcarriers (CSI) in memory: K rows, A antennas, S subcarriers of each link.

    ``read_csi`` reads one. The format is that of NeRF²'s MIMO data [zhao2023], which GSRF reads, too. Its task is to
    predict the downlink from the uplink.

    Attributes:
        folder: the folder that the dataset was read from.
        uplink: channels of the uplink, [K, A, S].
        downlink: channels of the downlink, [K, A, S].
        antenna_positions: positions of the base station's antennas, metres, [A, 3].
        positions: positions of the client, metres, in the same frame, [K, 3]; None if tx_pos.csv is not there. The
            published data have none.
        train: rows of the folder's own training part; empty if it has no index files.
        test: rows of the folder's own test part; empty if it has no index files.
        metadata: content of metadata.json; empty if the folder has none.

    Example:
        >>> import bisplat, numpy as np
        >>> array = bisplat.PlanarArray(1, 8)
        >>> y = array.manifold(np.zeros(3), np.radians([30.0, 40.0, 50.0]))[..., None] * np.ones(52)
        >>> wide = bisplat.write_dataset("data/mimo", np.eye(3), y, array, "2.4 GHz", bandwidth="20 MHz")
        >>> bisplat.export_csi(wide, "mimo")
        >>> csi = bisplat.read_csi("mimo")
        >>> csi
        CsiDataset('mimo': 3 rows, 8 antennas, 26 + 26 subcarriers, 2400 MHz)
        >>> csi.uplink.shape, csi.downlink.shape, csi.antenna_positions.shape, csi.frequencies.shape
        ((3, 8, 26), (3, 8, 26), (8, 3), (52,))
    """

    folder: Path
    uplink: Complex[np.ndarray, "K A S"]
    downlink: Complex[np.ndarray, "K A S"]
    antenna_positions: Float[np.ndarray, "A 3"]
    positions: Float[np.ndarray, "K 3"] | None
    train: Int[np.ndarray, " K_train"]
    test: Int[np.ndarray, " K_test"]
    metadata: dict[str, Any] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.uplink)

    def __repr__(self) -> str:
        known = "frequency not stated" if self.frequency is None else f"{self.frequency.hertz / 1e6:g} MHz"
        antennas, each = self.uplink.shape[1:]
        what = f"{len(self)} rows, {antennas} antennas, {each} + {each} subcarriers, {known}"
        return f"CsiDataset({str(self.folder)!r}: {what})"

    @property
    def frequency(self) -> Frequency | None:
        """The carrier frequency (``hertz``), as metadata.json states it; None if it does not."""
        stated = self.metadata.get("frequency_hz")
        return None if stated is None else Frequency(read_frequency(stated), "metadata")

    @property
    def wavelength(self) -> float | None:
        """Wavelength of the carrier, metres; None if no frequency is stated."""
        return None if self.frequency is None else SPEED_OF_LIGHT / self.frequency.hertz

    @property
    def band(self) -> Band | None:
        """The band of both links together, as metadata.json states it; None if it does not."""
        return band_of(self.metadata)

    @property
    def frequencies(self) -> Float[np.ndarray, " subcarriers"] | None:
        """Frequencies of the uplink's subcarriers, then of the downlink's, Hz, [2 S]; None if they are not stated."""
        return None if self.band is None or self.frequency is None else self.band.frequencies(self.frequency.hertz)

    def assumptions(self) -> list[str]:
        """A sentence for everything that the folder does not state and that was assumed."""
        sentences = []
        if self.metadata.get("kind") != "csi":
            each = self.uplink.shape[2]
            halves = f"took the first {each} of {2 * each} subcarriers for the uplink and the others for the downlink"
            sentences.append(f"{halves}, and {STATION} for metres, as NeRF² and GSRF do")
        if self.frequency is None:
            sentences.append("the carrier frequency is not stated, so nothing is known of the subcarriers' frequencies")
        return sentences


def read_csi(folder: Path | str) -> CsiDataset:
    """Read and check a folder of channels over subcarriers (CSI): NeRF²'s MIMO data, or what ``export_csi`` wrote.

    The folder needs ``csidata.npy``, complex [K, antennas, subcarriers], and ``base-station.yml`` with the key
    ``base_station``, a position for each antenna. Index files, which count from 0, tx_pos.csv and metadata.json are
    read if they are there. What the folder does not state and is assumed is printed.

    Args:
        folder: the folder.

    Returns:
        The dataset.

    Raises:
        InputError: a file is missing, damaged or inconsistent with another one, or the number of subcarriers is odd.
            The message states the first problem and the number of further ones.

    Example:
        >>> import bisplat
        >>> bisplat.read_csi("data/lab")
        Traceback (most recent call last):
        scenes.files.errors.InputError: data/lab: expected channels (csidata.npy), found spectra
    """
    require_path(folder=folder)
    doing(f"{folder}: reading channels")
    dataset = inspect_csi(Path(folder)).usable()
    doing("")
    for sentence in dataset.assumptions():
        say(f"{folder}: {sentence}")
    return dataset


def inspect_csi(folder: Path) -> Inspection[CsiDataset]:
    """Read a folder and collect every problem, instead of stopping at the first."""
    if not folder.is_dir():
        return Inspection([f"{folder}: expected a folder of channels, found {what_is_at(folder)}"], [], None)
    if not is_csi(folder):
        found = content_of(folder) or "no such file"
        return Inspection([f"{folder}: expected channels ({CHANNELS}), found {found}"], [], None)
    problems: list[str] = []
    warnings: list[str] = []
    channels = noting(problems, None, _read_channels, folder / CHANNELS)
    antennas = noting(problems, None, _read_station, folder / STATION)
    there = os.path.lexists(folder / "tx_pos.csv")
    positions = noting(problems, None, read_points, folder / "tx_pos.csv") if there else None
    metadata = read_metadata(folder / "metadata.json", problems)
    if channels is None:
        return Inspection(problems, warnings, None)
    count, elements, subcarriers = channels.shape
    if antennas is not None and len(antennas) != elements:
        problems.append(
            f"{folder / STATION}: expected a position for each of the {elements} antennas of {CHANNELS}, "
            f"found {len(antennas)}"
        )
    if positions is not None and len(positions) != count:
        problems.append(
            f"{folder / 'tx_pos.csv'}: expected a position for each of the {count} rows of {CHANNELS}, found "
            f"{len(positions)}"
        )
    _check_band(folder / "metadata.json", metadata, subcarriers, problems)
    train, test = numbered_split(folder, count, problems, warnings)
    if problems or antennas is None:
        return Inspection(problems, warnings, None)
    each = subcarriers // 2
    up, down = channels[..., :each], channels[..., each:]
    return Inspection(problems, warnings, CsiDataset(folder, up, down, antennas, positions, train, test, metadata))


def _read_channels(path: Path) -> Complex[np.ndarray, "K A subcarriers"]:
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


def _check_band(path: Path, metadata: dict[str, Any], subcarriers: int, problems: list[str]) -> None:
    """Look for a band in metadata.json that the channels cannot have."""
    band = band_of(metadata)
    if band is None:
        return
    if band.subcarriers != subcarriers:
        problems.append(f"{path}: band.subcarriers: expected the {subcarriers} of {CHANNELS}, found {band.subcarriers}")
    if "frequency_hz" in metadata:
        try:
            band.frequencies(read_frequency(metadata["frequency_hz"]))
        except ParameterError as error:
            problems.append(f"{path}: band.{error}")
