"""The standard streams, however the shell gives them: closed, to a full disk, or without Unicode."""

from __future__ import annotations

import os
import sys
from io import BufferedWriter, FileIO, TextIOWrapper
from typing import Any

STDOUT = "standard output"
"""File name of errors of stdout, which have none otherwise."""


def prepare_streams() -> None:
    """Open closed streams, escape characters that a stream cannot show, and let errors of stdout name it.

    Were they left closed, the first file that a command opens would get what libraries print.
    """
    while (number := os.open(os.devnull, os.O_RDWR)) <= 2:
        pass
    os.close(number)
    sys.stdin = sys.stdin or open(0)
    sys.stderr = sys.stderr or open(2, "w")
    if sys.stdout is None:
        sys.stdout = open(1, "w")
    elif isinstance(sys.stdout, TextIOWrapper) and sys.stdout is sys.__stdout__:
        sys.stdout = TextIOWrapper(
            BufferedWriter(_Stdout(1, "w", closefd=False)),
            sys.stdout.encoding,
            line_buffering=sys.stdout.line_buffering,
            write_through=sys.stdout.write_through,
        )
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def give_up_stdout() -> None:
    """Let what is still in the buffer of stdout go nowhere, so that Python does not fail on it when it ends."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


class _Stdout(FileIO):
    def write(self, content: Any) -> int:
        try:
            return super().write(content)
        except OSError as error:
            error.filename = STDOUT
            raise
