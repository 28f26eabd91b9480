"""Hostile and damaged files, each made by a small function, and what the sentence that refuses it says was found.

A case is a function that makes the file at a path, and a word of the sentence. Tests go through all of a kind; so can
any other program that attacks the commands.
"""

from __future__ import annotations

import io
import os
import struct
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
from PIL import Image

Make = Callable[[Path], object]
Case = tuple[Make, str]


def content(data: bytes | str) -> Make:
    """A file of this content."""
    return lambda path: path.write_bytes(data if isinstance(data, bytes) else data.encode())


def terabyte(path: Path) -> None:
    """A file of zeros that takes no room."""
    path.touch()
    os.truncate(path, 10**12)


ANY_FILE: dict[str, Case] = {
    "named pipe": (os.mkfifo, "a named pipe"),
    "device": (lambda path: path.symlink_to("/dev/zero"), "a device"),
    "folder": (Path.mkdir, "a folder"),
    "link to itself": (lambda path: path.symlink_to(path.name), "cannot be read"),
    "terabyte": (terabyte, "1e+06 MB"),
}
"""What can stand in the place of any file."""


# Pictures


def png(*chunks: tuple[bytes, bytes], header: tuple[int, ...] = (360, 90, 8, 0, 0, 0, 0)) -> bytes:
    """A PNG of 360 × 90 grey levels with further chunks before its pixels; or one whose header tells another size."""
    pixels = zlib.compress(bytes(90 * 361))
    parts = [(b"IHDR", struct.pack(">IIBBBBB", *header)), *chunks, (b"IDAT", pixels), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body)) for kind, body in parts
    )


def grey_in(form: str) -> bytes:
    """A grey picture of the right size in another format."""
    buffer = io.BytesIO()
    Image.new("L", (360, 90)).save(buffer, form)
    return buffer.getvalue()


def animated() -> bytes:
    buffer = io.BytesIO()
    first, *others = (Image.new("L", (360, 90), level) for level in (0, 100, 200))
    first.save(buffer, "PNG", save_all=True, append_images=others)
    return buffer.getvalue()


TEXT = b"a\0\0" + zlib.compress(bytes(10**6))

PICTURES: dict[str, Case] = {
    **ANY_FILE,
    "nothing": (content(b""), "damaged"),
    "header of 100,000 × 100,000": (content(png(header=(100_000, 100_000, 8, 0, 0, 0, 0))), "more"),
    "header of 10,000 × 10,000": (content(png(header=(10_000, 10_000, 8, 0, 0, 0, 0))), "10000 × 10000"),
    "header of 99 bits": (content(png(header=(360, 90, 99, 7, 5, 5, 5))), "damaged"),
    "text of 100 MB": (content(png((b"zTXt", b"a\0\0" + zlib.compress(bytes(10**8), 9)))), "damaged"),
    "100 texts of 1 MB": (content(png(*[(b"zTXt", TEXT)] * 100)), "damaged"),
    "short pHYs": (content(png((b"pHYs", b"a"))), "damaged"),
    "short acTL": (content(png((b"acTL", b"a"))), "damaged"),
    "100,000 frames": (content(png((b"acTL", struct.pack(">II", 10**5, 0)))), "frame"),
    "animation": (content(animated()), "frame"),
    **{form: (content(grey_in(form)), "another kind") for form in ("JPEG", "GIF", "TIFF", "BMP", "PPM")},
}


# Positions

POSITIONS: dict[str, Case] = {
    **ANY_FILE,
    "nothing": (content(""), "empty"),
    "null characters": (content("x,y,z\n1,2,\0\n"), r"\x00"),
    "one long line": (content("x,y,z\n" + "1," * 10**6), "three finite numbers"),
    "long quoted field": (content('x,y,z\n"' + ("1" * 900 + "\n") * 200 + '"'), "field"),
    "control characters": (content("x,y,z\n\x1b[2J,1,1\n"), r"\x1b[2J"),
    "infinite": (content("x,y,z\n1,2,1e999\n"), "1e999"),
    "1e40 m": (content("x,y,z\n0,0,0\n1e40,0,0\n"), "position 2 (line 3)"),
    "header in capitals": (content("X,Y,Z\n1,2,3\n"), "X,Y,Z"),
    "semicolons": (content("x;y;z\n1;2;3\n"), "x;y;z"),
    "UTF-16": (content("x,y,z\n1,2,3\n".encode("utf-16")), "UTF-8"),
}


# Archives of arrays


def npy(shape: object, dtype: str = "<c8", data: bytes = b"") -> bytes:
    """An array whose header tells a shape and a type, whatever follows."""
    header = f"{{'descr': '{dtype}', 'fortran_order': False, 'shape': {shape!r}, }}".encode()
    header += b" " * (-(len(header) + 11) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + data


def archive(*members: tuple[str, bytes], compression: int = zipfile.ZIP_STORED) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", compression) as file:
        for name, data in members:
            file.writestr(name, data)
    return buffer.getvalue()


def saved(**arrays: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()


def altered(data: bytes, signature: bytes, offset: int, value: int) -> bytes:
    """An archive with two bytes changed in the first record of a kind."""
    at = data.index(signature) + offset
    return data[:at] + struct.pack("<H", value) + data[at + 2 :]


def with_field(offset: int, value: int) -> bytes:
    """An archive with other flags (offset 6) or another compression method (offset 8)."""
    data = archive(("channels.npy", npy((5, 16), data=bytes(640))))
    return altered(altered(data, b"PK\x01\x02", offset + 2, value), b"PK\x03\x04", offset, value)


def with_wrong_checksum() -> bytes:
    data = archive(("channels.npy", npy((5, 16), data=b"\x11" * 640)))
    return data.replace(b"\x11" * 640, b"\x11" * 639 + b"\x12")


def twice() -> bytes:
    one, other = ("channels.npy", npy((5, 16), data=bytes(640))), ("channelz.npy", npy((5, 16), data=bytes(640)))
    return archive(one, other).replace(b"channelz", b"channels")


ONES = np.ones((5, 16), np.complex64)

RESPONSES: dict[str, Case] = {
    **ANY_FILE,
    "nothing": (content(b""), "damaged"),
    "no arrays": (content(archive()), "none"),
    "other arrays": (content(saved(spectra=ONES)), "none"),
    "1,000 arrays": (content(archive(*[(f"{number}.npy", b"") for number in range(1000)])), "1000"),
    "one name twice": (content(twice()), "twice"),
    "encrypted": (content(with_field(6, 1)), "encrypted"),
    "unknown compression": (content(with_field(8, 77)), "compression method 77"),
    "LZMA": (content(archive(("channels.npy", npy((5, 16))), compression=zipfile.ZIP_LZMA)), "compression method 14"),
    "deflated 100 MB": (content(archive(("channels.npy", bytes(10**8)), compression=8)), "100"),
    "wrong checksum": (content(with_wrong_checksum()), "damaged"),
    "1e12 elements": (content(archive(("channels.npy", npy((10**12, 16))))), "1000000000000"),
    "5 × 16 of nothing": (content(archive(("channels.npy", npy((5, 16))))), "found (5, 16)"),
    "negative shape": (content(archive(("channels.npy", npy((-5, -16), data=bytes(640))))), "(-5, -16)"),
    "shape that is no tuple": (content(archive(("channels.npy", npy("5")))), "damaged"),
    "deep header": (content(archive(("channels.npy", npy("(" * 9000)))), "damaged"),
    "version 3": (content(archive(("channels.npy", b"\x93NUMPY\x03\x00" + b"\xff" * 8))), "3.0"),
    "objects": (content(archive(("channels.npy", npy((5, 16), "|O")))), "object"),
    "letters": (content(saved(channels=np.full((5, 16), "a"))), "<U1"),
    "real numbers": (content(saved(channels=ONES.real)), "float32"),
    "records": (content(saved(channels=np.zeros((5, 16), [("a", "f4")]))), "[('a', '<f4')]"),
    "not finite": (content(saved(channels=ONES * np.nan)), "5 rows"),
    "all zero": (content(saved(channels=0 * ONES)), "found 0"),
    "1e300": (content(saved(channels=1e300 * ONES.astype(complex))), "1e+300"),
    "retrieved of numbers": (content(saved(channels=ONES, retrieved=np.ones(5))), "float64"),
}


# Index files

INDEXES: dict[str, Case] = {
    **ANY_FILE,
    "unknown name of 1 MB": (content("9" * 10**6), "'999"),
    "number of 5,000 digits": (content("1" * 5000), "'111"),
    "null characters": (content(bytes(1000)), r"\x00"),
    "digits of another script": (content("٣\n"), "٣"),
    "UTF-16": (content("00001\n".encode("utf-16")), "UTF-8"),
}
