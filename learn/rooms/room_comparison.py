"""The table of scores that ``compare_rooms`` returns, and the files that its rows are kept in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, ClassVar

from msgspec import Meta, Struct

from learn.comparison.averaged_table import AveragedTable
from learn.comparison.results_folder import ResultRow
from learn.comparison.score_table import by_name
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


class RoomRow(ResultRow, frozen=True, kw_only=True):
    """The entries that every row has. The others are described in ``RoomComparison``."""

    train_size: Annotated[int, Meta(ge=1)]
    spectra: Annotated[int, Meta(ge=1)]
    ssim_mean: float
    ssim_median: float
    seconds: float


@dataclass(frozen=True, kw_only=True)
class RoomComparison(AveragedTable):
    """Rows measured by ``compare_rooms``.

    ``pandas.DataFrame(comparison)`` makes a table of the rows. ``print(comparison)`` shows the averages over the seeds,
    for each number of known spectra the best first. ``len(comparison)`` and iteration are those of ``rows``.

    A row has "label", the name of the method, "seed", "train_size", the number L of known spectra in each test room,
    "spectra", the number of test spectra of all test rooms together, "ssim_mean" and "ssim_median" over them, "rooms",
    the median SSIM in each test room, "steps" of training in other rooms (None: it has none), and "seconds", the mean
    time of the fit and the predictions in a test room. A row of your own class also has "source", a hash of its source.

    Attributes:
        folder: the folder of the rooms.
        setting: what differs from room to room: "same", "furniture" or "layout".
        training: names of the training rooms.
        test: names of the test rooms.
        minutes: training time of each method that learns in other rooms.
        rows: a dictionary for each method, seed and number of known spectra, in the order of measurement.

    Example:
        >>> rows = [{"label": "mean", "seed": 0, "train_size": 5, "ssim_mean": 0.5, "ssim_median": 0.4, "seconds": 0.1}]
        >>> names = {"training": ("room-000",), "test": ("room-001",)}
        >>> comparison = RoomComparison(folder=Path("rooms"), setting="layout", minutes=1.0, rows=rows, **names)
        >>> print(comparison)
                 mean SSIM  median SSIM  seconds
        mean, 5  0.5        0.4          0.1
    """

    COLUMNS: ClassVar[Mapping[str, str]] = {
        "ssim_mean": "mean SSIM",
        "ssim_median": "median SSIM",
        "steps": "steps",
        "seconds": "seconds",
    }
    RANKED_BY: ClassVar[str] = "ssim_mean"

    folder: Path
    setting: Setting
    training: tuple[str, ...]
    test: tuple[str, ...]
    minutes: float
    rows: list[dict[str, Any]] = field(repr=False)

    def table(self) -> list[dict[str, Any]]:
        """The averages, the smallest number of known spectra first, and for each the best method first."""
        return sorted(self.averages(), key=lambda row: (row["train_size"], -row["ssim_mean"]))

    def facts(self) -> dict[str, Any]:
        """All scores and what they are of, for JSON."""
        facts: dict[str, Any] = {
            "folder": str(self.folder),
            "setting": self.setting,
            "training_rooms": list(self.training),
            "test_rooms": list(self.test),
            "minutes": self.minutes,
            "methods": by_name(self.table()),
        }
        return {**facts, "fits": self.rows}
