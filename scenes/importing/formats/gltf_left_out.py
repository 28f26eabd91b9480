"""Say what of a glTF file is not read."""

from __future__ import annotations

from collections.abc import Container, Iterator

from scenes.files.errors import named
from scenes.importing.formats.gltf_header import (
    COMPRESSION,
    IRRELEVANT,
    OBEYED,
    POINTS_AND_LINES,
    Header,
    Node,
    Primitive,
    node_name,
)

LISTED = 5
"""Most names in a sentence."""


def has_triangles(part: Primitive) -> bool:
    """Whether a primitive is not of points or lines."""
    return part.mode not in POINTS_AND_LINES and "POSITION" in part.attributes


def left_out(header: Header, places: Container[int]) -> Iterator[str]:
    """Yield a sentence for each kind of thing that is not read."""
    without, elsewhere, unknown = [], [], dict[str, str]()
    parents = {child: index for index, node in enumerate(header.nodes) if index in places for child in node.children}
    for index, node in enumerate(header.nodes):
        if node.mesh is None:
            continue
        name = node_name(header, index)
        if index not in places:
            elsewhere.append(name)
            continue
        if not all(map(has_triangles, header.meshes[node.mesh].primitives)):
            without.append(name)
        above = [header.nodes[each] for each in _ancestors(parents, index)]
        unknown |= {extension: name for each in (node, *above) for extension in _extensions(header, each)}
    used = {node.mesh for node in header.nodes}
    unused = [mesh.name or f"mesh_{index}" for index, mesh in enumerate(header.meshes) if index not in used]
    if without:
        yield f"points and lines were left out, in {_list(without)}"
    if elsewhere:
        yield f"nodes outside the scene that the file shows were left out: {_list(elsewhere)}"
    if unused:
        yield f"meshes that no node shows were left out: {_list(unused)}"
    for extension, name in unknown.items():
        yield f"the extension {named(extension)} is unknown and was not applied, for example to {named(name)}"
    if header.animations:
        yield f"animations were left out: {len(header.animations)} in the file; the pose at rest was read"


def _ancestors(parents: dict[int, int], index: int) -> Iterator[int]:
    """Yield the numbers of the nodes above a node."""
    while index in parents:
        index = parents[index]
        yield index


def _extensions(header: Header, node: Node) -> Iterator[str]:
    """Yield the extensions of a node and its mesh, if it has one, that might change its triangles."""
    places = [node.extensions]
    if node.mesh is not None:
        mesh = header.meshes[node.mesh]
        places += [mesh.extensions, *(part.extensions for part in mesh.primitives)]
    for extensions in places:
        for name in extensions:
            if name not in (*OBEYED, *COMPRESSION) and not name.startswith(IRRELEVANT):
                yield name


def _list(names: list[str]) -> str:
    more = f" and {len(names) - LISTED} more" if len(names) > LISTED else ""
    return ", ".join(named(name) for name in names[:LISTED]) + more
