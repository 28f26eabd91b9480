"""Files that the user gave: only regular ones of a bounded size are opened."""

from __future__ import annotations

import os
import socket
from pathlib import Path

import pytest

from scenes.files.errors import InputError
from scenes.files.input_file import read_bytes, read_text


def test_text_is_read_without_its_byte_order_mark(tmp_path):
    path = tmp_path / "text.csv"
    path.write_bytes(b"\xef\xbb\xbfx,y,z\n")
    assert read_text(path, "a CSV", 100) == "x,y,z\n"
    assert read_bytes(path, "a CSV", 9) == b"\xef\xbb\xbfx,y,z\n"


def a_socket(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(path))


def a_large_file(path: Path) -> None:
    with path.open("wb") as file:
        file.truncate(10**12)


@pytest.mark.parametrize(
    ("make", "found"),
    [
        (os.mkfifo, "found a named pipe"),
        (a_socket, "found a socket"),
        (Path.mkdir, "found a folder"),
        (lambda path: path.symlink_to("/dev/zero"), "found a device"),
        (lambda path: path.symlink_to("nowhere"), "found no such file"),
        (lambda path: path.symlink_to(path.name), "cannot be read"),
        (a_large_file, "of at most 1 MB, found 1e.06 MB"),
        (lambda path: path.write_bytes(b"Caf\xe9"), "found text that is not UTF-8"),
    ],
)
def test_anything_else_is_refused_in_a_sentence(tmp_path, make, found):
    path = tmp_path / "given"
    make(path)
    with pytest.raises(InputError, match=f"given: expected a CSV.*{found}"):
        read_text(path, "a CSV", 10**6)


def test_a_name_with_a_null_character_is_refused():
    with pytest.raises(InputError, match="expected a CSV"):
        read_text(Path("a\0b"), "a CSV", 10**6)
