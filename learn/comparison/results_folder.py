"""The folder of a comparison: the settings of all rows in protocol.json, and the rows so far in results.jsonl."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from jaxtyping import Int
from msgspec import Meta, Struct

from learn.data.splits import GUARD_MOST, SplitKind
from scenes.files.atomic import require_writable, write_atomically
from scenes.files.errors import InputError, require_path, shown
from scenes.files.input_file import MEGABYTE, read_text
from scenes.files.json_yaml_xml import parse_json, plain_values, read_json
from scenes.files.output_folder import own_folder
from scenes.files.plain_text import say
from scenes.files.schema import conform
from simulate.spectra.spectrum import evenly

PROTOCOL = "protocol.json"  # Name of the file with the settings of an experiment

SPLIT_SEED = 0  # Seed of the split, the same for every method and for every seed of a method


@dataclass(frozen=True)
class Settings:
    """Settings that all rows of an experiment have in common. The file protocol.json records them."""

    dataset: str  # absolute path of the dataset's folder
    split: SplitKind  # how the test part is chosen
    split_seed: int  # seed of the split
    # training time of each model that is trained by steps. None: there is no limit, and ``steps`` is set.
    minutes: float | None
    steps: int | None  # number of training steps of each such model. None: as many as fit into ``minutes``.
    device: str  # name of the GPU, or number of CPU threads, on which methods are trained
    # largest number of test spectra, evenly spread over the test part. None: all of them.
    test_spectra: int | None = None
    dataset_sha256: str = ""  # fingerprint of the dataset
    # known positions nearer than this to a test position are left out, wavelengths. None: all are known.
    guard: float | None = None
    # digest of the index files of the split "files". None: another split.
    index_sha256: str | None = None

    def tested(self, test: Int[np.ndarray, " n"]) -> Int[np.ndarray, " K"]:
        """The spectra of the test part on which every method is scored."""
        return test if self.test_spectra is None else evenly(test, self.test_spectra)


class Protocol(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The content of protocol.json: the fields of ``Settings`` that are not None."""

    dataset: str
    split: SplitKind
    split_seed: Annotated[int, Meta(ge=0)]
    minutes: Annotated[float, Meta(gt=0)] | None = None
    steps: Annotated[int, Meta(ge=1)] | None = None
    device: str
    test_spectra: Annotated[int, Meta(ge=1)] | None = None
    dataset_sha256: str
    guard: Annotated[float, Meta(gt=0, le=GUARD_MOST)] | None = None
    index_sha256: str | None = None


def read_protocol(path: Path) -> dict[str, Any]:
    """The settings in a protocol.json."""
    content = read_json(path, "the settings of an experiment")
    conform(content, Protocol, str(path))
    return content


def in_common(settings: dict[str, Any]) -> dict[str, Any]:
    """The settings that all calls of a comparison must share."""
    fixed_steps = settings.get("steps") is not None
    return {
        key: value
        for key, value in settings.items()
        if not key.endswith("_sha256") and not (key == "device" and fixed_steps)
    }


RESULTS = "results.jsonl"  # Name of the file

LARGEST_RESULTS = 64 * MEGABYTE  # Largest size of the file, bytes; a row takes about 400


class ResultRow(Struct, frozen=True, kw_only=True):
    """The entries of a row's key, and so of every row."""

    label: str
    seed: Annotated[int, Meta(ge=0)]
    train_size: Annotated[int, Meta(ge=1)] | None


class ResultsFile:
    """The rows in ``results.jsonl``, a JSON object per line."""

    def __init__(self, folder: Path, schema: type[ResultRow]):
        self.path, self._schema = folder / RESULTS, schema

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
            conform(rows[-1], self._schema, place)
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

    def keep(self, key: dict[str, Any], row: dict[str, Any]) -> None:
        """Write a row with its key to the file, in place of an old one with this key."""
        rows, old, new = self.rows, self.row(key), {**key, **row}
        kept = [*rows, new] if old is None else [new if each == old else each for each in rows]
        write_atomically(self.path, ("\n".join(json.dumps(plain_values(each)) for each in kept) + "\n").encode())


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


def given_folder(output: Path | str | None) -> Path | None:
    """The folder that the caller gave as ``output``. None: nothing is to be kept."""
    if output is None:
        return None
    require_path(output=output)
    return Path(output)


@contextmanager
def results_in(
    output: Path | None,
    kind: str,
    settings: dict[str, Any],
    fingerprint: Callable[[], str],
    schemas: tuple[type[Struct], type[ResultRow]],
) -> Iterator[ResultsFile]:
    """Begin a comparison in a new folder, or continue the one in a folder, and keep other processes from it."""
    protocol, row = schemas
    if output is None:
        with tempfile.TemporaryDirectory(prefix="bisplat-") as temporary:
            yield ResultsFile(Path(temporary), row)
        return

    def read(path: Path) -> dict[str, Any]:
        content = read_json(path, f"the settings of a {kind}")
        conform(content, protocol, str(path))
        return content

    path = output / PROTOCOL
    require_writable(path)
    digest = fingerprint()
    with own_folder(output, kind, PROTOCOL, settings, lambda path: in_common(read(path))):
        if path.exists() and read(path)["data_sha256"] != digest:
            of = next(iter(settings.values()))
            raise InputError(f"{output}: expected a {kind} of {of} as it is now, found one of other data")
        write_atomically(
            path, (json.dumps(plain_values({**settings, "data_sha256": digest}), indent=2) + "\n").encode()
        )
        yield ResultsFile(output, row)
