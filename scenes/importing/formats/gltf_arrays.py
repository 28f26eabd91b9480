"""Read the arrays of a glTF file: buffers inside and beside it, accessors with strides and normalised ones."""

from __future__ import annotations

import base64
import binascii
from pathlib import Path
from typing import Literal
from urllib.parse import unquote, unquote_to_bytes

import numpy as np

from scenes.files.errors import InputError, named
from scenes.files.input_file import MEGABYTE, beside, read_bytes
from scenes.importing.formats.gltf_header import COMPRESSION, Header, pick

LARGEST_FILE = 256 * MEGABYTE
"""Most bytes of a mesh file, and of all files together that a glTF file names."""

TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}


class Arrays:
    """The arrays of a file. Buffers are read when they are needed."""

    def __init__(self, header: Header, binary: bytes | None, path: Path) -> None:
        self.header, self.binary, self.path, self.source = header, binary, path, str(path)
        self.buffers: dict[int, bytes] = {}
        self.left = LARGEST_FILE

    def read(self, index: int, kind: Literal["SCALAR", "VEC3", "VEC4"]) -> np.ndarray:
        """Return the array of an accessor, with integers that stand for −1 to 1 or 0 to 1 converted."""
        accessor = pick(self.header.accessors, index, self.source, "accessors")
        label = f"{self.source}: accessors[{index}]"
        if accessor.type != kind:
            raise InputError(f"{label}: expected {kind}, found {named(accessor.type)}")
        if accessor.sparse is not None:
            raise InputError(f"{label}: expected a plain array, found a sparse one; export without sparse accessors")
        if accessor.buffer_view is None:
            raise InputError(
                f"{label}: expected plain geometry, found none; if it is compressed by {COMPRESSION[0]}, export it "
                "uncompressed"
            )
        if accessor.component_type not in TYPES:
            raise InputError(f"{label}: expected a componentType of glTF, found {accessor.component_type}")
        view = pick(self.header.buffer_views, accessor.buffer_view, self.source, "bufferViews")
        number = np.dtype(TYPES[accessor.component_type])
        numbers = 1 if kind == "SCALAR" else int(kind[3:])
        shape = (accessor.count,) if kind == "SCALAR" else (accessor.count, numbers)
        row = number.itemsize * numbers
        stride = view.byte_stride or row  # there may be gaps between the rows
        end = accessor.byte_offset + (stride * (accessor.count - 1) + row if accessor.count else 0)
        data = memoryview(self._buffer(view.buffer))[view.byte_offset : view.byte_offset + view.byte_length]
        if end > len(data):
            raise InputError(f"{label}: expected {end} bytes in bufferViews[{accessor.buffer_view}], found {len(data)}")
        if not accessor.count:
            return np.zeros(shape)
        values = np.ndarray(shape, number, data, accessor.byte_offset, (stride, number.itemsize)[: len(shape)])
        if accessor.normalized and number.kind in "iu":
            return np.maximum(values / np.iinfo(number).max, -1)
        return values

    def _buffer(self, index: int) -> bytes:
        if index not in self.buffers:
            buffer = pick(self.header.buffers, index, self.source, "buffers")
            label = f"{self.source}: buffers[{index}]"
            if buffer.uri is None:
                if index or self.binary is None:
                    raise InputError(f"{label}: expected data, found none; if they are compressed, export without that")
                self.buffers[index] = self.binary
            elif buffer.uri.startswith("data:"):
                self.buffers[index] = _decoded(buffer.uri, label)
            else:
                self.buffers[index] = self._file(unquote(buffer.uri), label)
        return self.buffers[index]

    def _file(self, name: str, label: str) -> bytes:
        try:
            data = read_bytes(beside(self.path, name), "a buffer of glTF", self.left)
        except InputError as error:
            raise InputError(f"{label}: {error}") from None
        self.left -= len(data)
        return data


def _decoded(uri: str, label: str) -> bytes:
    """Return the data in an address that holds them itself."""
    kind, _, text = uri.partition(",")
    if not kind.endswith(";base64"):
        return unquote_to_bytes(text)
    try:
        return base64.b64decode(text)
    except (binascii.Error, ValueError):
        raise InputError(f"{label}: expected data in Base64, found others") from None
