"""The files of a dataset's parts: which of them are whole, and how a new part is written."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from io import BytesIO
from itertools import zip_longest
from pathlib import Path

import numpy as np
from jaxtyping import Complex
from PIL import Image

from scenes.files.atomic import sync_folder, write_atomically
from scenes.files.errors import InputError
from simulate.dataset.dataset_kinds import PARTS
from simulate.dataset.responses_file import read_responses
from simulate.generation.dataset_part import Part
from simulate.generation.request import Request
from simulate.spectra.angular_grid import COLUMNS, ROWS


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
        for name, picture, power in zip_longest(self._names(start), part.pictures, part.power):
            write_atomically(self._picture(name), picture)
            if power is not None:
                write_atomically(self._level(name), power)
        sync_folder(self.folder / "spectrum")
        # The last file, since it marks the part as finished.
        buffer = BytesIO()
        np.save(buffer, part.responses)
        write_atomically(self._marker(start), buffer.getvalue())

    def whole(self) -> dict[int, Complex[np.ndarray, "n elements *band"]]:
        """The responses of the finished parts without damaged files, by the index of their first position."""
        problems: list[str] = []
        path, count = self.folder / "channels.npz", len(self.names)
        found_there = read_responses(path, count, self._elements, problems, self._band)
        recorded = found_there.channels if self._band is None else found_there.over_band
        self.damage = [f"{problem}; it is made again" for problem in problems]
        with ThreadPoolExecutor() as pool:
            recorded = None if found_there.retrieved else recorded
            found = {start: self._whole(start, recorded, pool) for start in self.starts}
        return {start: responses for start, responses in found.items() if responses is not None}

    def _whole(
        self, start: int, recorded: Complex[np.ndarray, "K elements *band"] | None, pool: ThreadPoolExecutor
    ) -> Complex[np.ndarray, "n elements *band"] | None:
        """The responses of a part; None if it is not finished, or if one of its files is damaged.

        A finished dataset has its responses in channels.npz. An unfinished one has a file for each part.
        """
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
