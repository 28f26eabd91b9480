"""A NeRF² dataset folder in memory, and the check that it is valid. The documentation describes every file.

Rows of ``tx_pos.csv`` and pictures are numbered from 1. Everything in memory is numbered from 0.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Complex, Float, Int, UInt8

from scenes.files.errors import InputError, ParameterError, require_path
from scenes.files.input_file import what_is_at
from scenes.files.plain_text import say
from scenes.scene.frequency import read_frequency
from simulate.dataset.dataset_frequency import Frequency, frequency_of
from simulate.dataset.dataset_reader import changed_places, read_gateway, read_metadata, read_receivers
from simulate.dataset.folder_kinds import not_spectra, unfinished
from simulate.dataset.index_files import read_split
from simulate.dataset.inspection import Inspection
from simulate.dataset.metadata import band_of
from simulate.dataset.moving import Moving
from simulate.dataset.oddities import oddities
from simulate.dataset.picture_files import read_pictures
from simulate.dataset.responses_file import check_responses, read_responses
from simulate.positions.given_positions import read_points
from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.array import Array, PlanarArray
from simulate.spectra.band import Band
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.identification import Identification, identify, stated_array, stated_grid
from simulate.spectra.spectrum import spectrum_of


@dataclass(frozen=True)
class Dataset:
    """A NeRF² dataset folder in memory: K spectra with their transmitter positions.

    ``read_dataset`` reads one, and ``simulate`` returns one. The format is that of NeRF² [zhao2023]. The arrays of a
    dataset are numbered from 0, whereas the files number the pictures from 1.

    Attributes:
        folder: the folder that the dataset was read from.
        names: names of the K pictures, padded with zeros, such as "00001".
        pictures: grey levels 0…255 of the spectra's magnitude, min–max normalised for each spectrum, [K, 90, 360];
            rows and columns are the directions of ``grid``.
        positions: rows of tx_pos.csv: where the end that moves is, metres, world frame, [K, 3]. If both ends move, they
            are the transmitter's. ``transmitters`` and ``receivers`` are both ends, whichever moves.
        gateway_position: position of the gateway, where the other end stands, metres, world frame, [3].
        gateway_orientation: unit quaternion (x, y, z, w) that turns the gateway frame into the world frame, [4].
        train: indices of the folder's own training spectra; empty if the folder has no index files.
        test: indices of the folder's own test spectra; empty if the folder has no index files.
        responses: recorded complex element responses, not normalised, [K, elements]. Simulated folders have them;
            None for other folders.
        retrieved: element responses that ``bisplat responses`` found from the pictures, [K, elements]; None if the
            folder has none. Each row is known up to a common phase and the flip ``y_m -> conj(y_{MN−1−m})``, so phases
            of two positions cannot be compared.
        band: the subcarriers around the carrier; None if there are only responses at the carrier.
        band_responses: recorded responses at all subcarriers, [K, elements, subcarriers]; None if there are none.
            ``responses`` or ``retrieved`` are those of the carrier.
        metadata: content of metadata.json; empty if the folder has none.
        identification: the array and the grid of the spectra (``beamformer``), how they are known (``source`` and
            ``grid_source``: "metadata", "fitted" or "assumed"), and the error that they leave (``residual``, grey
            levels of 255).
        frequency: the frequency (``hertz``), and how it is known (``source``: "metadata", "freq.txt" or "assumed").
        moving_receivers: rows of rx_pos.csv, if both ends move: the middle of the array, metres, world frame, [K, 3].
            None: one end stands still.

    Example:
        >>> import bisplat
        >>> dataset = bisplat.read_dataset("data/lab")
        >>> dataset.positions.shape, dataset.pictures.shape, dataset.responses.shape
        ((40, 3), (40, 90, 360), (40, 16))
        >>> len(dataset.train), len(dataset.test), round(dataset.wavelength, 3)
        (32, 8, 0.328)
        >>> dataset
        Dataset('data/lab': 40 spectra, 4 × 4 elements, 915 MHz)
        >>> len(dataset)
        40
    """

    folder: Path
    names: list[str]
    pictures: UInt8[np.ndarray, "K 90 360"]
    positions: Float[np.ndarray, "K 3"]
    gateway_position: Float[np.ndarray, 3]
    gateway_orientation: Float[np.ndarray, 4]
    train: Int[np.ndarray, " K_train"]
    test: Int[np.ndarray, " K_test"]
    responses: Complex[np.ndarray, "K elements"] | None = None
    retrieved: Complex[np.ndarray, "K elements"] | None = None
    band: Band | None = None
    band_responses: Complex[np.ndarray, "K elements subcarriers"] | None = None
    metadata: dict[str, Any] = field(default_factory=dict)
    identification: Identification = field(default_factory=Identification)
    frequency: Frequency = field(default_factory=Frequency)
    moving_receivers: Float[np.ndarray, "K 3"] | None = None

    def __len__(self) -> int:
        return len(self.names)

    def __repr__(self) -> str:
        array = self.array
        elements = f"{array.rows} × {array.columns} elements" if isinstance(array, PlanarArray) else array.in_words
        frequency = f"{self.frequency.hertz / 1e6:g} MHz{self._over()}"
        return f"Dataset({str(self.folder)!r}: {len(self)} spectra, {elements}, {frequency})"

    def _over(self) -> str:
        if self.band is None:
            return ""
        return f", {self.band.subcarriers} subcarriers over {self.band.bandwidth / 1e6:g} MHz"

    @property
    def beamformer(self) -> Beamformer:
        """The array and the grid that the spectra were made with.

        Example:
            The pictures are the normalised spectra of the responses, rounded to 8 bits:

            >>> import bisplat
            >>> dataset = bisplat.read_dataset("data/lab")
            >>> spectrum = dataset.beamformer.spectrum(dataset.responses[0])
            >>> spectrum = (spectrum - spectrum.min()) / (spectrum.max() - spectrum.min())
            >>> bool(abs(spectrum - dataset.spectra[0]).max() < 1 / 255)
            True
        """
        return self.identification.beamformer

    @property
    def array(self) -> Array:
        """The gateway's array."""
        return self.beamformer.array

    @property
    def grid(self) -> AngularGrid:
        """The directions of the spectra's rows and columns, gateway frame."""
        return self.beamformer.grid

    @property
    def wavelength(self) -> float:
        """Wavelength in air, metres, at ``frequency``."""
        return self.frequency.wavelength

    @property
    def moving(self) -> Moving:
        """What moves: "transmitter", "receiver" or "both". An end that does not is at the gateway's position."""
        return self.metadata.get("moving", "transmitter")

    @property
    def transmitters(self) -> Float[np.ndarray, "K 3"]:
        """Where the transmitter of each spectrum is, whichever end moves, metres, world frame, [K, 3].

        Example:
            >>> import bisplat
            >>> dataset = bisplat.read_dataset("data/lab")
            >>> bool((dataset.transmitters == dataset.positions).all()), dataset.receivers[0].tolist()
            (True, [7.2, 3.0, 1.4])
        """
        return self._standing if self.moving == "receiver" else self.positions

    @property
    def receivers(self) -> Float[np.ndarray, "K 3"]:
        """Where the middle of the array is for each spectrum, whichever end moves, metres, world frame, [K, 3]."""
        if self.moving_receivers is not None:
            return self.moving_receivers
        return self.positions if self.moving == "receiver" else self._standing

    @property
    def _standing(self) -> Float[np.ndarray, "K 3"]:
        return np.tile(self.gateway_position, (len(self), 1))

    @cached_property
    def fingerprint(self) -> str:
        """SHA-256 of the names, positions and pictures, which tells whether two folders hold the same spectra.

        Example:
            >>> import bisplat
            >>> dataset = bisplat.read_dataset("data/lab")
            >>> len(dataset.fingerprint), dataset.fingerprint == bisplat.read_dataset("data/lab").fingerprint
            (64, True)
        """
        digest = hashlib.sha256("\n".join(self.names).encode())
        digest.update(np.ascontiguousarray(self.positions, dtype="<f8").data)
        if self.moving_receivers is not None:
            digest.update(np.ascontiguousarray(self.moving_receivers, dtype="<f8").data)
        digest.update(np.ascontiguousarray(self.pictures).data)
        return digest.hexdigest()

    @property
    def spectra(self) -> Float[np.ndarray, "K 90 360"]:
        """The pictures as numbers from 0 to 1 (grey levels / 255), float32, [K, 90, 360].

        Every published loader of this format reads the pictures in this way. Each access computes the array anew.
        """
        return spectrum_of(self.pictures)

    def assumptions(self) -> list[str]:
        """A sentence for each physical quantity that the folder does not state and its pictures do not show."""
        found = []
        if self.frequency.source == "assumed":
            found.append(
                f"the frequency is assumed to be {self.frequency}, a wavelength of {self.wavelength * 100:.1f} cm; "
                'state it in metadata.json, such as {"frequency_hz": 2.4e9}'
            )
        array, rows = self.array, self.grid.elevations_deg
        if self.identification.source == "assumed":
            found.append(
                f"the array is assumed to have {array.in_words.replace('λ', 'wavelengths')}; state it as array in "
                "metadata.json (bisplat check says what the pictures show)"
            )
        if self.identification.grid_source == "assumed":
            found.append(
                f"the rows of the pictures are assumed to be elevations from {rows[0]:g}° to {rows[-1]:g}°; state them "
                "as grid in metadata.json"
            )
        return found


def read_dataset(folder: Path | str, frequency: float | str | None = None) -> Dataset:
    """Read and check a NeRF² dataset folder, simulated or measured.

    The folder needs the pictures ``spectrum/00001.png`` and on, ``tx_pos.csv`` and ``gateway_info.yml``. Element
    responses, metadata and index files are read if they are there. If metadata.json does not state the array and the
    grid of the spectra, they are found by a fit to the pictures. What the folder does not state and the pictures do not
    show, such as the frequency, is assumed, and a line on stderr says so.

    Args:
        folder: the dataset folder.
        frequency: of a folder with pictures of several frequencies, the one to read: hertz, or a text with a unit such
            as "2.4 GHz". None: the folder has only one.

    Returns:
        The dataset.

    Raises:
        ParameterError: the frequency is none.
        InputError: a file is missing, damaged or inconsistent with another one. The message states the first problem
            and the number of further ones.

    Example:
        >>> import bisplat
        >>> dataset = bisplat.read_dataset("data/lab")
        >>> dataset.names[:3], dataset.spectra.shape, dataset.array.elements
        (['00001', '00002', '00003'], (40, 90, 360), 16)
        >>> bisplat.read_dataset("data/attic")
        Traceback (most recent call last):
        scenes.files.errors.InputError: data/attic: expected a dataset folder, found nothing there
    """
    require_path(folder=folder)
    dataset = inspect(Path(folder), None if frequency is None else read_frequency(frequency)).usable()
    place = Path(folder).resolve()
    for sentence in dataset.assumptions():
        if (place, sentence) not in _SAID:  # many programs read a dataset more than once
            _SAID.add((place, sentence))
            say(f"warning: {folder}: {sentence}")
    return dataset


_SAID: set[tuple[Path, str]] = set()


def inspect(folder: Path, wanted: float | None = None) -> Inspection[Dataset]:
    """Read a folder and collect every problem, instead of stopping at the first.

    Args:
        folder: the dataset folder.
        wanted: frequency, Hz, whose pictures are wanted. None: the folder should have only one.

    Returns:
        The problems, the warnings, and the dataset where there are no problems.
    """
    problems: list[str] = []
    warnings: list[str] = []
    if not folder.is_dir():
        return Inspection([f"{folder}: expected a dataset folder, found {what_is_at(folder)}"], [], None)
    if other := not_spectra(folder) or unfinished(folder):
        return Inspection([other], [], None)

    positions = None
    try:
        positions = read_points(folder / "tx_pos.csv")
    except InputError as error:
        problems.append(str(error))
    names, pictures = read_pictures(folder / "spectrum", problems)
    gateway_position, gateway_orientation = read_gateway(folder / "gateway_info.yml", problems)
    metadata = read_metadata(folder / "metadata.json", problems)
    rows_of_positions = None if positions is None else len(positions)
    moving: Moving = metadata.get("moving", "transmitter")
    receivers = read_receivers(folder / "rx_pos.csv", moving, rows_of_positions, problems)
    array, grid = stated_array(metadata), stated_grid(metadata)
    train, test = read_split(folder, names, metadata, problems, warnings)

    numbers = np.array([int(name) for name in names], dtype=int)
    rows_known = rows_of_positions
    if positions is not None and len(names):
        without_row = [name for name, number in zip(names, numbers, strict=True) if number > len(positions)]
        if without_row:
            rows_known = None  # or a wrong length of channels.npz would be reported, too, for the same reason
            problems.append(
                f"{folder / 'tx_pos.csv'}: expected a row for each of the {len(names)} pictures, found "
                f"{len(positions)} rows; spectrum/{without_row[0]}.png has none"
            )
        if len(positions) > len(names):
            warnings.append(f"tx_pos.csv has {len(positions)} rows for {len(names)} pictures")

    rows = numbers - 1
    frequency = Frequency()
    if len(rows):
        frequency, chosen = frequency_of(folder, metadata, rows, problems, wanted)
        if len(chosen) < len(rows) and not problems:
            place = {old: new for new, old in enumerate(chosen.tolist())}
            train, test = ([place[each] for each in part if each in place] for part in (train, test))
            rows, names, pictures = rows[chosen], [names[each] for each in chosen], pictures[chosen]
        if isinstance(array, PlanarArray) and "frequencies_hz" in metadata:  # the array is that of metres
            ratio = frequency.hertz / read_frequency(metadata["frequency_hz"])
            array = replace(array, spacing=array.spacing * ratio)
    array = None if array is None else array.at(frequency.hertz)
    elements = (array or PlanarArray()).elements
    band = band_of(metadata)
    if band is not None:
        try:
            band.frequencies(frequency.hertz)
        except ParameterError as error:
            problems.append(f"{folder / 'metadata.json'}: band.{error}")
    found = read_responses(folder / "channels.npz", rows_known, elements, problems, band)
    responses, retrieved = found.channels, found.retrieved
    warnings.extend(found.oddities)
    if problems or positions is None:
        return Inspection(problems, warnings, None)
    warnings.extend(changed_places(metadata, positions, receivers))
    of_pictures = over_band = None
    if responses is not None:
        of_pictures = responses[rows]
        check_responses(folder / "channels.npz", of_pictures, retrieved, problems)
        if found.over_band is not None and not problems:
            over_band = found.over_band[rows].astype(np.complex64)
            check_responses(folder / "channels.npz", over_band, retrieved, problems)
        if problems:
            return Inspection(problems, warnings, None)
        of_pictures = of_pictures.astype(np.complex64)
    dataset = Dataset(
        folder=folder,
        names=names,
        pictures=pictures,
        positions=positions[rows],
        gateway_position=gateway_position,
        gateway_orientation=gateway_orientation,
        train=np.array(train, dtype=int),
        test=np.array(test, dtype=int),
        responses=None if retrieved else of_pictures,
        retrieved=of_pictures if retrieved else None,
        band=None if over_band is None else band,
        band_responses=over_band,
        metadata=metadata,
        identification=identify(pictures, array, grid),
        frequency=frequency,
        moving_receivers=None if receivers is None else receivers[rows],
    )
    places = dataset.positions if receivers is None else np.hstack([dataset.positions, receivers[rows]])
    odd = oddities(places, pictures, dataset.identification, folder)
    return Inspection(odd.problems, [*warnings, *odd.warnings], None if odd.problems else dataset)
