"""The fits of a comparison of powers, channels or responses over a band: rows of scores, and arrays for figures."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from msgspec import Meta, Struct

from learn.comparison.kept_folder import kept_in
from learn.comparison.kept_rows import KeptRow, KeptRows, row_name
from learn.data.splits import GUARD_MOST, SplitKind
from scenes.files.atomic import write_atomically
from scenes.files.input_file import MEGABYTE
from scenes.files.npz_file import Expected, read_npz

LARGEST_ARRAYS = 4000 * MEGABYTE
"""Largest size of the arrays of a fit, bytes."""


class FitsProtocol(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The content of protocol.json: the settings that all rows have in common."""

    dataset: str  # absolute path of the dataset's folder
    predicted: str  # what the methods predict
    split: SplitKind  # how the test part is chosen
    seed: Annotated[int, Meta(ge=0)]  # seed of the split
    # known positions nearer than this to a test position are left out, wavelengths
    guard: Annotated[float, Meta(ge=0, le=GUARD_MOST)]
    minutes: Annotated[float, Meta(gt=0)]  # training time of each method that is trained by steps
    data_sha256: str  # fingerprint of the dataset


class FitRow(KeptRow, frozen=True, kw_only=True):
    """The entries that every row has. The others are the scores."""

    known: Annotated[int, Meta(ge=1)]
    seconds: float


class KeptFits(KeptRows):
    """The rows in results.jsonl, and the arrays of those of the first seed in per_sample/."""

    def keep_fit(self, key: dict[str, Any], row: dict[str, Any], arrays: Mapping[str, np.ndarray]) -> None:
        """Write a fit to the files, in place of an old one with this key."""
        if key["seed"] == 0:
            archive = io.BytesIO()
            np.savez(archive, **arrays)  # type: ignore[arg-type]
            write_atomically(self._path(key), archive.getvalue())
        self.keep(key, row)

    def arrays(self, expected: Mapping[str, Expected]) -> Iterator[tuple[dict[str, Any], dict[str, np.ndarray]]]:
        """The rows of the first seed, each with its arrays."""
        for row in self.rows:
            if row["seed"] == 0:
                yield row, read_npz(self._path(row), "arrays of a comparison", expected, LARGEST_ARRAYS)

    def _path(self, key: Mapping[str, Any]) -> Path:
        return self.path.parent / "per_sample" / f"{row_name(key)}.npz"


@contextmanager
def kept_fits(
    output: Path | None,
    predicted: str,
    dataset: Path,
    settings: dict[str, Any],
    data: Iterable[np.ndarray | None],
    schema: type[FitRow],
) -> Iterator[KeptFits]:
    """Begin a comparison in a new folder, or continue the one in a folder, and keep other processes from it."""

    def fingerprint() -> str:
        digest = hashlib.sha256()
        for each in data:
            array = np.asarray("nothing" if each is None else each)
            digest.update(f"{array.dtype} {array.shape}".encode())
            digest.update(np.ascontiguousarray(array).data)
        return digest.hexdigest()

    given = {"dataset": str(dataset.resolve()), "predicted": predicted, **settings}
    with kept_in(output, f"comparison of {predicted}", given, fingerprint, (FitsProtocol, schema)) as kept:
        yield KeptFits(kept.path.parent, schema)


def earlier_sizes(output: Path | None) -> set[int | None]:
    """The numbers of training positions of the rows that a folder has from earlier calls."""
    rows = [] if output is None else KeptRows(output, FitRow).rows
    return {row["train_size"] for row in rows}
