"""The files of a comparison in rooms: what all its rows have in common, and what each row has."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta, Struct

from learn.comparison.kept_rows import KeptRow
from simulate.dataset.dataset_kinds import Setting


class RoomProtocol(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The content of protocol.json: the settings that all rows have in common."""

    rooms: str  # absolute path of the folder of rooms
    setting: Setting  # what differs from room to room
    test_rooms: Annotated[int, Meta(ge=1)]  # number of test rooms
    test_spectra: Annotated[int, Meta(ge=1)] | None  # largest number of test spectra in a room. None: all of them.
    seed: Annotated[int, Meta(ge=0)]  # seed of the choice of test spectra
    minutes: Annotated[float, Meta(gt=0)]  # training time of each method that learns in other rooms
    device: str  # name of the GPU, or number of CPU threads, on which methods are trained
    data_sha256: str  # fingerprint of the names, positions and pictures of all rooms


class RoomRow(KeptRow, frozen=True, kw_only=True):
    """The entries that every row has. The others are described in ``RoomComparison``."""

    train_size: Annotated[int, Meta(ge=1)]
    spectra: Annotated[int, Meta(ge=1)]
    ssim_mean: float
    ssim_median: float
    seconds: float
