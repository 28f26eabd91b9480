"""A dataset in memory, whatever was measured. The documentation describes the files of its folder.

Everything in memory is numbered from 0. Pictures and rows of ``tx_pos.csv`` are numbered from 1 in the files.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from jaxtyping import Complex, Float, Int, Shaped, UInt8

from scenes.files.errors import InputError
from simulate.dataset.dataset_frequency import Frequency
from simulate.dataset.dataset_kinds import NOT_RECEIVED, QUANTITIES, Moving
from simulate.dataset.receivers import Antennas, ArrayReceiver
from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.array import Array, PlanarArray
from simulate.spectra.band import Band
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.identification import Identification
from simulate.spectra.spectrum import spectrum_of

if TYPE_CHECKING:
    from simulate.dataset.torch_dataset import TorchDataset

Receiver = TypeVar("Receiver", ArrayReceiver, Antennas)

RESPONSES = "response", "retrieved"  # Quantities of elements, which folders of spectra can have, too


@dataclass(frozen=True)
class Dataset:
    """A dataset in memory: K rows of spectra, of received powers (RSSI) or of channels (CSI), and where both ends were.

    ``read_dataset`` reads one; ``simulate``, ``simulate_rssi`` and ``write_dataset`` return one. The folders are those
    of NeRF² [zhao2023], which GSRF reads, too.

    ``values`` has an array for each quantity, with a row for each of the K rows:

    - ``spectrum``: grey levels 0…255 of the magnitude, min–max normalised for each spectrum, uint8 [K, 90, 360]; rows
      and columns are the directions of ``grid``;
    - ``response``: recorded complex element responses, not normalised, [K, elements], or with a band
      [K, elements, subcarriers]. Simulated folders have them;
    - ``retrieved``: element responses of the same shape of which each row has a phase of its own, so that phases of
      two positions cannot be compared: so recorded, or found from the pictures by ``bisplat dataset --retrieve``, which
      also leaves the flip ``y_m -> conj(y_{MN−1−m})`` open;
    - ``power``: received powers, dBm, [K, G]; NaN where nothing was received;
    - ``channel``: channels, complex [K, A, 2 S]: the S subcarriers of the uplink, then those of the downlink.

    A property below that needs a quantity which the dataset lacks raises an ``InputError`` that says so.

    Attributes:
        folder: the folder that the dataset was read from.
        names: name of each row: of a picture padded with zeros, such as "00001", and otherwise its number from 0.
        values: the measured values by the name of the quantity. The first is what the dataset is mainly of.
        receiver: the gateway with its array, ``ArrayReceiver``; or the gateways that measured powers, or the antennas
            that measured channels, ``Antennas``.
        places: as ``positions``; None if a folder of channels has no tx_pos.csv. The published ones have none.
        train: indices of the folder's own training rows; empty if the folder has no index files.
        test: indices of the folder's own test rows; empty if the folder has no index files.
        band: the subcarriers around the carrier; None if there are none or, of channels, if they are not stated.
        metadata: content of metadata.json; empty if the folder has none.
        frequency: the frequency (``hertz``), and how it is known (``source``: "metadata", "freq.txt" or "assumed").

    Example:
        >>> import bisplat
        >>> dataset = bisplat.read_dataset("data/lab")
        >>> dataset.positions.shape, dataset.pictures.shape, dataset.responses.shape
        ((40, 3), (40, 90, 360), (40, 16))
        >>> len(dataset.train), len(dataset.test), round(dataset.wavelength, 3)
        (32, 8, 0.328)
        >>> dataset
        Dataset('data/lab': 40 spectra, 4 × 4 elements, 915 MHz)
        >>> len(dataset), dataset.quantities, dataset.with_values(response=None).quantities
        (40, ['spectrum', 'response'], ['spectrum'])
        >>> bool((dataset.transmitters == dataset.positions).all()), dataset.receivers[0].tolist()
        (True, [7.2, 3.0, 1.4])
        >>> dataset.powers
        Traceback (most recent call last):
        scenes.files.errors.InputError: data/lab: expected received powers (RSSI), found spectra
    """

    folder: Path
    names: list[str]
    values: Mapping[str, Shaped[np.ndarray, "K ..."]]
    receiver: ArrayReceiver | Antennas
    places: Float[np.ndarray, "K 3"] | None
    train: Int[np.ndarray, " K_train"]
    test: Int[np.ndarray, " K_test"]
    band: Band | None = None
    metadata: dict[str, Any] = field(default_factory=dict)
    frequency: Frequency = field(default_factory=Frequency)

    def __len__(self) -> int:
        return len(self.names)

    def __repr__(self) -> str:
        assumed = self.frequency.source == "assumed" and isinstance(self.receiver, Antennas)
        words = [*self._words(), "frequency not stated" if assumed else f"{self.frequency.hertz / 1e6:g} MHz"]
        if self.band is not None and isinstance(self.receiver, ArrayReceiver):
            words.append(f"{self.band.subcarriers} subcarriers over {self.band.bandwidth / 1e6:g} MHz")
        return f"Dataset({str(self.folder)!r}: {', '.join(words)})"

    def _words(self) -> list[str]:
        """The numbers of rows and receivers."""
        if "channel" in self.values:
            antennas, each = self.uplink.shape[1:]
            return [f"channels of {len(self)} rows", f"{antennas} antennas", f"{each} + {each} subcarriers"]
        if "power" in self.values:
            gateways = self.powers.shape[1]
            count = f"{gateways} gateway{'s' if gateways > 1 else ''}"
            return [f"received powers of {len(self)} positions", count]
        array = self.array
        elements = f"{array.rows} × {array.columns} elements" if isinstance(array, PlanarArray) else array.in_words
        return [f"{len(self)} spectra", elements]

    @property
    def quantities(self) -> list[str]:
        """Names of the quantities in ``values``; the first is what the dataset is mainly of."""
        return list(self.values)

    def require(self, quantity: str) -> Shaped[np.ndarray, "K ..."]:
        """The values of a quantity. Raise an InputError if the dataset has none."""
        if quantity not in self.values:
            raise self._without(quantity)
        return self.values[quantity]

    def _without(self, quantity: str) -> InputError:
        """The error that the dataset lacks a quantity."""
        alike = [name for name in RESPONSES if name in self.values and quantity in RESPONSES]
        found = QUANTITIES[[*alike, *self.values][0]]
        return InputError(f"{self.folder}: expected {QUANTITIES[quantity].words}, found {found.words}{found.taken}")

    def with_values(self, **values: Shaped[np.ndarray, "K ..."] | None) -> Dataset:
        """The dataset with other values of some quantities, such as ``response=None`` to leave the responses out."""
        changed = {name: each for name, each in {**self.values, **values}.items() if each is not None}
        over_band = "channel" in changed or any(changed[name].ndim == 3 for name in RESPONSES if name in changed)
        return replace(self, values=changed, band=self.band if over_band else None)

    def torch(self, rows: Int[np.ndarray, " n"] | Sequence[int] | None = None) -> TorchDataset:
        """Spectra as a dataset of PyTorch, for ``torch.utils.data.DataLoader``.

        Each item is a dictionary with these entries:

        - "position", the position of the end that moves, metres, world frame, [3], float32;
        - "receiver", the middle of the array; only if both ends move, and "position" is then the transmitter's;
        - "spectrum", the spectrum, 0…1, [90, 360], float32;
        - "responses", the recorded element responses, [elements], complex64; only if the dataset has any.

        Args:
            rows: which spectra, in this order, such as one part of ``bisplat.split``. None: all.

        Raises:
            ParameterError: ``rows`` are not whole numbers, or the dataset has no spectrum with one of them.

        Example:
            >>> import bisplat, torch
            >>> dataset = bisplat.read_dataset("data/lab")
            >>> train = dataset.torch(bisplat.split(dataset, "random", seed=0).train)
            >>> batch = next(iter(torch.utils.data.DataLoader(train, batch_size=4, shuffle=True)))
            >>> batch["position"].shape, batch["spectrum"].shape, batch["responses"].shape
            (torch.Size([4, 3]), torch.Size([4, 90, 360]), torch.Size([4, 16]))
        """
        from simulate.dataset.torch_dataset import TorchDataset  # imports torch

        return TorchDataset(self, rows)

    @property
    def positions(self) -> Float[np.ndarray, "K 3"]:
        """Where the end that moves is, metres, world frame, [K, 3]; the transmitter, if both move.

        ``transmitters`` and ``receivers`` are both ends of each row, whichever moves.
        """
        if self.places is None:
            raise InputError(f"{self.folder}: expected positions of the rows (tx_pos.csv), found none")
        return self.places

    @property
    def pictures(self) -> UInt8[np.ndarray, "K 90 360"]:
        """Grey levels of the spectra, 0…255, [K, 90, 360]."""
        return self.require("spectrum")

    @property
    def spectra(self) -> Float[np.ndarray, "K 90 360"]:
        """The pictures as numbers from 0 to 1 (grey levels / 255), float32, [K, 90, 360].

        Every published loader of this format reads the pictures in this way. Each access computes the array anew.
        """
        return spectrum_of(self.pictures)

    @property
    def responses(self) -> Complex[np.ndarray, "K elements"]:
        """Recorded element responses at the carrier, [K, elements]."""
        return _at_carrier(self.require("response"))

    @property
    def retrieved(self) -> Complex[np.ndarray, "K elements"]:
        """Element responses at the carrier of which each row has a phase of its own, [K, elements]."""
        return _at_carrier(self.require("retrieved"))

    @property
    def band_responses(self) -> Complex[np.ndarray, "K elements subcarriers"]:
        """Responses at all subcarriers, [K, elements, subcarriers], of a dataset of spectra that has a ``band``."""
        for name in RESPONSES:
            if name in self.values and self.values[name].ndim == 3:
                return self.values[name]
        found = "responses at the carrier alone" if {*RESPONSES} & self.values.keys() else "spectra alone"
        raise InputError(f"{self.folder}: expected responses over a band, found {found}")

    @property
    def powers(self) -> Float[np.ndarray, "K G"]:
        """Received powers, dBm, [K, G]; NaN where nothing was received."""
        return self.require("power")

    @property
    def floor_dbm(self) -> float:
        """Power below which a gateway receives nothing, dBm; −100, the mark of the format, if it is not stated."""
        return float(self.metadata.get("receiver", {}).get("floor_dbm", NOT_RECEIVED))

    @property
    def uplink(self) -> Complex[np.ndarray, "K A S"]:
        """Channels of the uplink, [K, A, S]."""
        channels = self.require("channel")
        return channels[..., : channels.shape[2] // 2]

    @property
    def downlink(self) -> Complex[np.ndarray, "K A S"]:
        """Channels of the downlink, [K, A, S]."""
        channels = self.require("channel")
        return channels[..., channels.shape[2] // 2 :]

    @property
    def frequencies(self) -> Float[np.ndarray, " subcarriers"] | None:
        """Frequencies of the subcarriers, Hz; of channels the uplink's, then the downlink's. None: not stated."""
        known = self.band is not None and self.frequency.source != "assumed"
        return self.band.frequencies(self.frequency.hertz) if self.band is not None and known else None

    @property
    def gateway_names(self) -> list[str]:
        """Names of the gateways that measured powers, or of the antennas that measured channels."""
        return self._antennas.names

    @property
    def gateway_positions(self) -> Float[np.ndarray, "G 3"]:
        """Where the gateways that measured powers are, or the antennas that measured channels, metres, [G, 3]."""
        return self._antennas.positions

    @property
    def distances(self) -> Float[np.ndarray, "K G"]:
        """Distance of each position from each gateway that measured powers, metres, [K, G]."""
        return np.linalg.norm(self.positions[:, None] - self.gateway_positions, axis=-1)

    @property
    def gateway_position(self) -> Float[np.ndarray, 3]:
        """Where the gateway, the end that stands still, is, metres, world frame, [3]."""
        return self._array.position

    @property
    def gateway_orientation(self) -> Float[np.ndarray, 4]:
        """Unit quaternion (x, y, z, w) that turns the gateway frame into the world frame, [4]."""
        return self._array.orientation

    @property
    def identification(self) -> Identification:
        """The array and the grid of the spectra, how they are known, and the error that they leave.

        Its ``source`` and ``grid_source`` are "metadata", "fitted" or "assumed", ``residual`` is in grey levels of 255.
        """
        return self._array.identification

    @property
    def beamformer(self) -> Beamformer:
        """The array and the grid that the spectra were made with."""
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
        """Whether metadata.json states that ``retrieved`` responses were so recorded, and not found from pictures."""
        return self.metadata.get("phases") == "per-position"

    @property
    def transmitters(self) -> Float[np.ndarray, "K 3"]:
        """Where the transmitter of each row is, whichever end moves, metres, world frame, [K, 3]."""
        return self._standing if self.moving == "receiver" else self.positions

    @property
    def receivers(self) -> Float[np.ndarray, "K 3"]:
        """Where the middle of the array is for each spectrum, whichever end moves, metres, world frame, [K, 3]."""
        if self._array.moving is not None:
            return self._array.moving
        return self.positions if self.moving == "receiver" else self._standing

    @cached_property
    def fingerprint(self) -> str:
        """SHA-256 of names, positions and measured values, which tells whether two folders hold the same data.

        Responses do not count where there are spectra, which are made of them.
        """
        digest = hashlib.sha256("\n".join(self.names).encode())
        at = self.receiver.moving if isinstance(self.receiver, ArrayReceiver) else self.receiver.positions
        for points in (self.places, at):
            if points is not None:
                digest.update(np.ascontiguousarray(points, dtype="<f8").data)
        digest.update(np.ascontiguousarray(self.values[self.quantities[0]]).data)
        return digest.hexdigest()

    @property
    def _standing(self) -> Float[np.ndarray, "K 3"]:
        return np.tile(self.gateway_position, (len(self), 1))

    def _receiver_of(self, quantity: str, kind: type[Receiver]) -> Receiver:
        """The receiver, which a quantity needs to be of a kind."""
        if isinstance(self.receiver, kind):
            return self.receiver
        raise self._without(quantity)

    @property
    def _array(self) -> ArrayReceiver:
        return self._receiver_of("spectrum", ArrayReceiver)

    @property
    def _antennas(self) -> Antennas:
        return self._receiver_of("power", Antennas)


def _at_carrier(responses: Complex[np.ndarray, "K elements *band"]) -> Complex[np.ndarray, "K elements"]:
    return responses if responses.ndim == 2 else responses[..., responses.shape[2] // 2]
