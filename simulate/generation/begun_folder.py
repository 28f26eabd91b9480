"""Tell whether the same simulation began a folder, so that it can continue there, by what metadata.json records."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from msgspec import to_builtins

from scenes.files.atomic import remove_left
from scenes.files.errors import InputError
from scenes.files.output_folder import has_other_files, locked
from simulate.dataset.dataset_writer import write_metadata
from simulate.dataset.metadata import Metadata, read_metadata_file


def begun(folder: Path, metadata: dict[str, Any]) -> bool:
    """Whether a simulation with the same metadata began a folder; False if it is new or empty."""
    if not folder.exists() or (folder.is_dir() and not has_other_files(folder)):
        return False
    path = folder / "metadata.json"
    if not path.is_file():
        raise InputError(f"{folder}: expected a new folder or one that this command began, found other files in it")
    found = read_metadata_file(path, "the settings of a dataset")
    found.setdefault("engine", "rays")  # the only engine of version 0.1, which did not record it
    # Through JSON, so that numbers compare as they were written.
    wanted, missing = json.loads(json.dumps(metadata)), to_builtins(Metadata())
    recorded = [key for key in missing if key in found]  # some settings are recorded by some simulations only
    for key in ("seed", *wanted, *recorded):  # the seed first, since propagation and measurement contain seeds, too
        there, here = (settings.get(key, missing.get(key)) for settings in (found, wanted))
        if there != here:
            raise InputError(
                f"{folder}: expected a new folder or one that this command began, found a dataset whose "
                f"{_difference(key, there, here)}"
            )
    return True


@contextmanager
def continued(folder: Path, metadata: dict[str, Any]) -> Iterator[None]:
    """Lock a folder within a block, and begin it unless the same simulation did."""
    with locked(folder):
        if not begun(folder, metadata):  # again, since another process may have begun in the meantime
            write_metadata(folder / "metadata.json", metadata)
        remove_left(folder, deep=True)
        yield


def _difference(key: str, found: Any, wanted: Any) -> str:
    """A setting that differs; of a group of settings, the first one that does.

    >>> _difference("propagation", {"los": True, "max_depth": 2}, {"los": True, "max_depth": 3})
    'propagation.max_depth is 2, not 3'
    """
    if isinstance(found, dict) and isinstance(wanted, dict) and found.keys() == wanted.keys():
        inner = next(each for each in wanted if found[each] != wanted[each])
        return _difference(f"{key}.{inner}", found[inner], wanted[inner])
    return f"{key} is {found}, not {wanted}"
