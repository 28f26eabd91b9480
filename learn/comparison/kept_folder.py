"""The folder of a comparison: protocol.json with the settings of all its rows, and the rows measured so far."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from msgspec import Struct

from learn.comparison.kept_rows import KeptRow, KeptRows
from learn.comparison.protocol import PROTOCOL, in_common
from scenes.files.atomic import require_writable, write_atomically
from scenes.files.errors import InputError, require_path
from scenes.files.json_yaml_xml import plain_number, read_json
from scenes.files.output_folder import own_folder
from scenes.files.schema import conform


def given_folder(output: Path | str | None) -> Path | None:
    """The folder that the caller gave as ``output``. None: nothing is to be kept."""
    if output is None:
        return None
    require_path(output=output)
    return Path(output)


@contextmanager
def kept_in(
    output: Path | None,
    kind: str,
    settings: dict[str, Any],
    fingerprint: Callable[[], str],
    schemas: tuple[type[Struct], type[KeptRow]],
) -> Iterator[KeptRows]:
    """Begin a comparison in a new folder, or continue the one in a folder, and keep other processes from it."""
    protocol, row = schemas
    if output is None:
        with tempfile.TemporaryDirectory(prefix="bisplat-") as temporary:
            yield KeptRows(Path(temporary), row)
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
            path, (json.dumps({**settings, "data_sha256": digest}, indent=2, default=plain_number) + "\n").encode()
        )
        yield KeptRows(output, row)
