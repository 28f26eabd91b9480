"""Read the arrays of a glTF file: buffers inside and beside it, accessors with strides and normalised ones."""

from __future__ import annotations

import base64
import binascii
from pathlib import Path
from urllib.parse import unquote, unquote_to_bytes

import numpy as np

from scenes.files.errors import InputError, named
from scenes.files.input_file import MEGABYTE, beside, read_bytes
from scenes.importing.formats.gltf_header import COMPONENTS, COMPRESSION, Accessor, Header, pick

LARGEST_FILE = 256 * MEGABYTE
"""Most bytes of a mesh file, and of all files together that a glTF file names."""

TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}


class Arrays:
    """The arrays of a file. Buffers are read when they are needed."""

    def __init__(self, header: Header, binary: bytes | None, path: Path) -> None:
        self.header, self.binary, self.path, self.source = header, binary, path, str(path)
        self.buffers: dict[int, bytes] = {}
        self.arrays: dict[int, np.ndarray] = {}
        self.left = LARGEST_FILE

    def read(self, index: int, kind: str) -> np.ndarray:
        """Return the array of an accessor, with integers that stand for −1 to 1 or 0 to 1 converted."""
        accessor = pick(self.header.accessors, index, self.source, "accessors")
        if accessor.type != kind:
            raise InputError(f"{self.source}: accessors[{index}]: expected {kind}, found {named(accessor.type)}")
        if index not in self.arrays:
            self.arrays[index] = self._read(accessor, f"{self.source}: accessors[{index}]")
        return self.arrays[index]

    def _read(self, accessor: Accessor, label: str) -> np.ndarray:
        shape = (accessor.count,) if accessor.type == "SCALAR" else (accessor.count, COMPONENTS[accessor.type])
        if accessor.sparse is not None:
            raise InputError(f"{label}: expected a plain array, found a sparse one; export without sparse accessors")
        if accessor.buffer_view is None:
            raise InputError(
                f"{label}: expected plain geometry, found none; if it is compressed by {COMPRESSION[0]}, export it "
                "uncompressed"
            )
        values = self._table(accessor.buffer_view, accessor.byte_offset, shape, accessor.component_type, label)
        if accessor.normalized and values.dtype.kind in "iu":
            return np.maximum(values / np.iinfo(values.dtype).max, -1)
        return values

    def _table(self, view: int, offset: int, shape: tuple[int, ...], component: int, label: str) -> np.ndarray:
        """Return a part of a buffer as rows, which may have gaps between them."""
        entry = pick(self.header.buffer_views, view, self.source, "bufferViews")
        if component not in TYPES:
            raise InputError(f"{label}: expected a componentType of glTF, found {component}")
        kind = np.dtype(TYPES[component])
        row = kind.itemsize * int(np.prod(shape[1:]))
        stride = entry.byte_stride or row
        size = stride * (shape[0] - 1) + row if shape[0] else 0
        data = memoryview(self._buffer(entry.buffer))[entry.byte_offset : entry.byte_offset + entry.byte_length]
        if offset + size > len(data):
            raise InputError(f"{label}: expected {offset + size} bytes in bufferViews[{view}], found {len(data)}")
        strides = (stride, kind.itemsize)[: len(shape)]
        return np.ndarray(shape, kind, data, offset, strides) if shape[0] else np.zeros(shape, kind)

    def _buffer(self, index: int) -> bytes:
        if index not in self.buffers:
            buffer = pick(self.header.buffers, index, self.source, "buffers")
            label = f"{self.source}: buffers[{index}]"
            if buffer.uri is None:
                if index or self.binary is None:
                    cause = next((f" (compressed by {name})" for name in COMPRESSION if name in buffer.extensions), "")
                    raise InputError(f"{label}: expected data, found none{cause}")
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
