"""Hypothesis strategies: files as they are, with a few parts changed into what a reader may stumble over."""

from __future__ import annotations

import io
import json
import re
from collections.abc import Callable
from copy import deepcopy
from typing import Any

import h5py
import numpy as np
import scipy.io
import yaml
from hypothesis import strategies as st
from safetensors.numpy import load, save

Draw = Callable[[st.SearchStrategy], Any]

TEXTS = (
    *("", " ", "0", "-1", "1", "7", "1e9", "-1e9", "1e40", "1e300", "1e-300", "1e999", "nan", "inf", "-inf", "-0.0"),
    *(
        "9" * 20,
        "9" * 400,
        "0x10",
        "1_000",
        "２",
        "٣",
        "1,5",
        "null",
        "true",
        "~",
        "[]",
        "{}",
        "[[1]]",
        "x",
        "x" * 9000,
    ),
    *("[/red]", "$\\frac{$", "\x1b[2J", "\0", "\r", "\n", "\t", "\u202e", "\ufeff", "é", "\ud7ff", "%s", "{0}", "*"),
    *("..", "../x", "/dev/zero", "/etc/passwd", "~/x", "a/b", "CON", "&a", "*a", "<<", "!!int x", "!!binary x", "?"),
    *("'", '"', "#", ":", "- ", "|", ">", "---", "</scene>", "<a>", "&amp;", "&x;", "$a", "-", "--", "=", "2020-01-01"),
)
"""What takes the place of a number or a word."""

VALUES: tuple[Any, ...] = (
    *(None, True, False, 0, -1, 1, 3, 2**31, 2**63, -(2**70), 10**400, 0.5, -0.0, 1e9, 1e40, 1e300, 1e-300),
    *(float("nan"), float("inf"), "", "x", "0", "nan", "../x", "/dev/zero", "\x1b[2J", "[/red]", "x" * 9000),
    *([], {}, [None], [[]], [1, 2, 3], [0.0] * 1000, {"x": 1}, {"": {}}, [[[[[[[[[[]]]]]]]]]]),
)
"""What takes the place of a value of JSON or YAML."""

NUMBERS = (np.nan, np.inf, -np.inf, 0.0, -0.0, 1e9, -1e9, 1e30, 3e38, 1e-38, 1e-300, 1e300)
"""What takes the place of a number of an array."""

TYPES = ("<f4", "<f8", "<f2", "<c8", "<c16", "<i4", "<i8", "<u1", "?", "<U3", "S3")


@st.composite
def damaged(draw: Draw, data: bytes) -> bytes:
    """Bytes with one to four of their ranges overwritten, left out, repeated or moved; or their end cut off."""
    for _ in range(draw(st.integers(1, 4))):
        at = draw(st.integers(0, max(0, len(data) - 1)))
        to = min(len(data), at + draw(st.sampled_from((1, 2, 4, 8, 64, 1000))))
        how = draw(st.sampled_from(("overwrite", "flip", "insert", "leave out", "repeat", "cut", "move")))
        part = data[at:to]
        if how == "overwrite":
            byte = draw(st.sampled_from((b"\0", b"\xff", b"\x7f", b"\x80", b" ", b"9", b"[", b"\n")))
            data = data[:at] + byte * len(part) + data[to:]
        elif how == "flip":
            data = data[:at] + bytes([part[0] ^ 1 << draw(st.integers(0, 7))] if part else []) + data[at + 1 :]
        elif how == "insert":
            data = data[:at] + draw(st.binary(min_size=1, max_size=9)) + data[at:]
        elif how == "leave out":
            data = data[:at] + data[to:]
        elif how == "repeat":
            data = data[:at] + part * draw(st.sampled_from((2, 100))) + data[to:]
        elif how == "cut":
            data = data[:at]
        else:
            data = data[:at] + data[to:] + part
    return data


@st.composite
def reworded(draw: Draw, data: bytes) -> bytes:
    """A text with one to three of its numbers, words or lines changed."""
    text = data.decode()
    for _ in range(draw(st.integers(1, 3))):
        if draw(st.integers(0, 3)):
            tokens = [found.span() for found in re.finditer(r"[-+\w.]+|[^\w\s]", text)]
            if tokens:
                first, last = draw(st.sampled_from(tokens))
                text = text[:first] + draw(st.sampled_from(TEXTS)) + text[last:]
        else:
            lines = text.splitlines(keepends=True)
            if lines:
                at = draw(st.integers(0, len(lines) - 1))
                number = draw(st.sampled_from((0, 2, 3, 50)))
                lines[at : at + 1] = [lines[at]] * number
                text = "".join(lines)
    return text.encode(errors="surrogatepass")


def _places(tree: Any, way: tuple = ()) -> list[tuple]:
    """The ways to all nodes of a tree of mappings and lists."""
    inside = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    return [way] * bool(way) + [place for key, node in inside for place in _places(node, (*way, key))]


@st.composite
def _regrown(draw: Draw, tree: Any) -> Any:
    """A tree of mappings and lists with one to three of its nodes replaced, left out, renamed or repeated."""
    tree = deepcopy(tree)
    for _ in range(draw(st.integers(1, 3))):
        places = _places(tree)
        if not places:
            return tree
        *way, key = draw(st.sampled_from(places))
        node = tree
        for each in way:
            node = node[each]
        how = draw(st.sampled_from(("replace", "replace", "replace", "leave out", "rename", "repeat")))
        if how == "replace":
            node[key] = deepcopy(draw(st.sampled_from(VALUES)))
        elif how == "leave out":
            del node[key]
        elif how == "rename" and isinstance(node, dict):
            node[draw(st.sampled_from(("", "x", "\x1b[2J", "x" * 300)))] = node.pop(key)
        elif isinstance(node, list):
            node *= draw(st.sampled_from((2, 100)))
    return tree


def json_of(data: bytes) -> st.SearchStrategy[bytes]:
    """A JSON file with other values."""
    return _regrown(json.loads(data)).map(lambda tree: json.dumps(tree).encode())


def yaml_of(data: bytes) -> st.SearchStrategy[bytes]:
    """A YAML file with other values."""
    return _regrown(yaml.safe_load(data)).map(lambda tree: yaml.safe_dump(tree).encode())


HOWS = ("numbers", "numbers", "scale", "cut", "repeat", "flatten", "type", "leave out", "rename")
"""What happens to an array."""


@st.composite
def _rearranged(draw: Draw, arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Arrays, one or two of which have other numbers, another shape or type; or are missing, or called otherwise."""
    arrays = dict(arrays)
    for _ in range(draw(st.integers(1, 2))):
        if not arrays:
            return arrays
        name = draw(st.sampled_from(sorted(arrays)))
        array = arrays[name]
        how = draw(st.sampled_from(HOWS))
        if how == "numbers" and array.size and array.dtype.kind in "fc":
            array = array.copy()
            value = array.dtype.type(draw(st.sampled_from(NUMBERS)))
            at = draw(st.integers(0, array.size - 1))
            array.reshape(-1)[at : at + draw(st.sampled_from((1, 100, array.size)))] = value
        elif how == "scale" and array.dtype.kind in "fc":
            with np.errstate(all="ignore"):
                array = array * array.dtype.type(draw(st.sampled_from(NUMBERS)))
        elif how == "cut":
            array = array[:-1] if array.ndim else array
        elif how == "repeat":
            array = np.stack([array, array])
        elif how == "flatten":
            array = array.reshape(-1)
        elif how == "type":
            with np.errstate(all="ignore"):
                array = array.real.astype(draw(st.sampled_from(TYPES)))
        elif how == "leave out":
            del arrays[name]
            continue
        elif how == "rename":
            arrays[draw(st.sampled_from(("", "x", "../x", "x" * 300)))] = arrays.pop(name)
            continue
        arrays[name] = array
    return arrays


def npz_of(data: bytes) -> st.SearchStrategy[bytes]:
    """An archive of other arrays."""

    def written(arrays: dict[str, np.ndarray]) -> bytes:
        buffer = io.BytesIO()
        np.savez(buffer, **arrays)  # type: ignore[arg-type]
        return buffer.getvalue()

    return _rearranged(dict(np.load(io.BytesIO(data)))).map(written)


def npy_of(data: bytes) -> st.SearchStrategy[bytes]:
    """A file of another array; an empty one if the array is left out."""

    def written(arrays: dict[str, np.ndarray]) -> bytes:
        buffer = io.BytesIO()
        for array in arrays.values():
            np.save(buffer, array)
        return buffer.getvalue()

    return _rearranged({"array": np.load(io.BytesIO(data))}).map(written)


def mat_of(data: bytes) -> st.SearchStrategy[bytes]:
    """A MATLAB file of other arrays."""
    content = scipy.io.loadmat(io.BytesIO(data))

    def written(arrays: dict[str, np.ndarray]) -> bytes:
        buffer = io.BytesIO()
        scipy.io.savemat(buffer, {name[:31] or "_": array for name, array in arrays.items()})
        return buffer.getvalue()

    return _rearranged({name: each for name, each in content.items() if not name.startswith("__")}).map(written)


def h5_of(data: bytes) -> st.SearchStrategy[bytes]:
    """An HDF5 file of other arrays."""
    with h5py.File(io.BytesIO(data), "r") as file:
        content = {name: each[()] for name, each in file.items()}

    def written(arrays: dict[str, np.ndarray]) -> bytes:
        buffer = io.BytesIO()
        with h5py.File(buffer, "w") as file:
            for name, array in arrays.items():
                if array.dtype.kind != "U":  # of which HDF5 has none
                    file[name or "_"] = array
        return buffer.getvalue()

    return _rearranged(content).map(written)


OF_SAFETENSORS = ("bool", "int8", "uint8", "int32", "int64", "float16", "float32", "float64", "complex64")
"""Types of tensors that a file of the format can have, and NumPy too."""


def safetensors_of(data: bytes) -> st.SearchStrategy[bytes]:
    """A file of other tensors."""

    def written(arrays: dict[str, np.ndarray]) -> bytes:
        kept = {name: array for name, array in arrays.items() if array.dtype.name in OF_SAFETENSORS}
        return save({name: np.ascontiguousarray(array) for name, array in kept.items()})

    return _rearranged(load(data)).map(written)
