"""A new output folder whose files are written beside it, and moved there when all are whole."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from scenes.files.errors import InputError
from scenes.files.folder_lock import LOCK, locked


@contextmanager
def new_folder(output: Path, force: bool | None = None) -> Iterator[Path]:
    """Make a folder. If the process is killed on the way, the same call begins anew.

    Args:
        output: the folder: a new or an empty one.
        force: it may hold other files, of which those of the same names are replaced; None: the command has no
            --force.

    Returns:
        The folder to write to, .NAME.unfinished beside the output.

    Raises:
        InputError: the output holds other files, or another process makes it.
    """
    output = output.absolute()
    _require_new(output, force)
    unfinished = output.with_name(f".{output.name}.unfinished")
    unfinished.mkdir(parents=True, exist_ok=True)
    with locked(unfinished):
        for left in [path for path in unfinished.iterdir() if path.name != LOCK]:  # by a process that was killed
            shutil.rmtree(left) if left.is_dir() else left.unlink()
        try:
            yield unfinished
            _require_new(output, force)
            if not output.exists():
                unfinished.rename(output)
                return
            # Files of subfolders first: a scene's YAML and a dataset's index files, which refer to these, come last.
            files = [path for path in unfinished.rglob("*") if path.is_file() and path.name != LOCK]
            for file in sorted(files, key=lambda path: -len(path.parts)):
                place = output / file.relative_to(unfinished)
                place.parent.mkdir(parents=True, exist_ok=True)
                os.replace(file, place)
        finally:
            shutil.rmtree(unfinished, ignore_errors=True)


def _require_new(output: Path, force: bool | None) -> None:
    if output.exists() and not output.is_dir():
        raise InputError(f"{output}: expected a new folder, found a file")
    if output.exists() and not force and any(output.iterdir()):
        hint = "" if force is None else "; --force replaces those of the same names"
        raise InputError(f"{output}: expected a new folder, found other files{hint}")
