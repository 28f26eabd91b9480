"""Hypothesis strategies: mesh files of random polygons or glTF nodes, with the area that they mean."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from hypothesis import strategies as st

from tests import hostile_files as hostile

Draw = Callable[[st.SearchStrategy], Any]


class Shape(NamedTuple):
    """A mesh file."""

    name: str
    content: bytes
    area: float | None  # of its faces, in its own unit squared; None: it means no area, or may be refused


CENTRE = np.array([1.5, 3.0, 1.0])  # In front of the gateway of ``victims.PLACE``


@st.composite
def polygons(draw: Draw) -> Shape:
    """An OBJ, OFF or PLY file of one to four polygons, of which many have notches; some cross themselves."""
    corners: list[np.ndarray] = []
    faces: list[list[int]] = []
    area: float | None = 0.0
    for _ in range(draw(st.integers(1, 4))):
        flat, plain = draw(_flat_polygons())
        placed = draw(_placed(flat))
        order = list(range(len(placed)))
        if draw(st.booleans()):
            order.reverse()
        faces.append([len(corners) + index for index in order])
        corners += list(placed)
        # The shoelace formula, which needs no triangles.
        x, y = flat.T
        own = 0.5 * abs(float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))))
        area = area + own if plain and area is not None else None
    name = draw(st.sampled_from(("wall.obj", "wall.off", "wall.ply")))
    return Shape(name, draw(_written(name, np.array(corners), faces)), area)


@st.composite
def _flat_polygons(draw: Draw) -> tuple[np.ndarray, bool]:
    """Corners in a plane, and whether the polygon has an area that everyone agrees on."""
    count = draw(st.integers(3, 12))
    radii = np.array(draw(st.lists(st.floats(0.05, 1), min_size=count, max_size=count)))
    angles = 2 * np.pi * np.arange(count) / count
    corners = radii[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    how = draw(st.sampled_from(("star", "star", "star", "twice", "in line", "crossing")))
    if how == "twice":  # a corner is repeated
        at = draw(st.integers(0, count - 1))
        corners = np.insert(corners, at, corners[at], axis=0)
    elif how == "in line":  # a corner lies on an edge
        at = draw(st.integers(0, count - 1))
        corners = np.insert(corners, at + 1, (corners[at] + corners[(at + 1) % count]) / 2, axis=0)
    elif how == "crossing":
        corners = corners[draw(st.permutations(range(count)))]
    return corners, how != "crossing"


@st.composite
def _placed(draw: Draw, flat: np.ndarray) -> np.ndarray:
    """Corners of the plane, turned and moved in space."""
    turn = np.linalg.qr(np.array(draw(st.lists(st.floats(-1, 1), min_size=9, max_size=9))).reshape(3, 3) + np.eye(3))[0]
    shift = np.array(draw(st.lists(st.floats(-1, 1), min_size=3, max_size=3)))
    return np.pad(flat, ((0, 0), (0, 1))) @ turn.T + CENTRE + shift


@st.composite
def _written(draw: Draw, name: str, corners: np.ndarray, faces: list[list[int]]) -> bytes:
    """The polygons in the format that a name has, in one of its spellings."""
    if name == "wall.off":
        rows = [" ".join(map(repr, corner.tolist())) for corner in corners]
        rows += [" ".join(map(str, (len(face), *face))) for face in faces]
        return "\n".join(["OFF", f"{len(corners)} {len(faces)} 0", *rows, ""]).encode()
    if name == "wall.ply":
        rows = [" ".join(map(repr, corner.tolist())) for corner in corners]
        rows += [" ".join(map(str, (len(face), *face))) for face in faces]
        head = ["ply", "format ascii 1.0", f"element vertex {len(corners)}"]
        head += [f"property double {axis}" for axis in "xyz"]
        head += [f"element face {len(faces)}", f"property list uchar int {draw(st.sampled_from(NAMES))}", "end_header"]
        return "\n".join([*head, *rows, ""]).encode()
    rows = ["v " + " ".join(map(repr, corner.tolist())) for corner in corners]
    first = draw(st.sampled_from(("{}", "{}/", "{}//", "{}//1"))) if draw(st.booleans()) else "{}"
    negative = draw(st.booleans())
    rows += ["vn 0 0 1"] * ("//1" in first)
    for face in faces:
        numbers = [index - len(corners) if negative else index + 1 for index in face]
        rows.append("f " + draw(st.sampled_from((" ", "  ", " \\\n"))).join(first.format(each) for each in numbers))
    return (draw(st.sampled_from(("\n", "\r\n"))).join(rows) + "\n").encode()


NAMES = ("vertex_indices", "vertex_index")

TRIANGLES = {4: "triangles", 6: "fan"}
"""Modes of glTF primitives that have an area. Strips are refused."""


@st.composite
def nodes(draw: Draw) -> Shape:
    """A .gltf file of nested, mirrored and scaled nodes with primitives (no strips), and with odd extensions."""
    content: dict[str, Any] = {"asset": {"version": "2.0"}, "scene": 0, "accessors": [], "bufferViews": []}
    data, meshes, area_known = b"", [], True
    soups: list[np.ndarray] = []
    for _ in range(draw(st.integers(1, 2))):
        count = draw(st.sampled_from((3, 4, 6, 9)))
        points = np.array(draw(st.lists(st.floats(-1, 1, width=32), min_size=3 * count, max_size=3 * count)), "<f4")
        points = points.reshape(count, 3) + np.eye(3, dtype="<f4")[np.arange(count) % 3]  # rarely all in a line
        mode = draw(st.sampled_from((4, 4, 4, 6, 6, 0, 1, 2, 3)))
        order = np.arange(count, dtype="<u4")
        if draw(st.booleans()):
            order = np.array(draw(st.permutations(range(count))), "<u4")
        primitive: dict[str, Any] = {"attributes": {"POSITION": len(content["accessors"])}, "mode": mode}
        parts = [(points, "VEC3", 5126)]
        if draw(st.booleans()):
            primitive["indices"] = len(content["accessors"]) + 1
            parts.append((order, "SCALAR", 5125))
        else:
            order = np.arange(count)
        for array, kind, component in parts:
            view = {"buffer": 0, "byteOffset": len(data), "byteLength": array.nbytes}
            accessor = {"bufferView": len(content["bufferViews"]), "componentType": component, "type": kind}
            content["bufferViews"].append(view)
            content["accessors"].append(accessor | {"count": len(array)})
            data += array.tobytes()
        meshes.append({"primitives": [primitive]})
        soups.append(points.astype(float)[_triangles(mode, order)] if mode in TRIANGLES else np.zeros((0, 3, 3)))
    content["meshes"], content["buffers"] = meshes, [{"uri": hostile.data_uri(data), "byteLength": len(data)}]
    area, content["nodes"] = 0.0, []
    parent, above = None, np.eye(4)
    for number in range(draw(st.integers(1, 4))):
        node, matrix = draw(_transforms())
        mesh = draw(st.integers(0, len(meshes) - 1))
        above = above @ matrix if draw(st.booleans()) and parent is not None else matrix
        nested = above is not matrix
        if nested:
            content["nodes"][parent].setdefault("children", []).append(number)
        content["nodes"].append({"name": f"node{number}", "mesh": mesh} | node)
        content.setdefault("roots", []).extend([] if nested else [number])
        triangles = soups[mesh] @ above[:3, :3].T + above[:3, 3]
        edges = triangles[:, 1:] - triangles[:, :1]
        area += 0.5 * float(np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1).sum())
        parent = number
    content["scenes"] = [{"nodes": content.pop("roots")}]
    if draw(st.integers(0, 3)) == 0:
        name = draw(st.sampled_from(EXTENSIONS))
        content["extensionsUsed"] = [name]
        content[draw(st.sampled_from(("extensionsRequired", "extras")))] = [name]
        area_known = False
    return Shape("wall.gltf", json.dumps(content).encode(), area if area_known and area > 0.01 else None)


EXTENSIONS = (
    *("KHR_draco_mesh_compression", "EXT_meshopt_compression", "EXT_mesh_gpu_instancing", "KHR_mesh_quantization"),
    *("KHR_materials_unlit", "KHR_texture_transform", "KHR_lights_punctual", "MSFT_lod", "", "x"),
)


def _triangles(mode: int, order: np.ndarray) -> np.ndarray:
    """Corners of the triangles of a primitive, from the specification of glTF 2.0."""
    count = len(order)
    if mode == 4:
        return order[: count // 3 * 3].reshape(-1, 3).astype(int)
    return np.stack([np.full(count - 2, order[0]), order[1:-1], order[2:]], axis=1).astype(int)


@st.composite
def _transforms(draw: Draw) -> tuple[dict[str, Any], np.ndarray]:
    """Keys of a node, and the matrix that they mean; many mirror."""
    scale = np.array(draw(st.lists(st.sampled_from((0.5, 1.0, -1.0, 2.0)), min_size=3, max_size=3)))
    shift = np.array(draw(st.lists(st.floats(-1, 1), min_size=3, max_size=3)))
    x, y, z, w = quaternion = draw(st.sampled_from(((0, 0, 0, 1), (0, 0, 0.6, 0.8), (0.5, 0.5, 0.5, 0.5))))
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn * scale, shift
    if draw(st.booleans()):
        return {"matrix": matrix.T.ravel().tolist()}, matrix
    return {"translation": shift.tolist(), "rotation": list(quaternion), "scale": scale.tolist()}, matrix
