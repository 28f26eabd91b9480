"""A NeRF² dataset folder in memory. The documentation describes every file.

Rows of ``tx_pos.csv`` and pictures are numbered from 1. Everything in memory is numbered from 0.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Complex, Float, Int, UInt8

from scenes.files.errors import InputError
from simulate.dataset.dataset_frequency import Frequency
from simulate.dataset.dataset_kinds import Moving
from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.array import Array, PlanarArray
from simulate.spectra.band import Band
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.identification import Identification
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
    def phases_recorded_per_position(self) -> bool:
        """Whether metadata.json states that responses were recorded with an unknown phase of its own at each position.

        They are then ``retrieved``. So are responses found from pictures, for which this is False.
        """
        return self.metadata.get("phases") == "per-position"

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


def require_fixed_array(dataset: Dataset, what: str) -> None:
    """Refuse a dataset whose receiver moves, for what traces the scene with a fixed array."""
    require_fixed_end(dataset)
    if dataset.moving == "receiver":
        raise InputError(
            f"{dataset.folder}: expected a dataset whose transmitter moves, for {what}, found one whose receiver moves"
        )


def require_fixed_end(dataset: Dataset) -> None:
    """Refuse a dataset of which both ends move, for what takes spectra as a function of one position."""
    if dataset.moving == "both":
        raise InputError(
            f"{dataset.folder}: expected spectra of a link with one end that stands still, found some whose "
            "transmitter and receiver both move; simulate --moving receiver makes spectra of one transmitter"
        )
