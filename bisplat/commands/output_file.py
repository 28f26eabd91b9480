"""Output files of commands: existing files are replaced only with --force."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from scenes.files.atomic import require_writable
from scenes.files.errors import InputError
from scenes.files.input_file import what_is_at

Force = Annotated[bool, arg(help="replace existing output files.")]
"""The option of every command that writes such files."""


def require_new(*paths: Path, force: bool) -> None:
    """Refuse to replace files, and paths to which no file can be written. Commands call this before any long work.

    Args:
        paths: files that will be written.
        force: existing files may be replaced, and links, but not what they link to; and no folders and devices.

    Raises:
        InputError: one of them exists, or there is a file on the path to it.
        OSError: the folder of one of them cannot be written to.
    """
    for path in paths:
        if path.exists() and not path.is_file():
            raise InputError(f"{path}: expected the name of a file to write, found {what_is_at(path)}")
        if os.path.lexists(path) and not force:
            raise InputError(f"{path}: expected no such file yet, found one; --force replaces it")
        require_writable(path)
