"""The parts of a dataset: how one is made, with the same bytes on every machine, and which are whole in a folder."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any, cast

import numpy as np
from jaxtyping import Complex
from PIL import Image

from scenes.files.atomic import sync_folder, write_atomically
from scenes.files.errors import InputError
from simulate.dataset.dataset_kinds import PARTS
from simulate.dataset.picture_files import encode_picture, encode_power
from simulate.dataset.responses_file import Recorded, read_responses
from simulate.engines.engine import BandSource, ResponseSource
from simulate.generation.request import Request
from simulate.spectra.angular_grid import COLUMNS, ROWS
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.element_array import array_of
from simulate.spectra.spectrum import picture


@dataclass(frozen=True)
class Part:
    """Responses of consecutive positions, and the contents of their files."""

    # complex element responses, with the receiver's errors; over a band if the request has one
    responses: Complex[np.ndarray, "n elements *band"]
    pictures: list[bytes]  # content of the PNG file of each position
    power: list[bytes]  # content of the TIFF file of each position, in dB; empty if the request asks for none


def make_part(request: Request, sources: Sequence[ResponseSource], start: int, size: int) -> Part:
    """Compute the responses of consecutive spectra of a request, and make their pictures."""
    numbers = np.arange(start, min(start + size, len(request)))
    of_frequency, of_position = np.divmod(numbers, len(request.positions))
    responses, pictures, power = [], list[bytes](), list[bytes]()
    for which in np.unique(of_frequency).tolist():
        chosen = of_frequency == which
        source, places = sources[which], request.places[of_position[chosen]]
        if request.band is None:
            ideal = source.responses(places)
        else:
            ideal = cast(BandSource, source).band_responses(places, request.band)
        measured = request.measurement.apply(ideal, numbers[chosen], request.measurement_seed)
        of_carrier = measured if request.band is None else measured[..., request.band.carrier]
        scene = request.scenes[which]
        beamformer = Beamformer(array_of(scene.gateway, scene.frequency), request.grid)
        with ThreadPoolExecutor() as pool:
            pictures += pool.map(lambda each: encode_picture(picture(each)), beamformer.spectrum(of_carrier))
            power += pool.map(encode_power, beamformer.power_db(of_carrier)) if request.power else []
        responses.append(measured)
    return Part(np.concatenate(responses), pictures, power)


_sources: dict[str, list[ResponseSource]] = {}
"""What this worker computes responses with, by the request's metadata."""


def part_by_worker(shared: tuple[Request, list[Any], int, str], threads: int, start: int) -> Part:
    """Make one part in a Ray worker, which makes its sources when its first part arrives, and keeps them."""
    request, sent, size, name = shared
    if name not in _sources:
        _sources.clear()
        received = request.engine.received
        sources = [received(setting, each, threads) for setting, each in zip(request.settings, sent, strict=True)]
        _sources[name] = request.of_array(sources)
    return make_part(request, _sources[name], start, size)


def picture_names(count: int) -> list[str]:
    """Names from 1 on, padded with zeros to five digits, or more if needed."""
    digits = max(5, len(str(count)))
    return [f"{number:0{digits}d}" for number in range(1, count + 1)]


class WrittenParts:
    """The parts of a dataset folder."""

    def __init__(self, request: Request, folder: Path, size: int):
        self.folder, self.names = folder, picture_names(len(request))
        self.starts = range(0, len(self.names), size)
        self.damage: list[str] = []
        self._size, self._power = size, request.power
        self._elements, self._band = request.beamformer.array.elements, request.band

    def write(self, start: int, part: Part) -> None:
        """Write the files of a part."""
        names = self._names(start)
        paths = [*map(self._picture, names), *(map(self._level, names) if part.power else ())]
        with ThreadPoolExecutor(32) as pool:  # the disk writes many at a time
            list(pool.map(write_atomically, paths, [*part.pictures, *part.power]))
        sync_folder(self.folder / "spectrum")
        # The last file, since it marks the part as finished.
        buffer = BytesIO()
        np.save(buffer, part.responses)
        write_atomically(self._marker(start), buffer.getvalue())

    def whole(self) -> dict[int, Complex[np.ndarray, "n elements *band"]]:
        """The responses of the finished parts without damaged files, by the index of their first position."""
        found_there, self.damage = Recorded(), []
        try:
            found_there = read_responses(self.folder / "channels.npz", len(self.names), self._elements, self._band)
        except InputError as error:
            self.damage = [f"{error}; it is made again"]
        with ThreadPoolExecutor() as pool:
            recorded = None if found_there.retrieved else found_there.responses
            found = {start: self._whole(start, recorded, pool) for start in self.starts}
        return {start: responses for start, responses in found.items() if responses is not None}

    def _whole(
        self, start: int, recorded: Complex[np.ndarray, "K elements *band"] | None, pool: ThreadPoolExecutor
    ) -> Complex[np.ndarray, "n elements *band"] | None:
        """The responses of a part, from its file or channels.npz; None if it is unfinished or damaged."""
        names = self._names(start)
        if self._marker(start).exists():
            try:
                responses = self._marked(start)
            except InputError as error:
                self._tell(start, str(error))
                return None
        elif recorded is not None:
            responses = recorded[start : start + self._size]
        else:
            return None
        faults = [fault for fault in pool.map(self._fault, names) if fault is not None]
        if faults:
            self._tell(start, faults[0])
            return None
        return responses

    def _marked(self, start: int) -> Complex[np.ndarray, "n elements *band"]:
        path, count = self._marker(start), len(self._names(start))
        try:
            responses = np.load(path)
        except (OSError, ValueError, EOFError) as error:
            raise InputError(f"{path}: expected the responses of a part, found a damaged file ({error})") from error
        shape = (count, self._elements, *(() if self._band is None else (self._band.subcarriers,)))
        if not (isinstance(responses, np.ndarray) and responses.shape == shape):
            raise InputError(
                f"{path}: expected responses of {count} positions × {self._elements} elements, found others"
            )
        return responses

    def _fault(self, name: str) -> str | None:
        """A sentence on what is wrong with the files of a picture's name; None if nothing is."""
        kinds = {self._picture(name): "PNG", **({self._level(name): "TIFF"} if self._power else {})}
        for path, kind in kinds.items():
            try:
                with Image.open(path) as image:
                    if (image.format, image.size) != (kind, (COLUMNS, ROWS)):
                        raise ValueError(f"{image.format} of {image.width} × {image.height} pixels")
                    image.verify() if kind == "PNG" else image.load()  # verify tests checksums, which only PNG has
            except (OSError, SyntaxError, ValueError) as error:
                return f"{path}: expected a whole {kind} file, found a damaged one ({error})"
        return None

    def _tell(self, start: int, fault: str) -> None:
        names = self._names(start)
        self.damage.append(f"{fault}; the spectra {names[0]} to {names[-1]} are made again")

    def _names(self, start: int) -> list[str]:
        return self.names[start : start + self._size]

    def _picture(self, name: str) -> Path:
        return self.folder / "spectrum" / f"{name}.png"

    def _level(self, name: str) -> Path:
        return self.folder / "power_db" / f"{name}.tif"

    def _marker(self, start: int) -> Path:
        return self.folder / PARTS / f"{start:010d}.npy"
