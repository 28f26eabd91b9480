"""Output files of commands: existing files are replaced only with --force."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from scenes.files.errors import InputError

Force = Annotated[bool, arg(help="replace existing output files.")]
"""The option of every command that writes such files."""


def require_new(*paths: Path, force: bool) -> None:
    """Refuse to replace files. Commands call this before any long work.

    Args:
        paths: files that will be written.
        force: existing files may be replaced, but not folders.

    Raises:
        InputError: one of them exists.
    """
    for path in paths:
        if path.is_dir():
            raise InputError(f"{path}: expected the name of a file to write, found a folder")
        if path.exists() and not force:
            raise InputError(f"{path}: expected no such file yet, found one; --force replaces it")
