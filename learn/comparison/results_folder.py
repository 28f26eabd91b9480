"""The folder of a comparison: what all rows have in common in protocol.json, and the rows so far in results.jsonl."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from msgspec import Meta, Struct, to_builtins

from learn.data.splits import GUARD_MOST
from scenes.files.atomic import require_writable, write_atomically
from scenes.files.errors import InputError, shown
from scenes.files.input_file import MEGABYTE, read_text
from scenes.files.json_yaml_xml import parse_json, plain_values, read_json
from scenes.files.npz_file import Expected, read_npz, write_arrays
from scenes.files.output_folder import own_folder
from scenes.files.plain_text import say
from scenes.files.schema import conform

PROTOCOL = "protocol.json"  # Name of the file with the settings of a comparison


class Settings(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What all rows of a comparison have in common. The file protocol.json records it.

    Attributes:
        dataset: absolute path of the folder of the dataset or of the rooms.
        quantity: what is predicted.
        split: how the test part was chosen, or "rooms".
        seed: seed of the split, the same for every method and for every seed of a method.
        guard: known positions nearer than this to a test position are left out, wavelengths.
        minutes: training time of each method that is trained by steps; None: there is no limit, and ``steps`` is set.
        steps: number of training steps of each such method; None: as many as fit into ``minutes``.
        device: name of the GPU, or number of CPU threads, on which methods are trained.
        tested: largest number of test rows, evenly spread over the test part, of each room; None: all of them.
        test_rooms: number of test rooms; None: there are none.
        data_sha256: fingerprint of the data.
        index_sha256: digest of the index files of the split "files"; empty for other splits.
    """

    dataset: str
    quantity: str
    split: str
    seed: Annotated[int, Meta(ge=0)]
    guard: Annotated[float, Meta(ge=0, le=GUARD_MOST)]
    minutes: Annotated[float, Meta(gt=0)] | None
    steps: Annotated[int, Meta(ge=1)] | None
    device: str
    tested: Annotated[int, Meta(ge=1)] | None = None
    test_rooms: Annotated[int, Meta(ge=1)] | None = None
    data_sha256: str = ""
    index_sha256: str = ""


def in_common(settings: Settings) -> dict[str, Any]:
    """The settings that all calls of a comparison must share: where steps are fixed, not the device."""
    left_out = ("data_sha256", "index_sha256", *(["device"] if settings.steps is not None else []))
    return {key: value for key, value in to_builtins(settings).items() if key not in left_out}


def read_settings(path: Path) -> Settings:
    """The settings in a protocol.json."""
    return conform(read_json(path, "the settings of a comparison"), Settings, str(path))


RESULTS = "results.jsonl"  # Name of the file

LARGEST_RESULTS = 64 * MEGABYTE  # Largest size of the file, bytes; a row takes about 400


LARGEST_ARRAYS = 4000 * MEGABYTE  # Largest size of the arrays of a row, bytes


class ResultRow(Struct, frozen=True, kw_only=True):
    """The entries that every row has. The others are scores and costs."""

    label: str
    seed: Annotated[int, Meta(ge=0)]
    train_size: Annotated[int, Meta(ge=1)] | None
    test: Annotated[int, Meta(ge=1)]


class Results:
    """The rows in results.jsonl, a JSON object per line, and the scores of each test row in per_sample/."""

    def __init__(self, folder: Path, score: str | None = None):
        self.folder, self.path, self._score = folder, folder / RESULTS, score  # the key that every row has besides

    @property
    def rows(self) -> list[dict[str, Any]]:
        """The rows measured so far, in the order in which they were measured."""
        if not os.path.lexists(self.path):
            return []
        rows = []
        lines = read_text(self.path, "a JSON object per line", LARGEST_RESULTS).splitlines()
        for number, line in enumerate(lines, start=1):
            place = f"{self.path}, line {number}"
            rows.append(parse_json(line, place, "the scores of a method", nan=True))
            conform(rows[-1], ResultRow, place)
            if not isinstance(rows[-1].get(self._score), int | float | None):
                found = shown(rows[-1][self._score])
                raise InputError(f"{place}: {self._score}: expected a number or nothing, found {found}")
        return rows

    def row(self, key: dict[str, Any]) -> dict[str, Any] | None:
        """The row with this key. None: it has not been measured."""
        return next((row for row in self.rows if key.items() <= row.items()), None)

    def require_file_names(self, labels: Iterable[str]) -> None:
        """Refuse labels whose files would have the name of another label's, of this call or of a row that is kept."""
        by_name: dict[str, str] = {}
        for label in [*(row["label"] for row in self.rows), *labels]:
            other = by_name.setdefault(_file_name(label), label)
            if other != label:
                raise InputError(
                    f"{self.path}: expected labels whose files have names of their own, found {shown(label)} beside "
                    f"{shown(other)}"
                )

    def is_measured(self, key: dict[str, Any], name: str, own: bool, source: str | None) -> bool:
        """Whether a row has been measured; not if its method was another one or has been edited since."""
        row = self.row(key)
        if row is None:
            return False
        if own and source is None:
            say(f"{name}: measured before and kept; no source tells whether its class has changed since")
        elif row.get("source") != source:
            say(f"{name}: it or its settings have changed, so it is measured again and its old row is replaced")
            return False
        return True

    def keep(self, key: dict[str, Any], row: dict[str, Any], each: dict[str, np.ndarray]) -> None:
        """Write a row with its key, and the scores of each test row, in place of old ones with this key."""
        write_arrays(self._arrays(key), each)
        rows, old, new = self.rows, self.row(key), {**key, **row}
        kept = [*rows, new] if old is None else [new if each == old else each for each in rows]
        write_atomically(self.path, ("\n".join(json.dumps(plain_values(each)) for each in kept) + "\n").encode())

    def arrays(self, row: Mapping[str, Any], expected: Mapping[str, Expected]) -> dict[str, np.ndarray]:
        """What was kept of each test row of one of the rows."""
        return read_npz(self._arrays(row), "arrays of a comparison", expected, LARGEST_ARRAYS)

    def _arrays(self, key: Mapping[str, Any]) -> Path:
        return self.folder / "per_sample" / f"{row_name(key)}.npz"


def row_name(row: Mapping[str, Any]) -> str:
    """Name of a row's file in per_sample/."""
    size = "" if row["train_size"] is None else f"-{row['train_size']}"
    return f"{_file_name(row['label'])}{size}-{row['seed']}"


def _file_name(label: str) -> str:
    return label.replace(" ", "_").replace("/", "_")


def run_folder(row: Mapping[str, Any]) -> Path:
    """Folder of a row's run below that of the comparison."""
    source = row.get("source")
    return Path("runs") / (row_name(row) if source is None else f"{row_name(row)}-{source[:8]}")


@contextmanager
def results_in(output: Path | None, settings: Settings, score: str) -> Iterator[Results]:
    """Begin a comparison in a new folder, or continue the one in a folder, and keep other processes from it."""
    if output is None:
        with tempfile.TemporaryDirectory(prefix="bisplat-") as temporary:
            yield Results(Path(temporary), score)
        return
    path = output / PROTOCOL
    require_writable(path)
    with own_folder(output, "comparison", PROTOCOL, in_common(settings), lambda file: in_common(read_settings(file))):
        if path.exists():
            before = read_settings(path)
            for key, what in (("data_sha256", "data"), ("index_sha256", "index files")):
                if getattr(before, key) != getattr(settings, key):
                    raise InputError(
                        f"{settings.dataset}: expected the {what} with which {output} was begun, found others; compare "
                        "in another folder"
                    )
        write_atomically(path, (json.dumps(to_builtins(settings), indent=2) + "\n").encode())
        yield Results(output, score)
