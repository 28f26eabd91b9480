"""The folder of a comparison in rooms: what all its rows have in common, and the rows that are measured so far."""

from __future__ import annotations

import hashlib
import json
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

from msgspec import Meta, Struct

from learn.comparison.kept_rows import KeptRows
from learn.comparison.protocol import PROTOCOL, without_fingerprint
from scenes.files.atomic import require_writable, write_atomically
from scenes.files.errors import InputError
from scenes.files.json_file import read_json
from scenes.files.output_folder import own_folder
from scenes.files.schema import conform
from simulate.dataset.dataset import Dataset
from simulate.dataset.room_settings import Setting


class RoomProtocol(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The content of protocol.json: the settings that all rows have in common.

    Attributes:
        rooms: absolute path of the folder of rooms.
        setting: what differs from room to room.
        test_rooms: number of test rooms.
        test_spectra: largest number of test spectra in a room. None: all of them.
        seed: seed of the choice of test spectra.
        minutes: training time of each method that learns in other rooms.
        device: name of the GPU, or number of CPU threads, on which methods are trained.
        rooms_sha256: fingerprint of the names, positions and pictures of all rooms.
    """

    rooms: str
    setting: Setting
    test_rooms: Annotated[int, Meta(ge=1)]
    test_spectra: Annotated[int, Meta(ge=1)] | None
    seed: Annotated[int, Meta(ge=0)]
    minutes: Annotated[float, Meta(gt=0)]
    device: str
    rooms_sha256: str


class RoomRow(Struct, frozen=True, kw_only=True):
    """The entries that every row has. The others are described in ``RoomComparison``."""

    label: str
    seed: Annotated[int, Meta(ge=0)]
    train_size: Annotated[int, Meta(ge=1)]
    spectra: Annotated[int, Meta(ge=1)]
    ssim_mean: float
    ssim_median: float
    seconds: float


@contextmanager
def kept_in(output: Path | None, rooms: Sequence[Dataset], settings: dict[str, Any]) -> Iterator[KeptRows]:
    """Begin a comparison in a new folder, or continue the one in a folder, and keep other processes from it.

    Args:
        output: the folder. None: a temporary one.
        rooms: the datasets of all rooms.
        settings: the entries of ``RoomProtocol``, without the fingerprint.

    Raises:
        InputError: the folder has a comparison with other settings or of other spectra, or other files, or another
            process writes to it.
    """
    if output is None:
        with tempfile.TemporaryDirectory(prefix="bisplat-") as temporary:
            yield KeptRows(Path(temporary), RoomRow)
        return
    require_writable(output / PROTOCOL)
    digest = hashlib.sha256("".join(room.fingerprint for room in rooms).encode()).hexdigest()
    with own_folder(
        output, "comparison in rooms", PROTOCOL, settings, lambda path: without_fingerprint(_read_protocol(path))
    ):
        if (output / PROTOCOL).exists() and _read_protocol(output / PROTOCOL)["rooms_sha256"] != digest:
            raise InputError(
                f"{output}: expected a comparison in the rooms of {settings['rooms']}, found other spectra"
            )
        given = {**settings, "rooms_sha256": digest}
        write_atomically(output / PROTOCOL, (json.dumps(given, indent=2) + "\n").encode())
        yield KeptRows(output, RoomRow)


def _read_protocol(path: Path) -> dict[str, Any]:
    content = read_json(path, "the settings of a comparison in rooms")
    conform(content, RoomProtocol, str(path))
    return content
