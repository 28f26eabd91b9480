"""Builds glTF files for tests."""

import base64
import json
import struct
from typing import Any

import numpy as np

from scenes.scene.shapes import box

CODES = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}


class GltfBuilder:
    """A glTF file: arrays are added first, and then the header names them by their numbers."""

    def __init__(self) -> None:
        self.data = b""
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def view(self, raw: bytes, **more: Any) -> int:
        """Add bytes; return the number of their view."""
        self.views.append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(raw), **more})
        self.data += raw + b"\0" * (-len(raw) % 4)
        return len(self.views) - 1

    def array(self, values: Any, kind: str = "f4", gap: int = 0, **more: Any) -> int:
        """Add numbers, with gaps between the rows if you like; return the number of their accessor."""
        rows = np.asarray(values, f"<{kind}")
        shape = {1: "SCALAR", 2: f"VEC{rows.shape[-1]}", 3: "MAT4"}[rows.ndim]
        raw = b"".join(row.tobytes() + b"\0" * gap for row in rows)
        strided = {"byteStride": rows[0].nbytes + gap} if gap else {}
        entry = {
            "bufferView": self.view(raw, **strided),
            "componentType": CODES[kind],
            "count": len(rows),
            "type": shape,
        }
        self.accessors.append(entry | more)
        return len(self.accessors) - 1

    def box(self, low: Any, high: Any, **more: Any) -> dict[str, Any]:
        """Add a closed box; return its primitive."""
        mesh = box(low, high)
        corners = self.array(mesh.faces.ravel(), "u2")
        return {"attributes": {"POSITION": self.array(mesh.vertices)}, "indices": corners, **more}

    def header(self, **keys: Any) -> dict[str, Any]:
        """The header with the keys given; by default all nodes are roots of the only scene."""
        nodes = list(range(len(keys.get("nodes", []))))
        return {
            "asset": {"version": "2.0", "generator": "a test"},
            "scenes": [{"nodes": nodes}],
            "scene": 0,
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{"byteLength": len(self.data)}],
        } | keys

    def gltf(self, **keys: Any) -> bytes:
        """A .gltf file."""
        uri = "data:application/octet-stream;base64," + base64.b64encode(self.data).decode()
        return json.dumps(self.header(**keys) | {"buffers": [{"byteLength": len(self.data), "uri": uri}]}).encode()

    def glb(self, **keys: Any) -> bytes:
        """A .glb file."""
        text = json.dumps(self.header(**keys)).encode()
        text += b" " * (-len(text) % 4)
        head = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(self.data))
        chunk = struct.pack("<I4s", len(text), b"JSON") + text
        return head + chunk + struct.pack("<I4s", len(self.data), b"BIN\0") + self.data
