"""The floor plan of a scene: the view from above without the ceiling, and a section at the transmitter's height."""

from __future__ import annotations

from collections.abc import Container, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Bool, Float
from trimesh import Trimesh
from trimesh.grouping import group_rows
from trimesh.intersections import mesh_plane

from scenes.checks.enclosure import UNDER_CEILING, ceiling_height, cut, enclosing, opened_ceiling
from scenes.drawing.doors import Leaf, closed_doors
from scenes.scene.connected_parts import parts_of
from scenes.scene.description import Scene, SceneObject

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.path import Path

REGION = (0.1, 0.6, 0.2, 0.2)  # RGBA
NUMBERED = 50  # most objects that are numbered; more numbers would hide the plan
INK = (0.2, 0.2, 0.2)
DOOR = "closed door, drawn open"
CREASE = np.radians(20)  # angle between two triangles from which their edge is drawn


def section_height(scene: Scene) -> float:
    """Return the height of the plan's section, metres: the middle of the transmitter region."""
    return float(scene.transmitter.region[:, 2].mean())


def draw_plan(axes: Axes, scene: Scene, numbered: bool = True) -> tuple[list[str], str]:
    from matplotlib.collections import LineCollection
    from matplotlib.patches import PathPatch, Rectangle

    low, high = scene.bounds
    size = float(np.max(high - low))
    many = len(scene.objects) > NUMBERED
    ceiling = ceiling_height(scene, np.concatenate([item.mesh.triangles for item in scene.objects]))
    antennas = np.vstack([scene.transmitter.region.mean(axis=0), scene.gateway.position])[:, :2]
    height = section_height(scene)
    sections = [section(item.mesh, height) for item in scene.objects]
    doors = closed_doors([item.name for item in scene.objects], sections, away=antennas[1])
    _draw_from_above(axes, scene, ceiling, doors, line=0.3 if many else 0.6)
    _draw_doors(axes, scene, doors)

    lines: list[np.ndarray] = []
    colors: list[list[float]] = []
    for index, item in enumerate(scene.objects):
        color = scene.materials[item.material].color
        found = sections[index]
        if index in doors:
            found = np.delete(found, np.concatenate([leaf.lines for leaf in doors[index]]), axis=0)
        lines += list(found)
        colors += [_darker(color)] * len(found)
        # Below a ceiling, closed parts are filled, except the one around the antennas, which is the room itself.
        for solid in solids(item, height) if ceiling < np.inf and index not in doors else []:
            if not solid.contains_points(antennas).any():
                axes.add_patch(PathPatch(solid, facecolor=color, edgecolor="none", zorder=2))
    axes.add_collection(LineCollection(lines, colors=colors, linewidths=0.7 if many else 1.6, zorder=3))

    names: list[str] = []
    taken: list[np.ndarray] = []
    for item in scene.objects:
        room = (item.mesh.extents[:2] > 0.9 * (high - low)[:2]).all()
        shell = bool(enclosing(scene, item, item.mesh.triangles).all())
        if not numbered or many or room or shell or item.mesh.bounds[0, 2] > ceiling:
            continue
        names.append(item.name)
        taken.append(_label_place(item, taken, apart=0.022 * size))
        box = {"boxstyle": "circle,pad=0.15", "fc": "white", "ec": "none", "alpha": 0.75}
        x, y = taken[-1]
        axes.text(x, y, str(len(names)), ha="center", va="center", fontsize=7, zorder=5, bbox=box)

    corners = scene.transmitter.corners()[:, :2]
    axes.add_patch(Rectangle(corners[0], *np.ptp(corners, axis=0), fc=REGION, ec="green", lw=1.5, zorder=4))
    arrow = {"color": "crimson", "lw": 2, "arrowstyle": "-|>"}
    for gateway in (scene.gateway, *scene.further_gateways.values()):
        x, y, _ = gateway.position
        dx, dy, _ = 0.12 * size * gateway.boresight
        axes.plot(x, y, "s", color="crimson", markersize=8, zorder=6)
        axes.annotate("", (x + dx, y + dy), (x, y), arrowprops=arrow, zorder=6)
    axes.autoscale_view()
    axes.set(aspect="equal", xlabel="x [m]", ylabel="y [m]")
    return names, _caption(scene, ceiling)


def _caption(scene: Scene, ceiling: float) -> str:
    height = section_height(scene)
    cut_off = f", cut off at z = {ceiling - UNDER_CEILING:.2f} m" if ceiling < np.inf else ""
    if any(item.mesh.bounds[0, 2] < height < item.mesh.bounds[1, 2] for item in scene.objects):
        return f"seen from above{cut_off}; section at z = {height:.2f} m"
    return f"seen from above{cut_off}; nothing at z = {height:.2f} m, the height of the region"


def _draw_doors(axes: Axes, scene: Scene, doors: dict[int, list[Leaf]]) -> None:
    """Draw each leaf as a line that is turned open, with the arc of its swing."""
    from matplotlib.collections import LineCollection

    opened, arcs, colors = [], [], []
    for index, leaves in doors.items():
        opened += [np.stack([leaf.hinge, leaf.opened]) for leaf in leaves]
        arcs += [leaf.swing() for leaf in leaves]
        colors += [_darker(scene.materials[scene.objects[index].material].color)] * len(leaves)
    if opened:
        axes.add_collection(LineCollection(opened, colors=colors, linewidths=1.6, zorder=3, label=DOOR))
        axes.add_collection(LineCollection(arcs, colors=colors, linewidths=0.6, zorder=3))


def _darker(color: Sequence[float]) -> list[float]:
    return [0.6 * component for component in color]


def _draw_from_above(axes: Axes, scene: Scene, ceiling: float, doors: Container[int], line: float) -> None:
    """Draw triangles in the colours of their materials, with outlines, from the lowest to the highest."""
    from matplotlib.collections import PolyCollection

    shapes, colors, outlined = [np.zeros((0, 3, 3))], [np.zeros((0, 3))], [np.zeros(0, bool)]
    height = section_height(scene)
    for index, item in enumerate(scene.objects):
        if index in doors:
            continue
        # In a room, a section shows what it cuts; what this has above it, such as lintels, would close the doorways.
        above = _above_a_section(item.mesh, height) if ceiling < np.inf else np.zeros(len(item.mesh.faces), bool)
        triangles = cut(item.mesh.triangles[~above], opened_ceiling(ceiling))
        if above.any():
            lower = cut(item.mesh.triangles[above], [(np.array([0, 0, height]), np.array([0.0, 0.0, -1.0]))])
            triangles = np.concatenate([triangles, lower])
        outlines = _outlines(item.mesh, above, height)
        outlines = outlines[outlines[:, :, 2].max(axis=1) < ceiling - UNDER_CEILING]
        for parts, color in ((triangles, scene.materials[item.material].color), (outlines, INK)):
            shapes.append(parts[:, [0, 1, -1]])  # an outline as a triangle, since shapes of one size are drawn faster
            colors.append(np.tile(color, (len(parts), 1)))
            outlined.append(np.full(len(parts), parts is outlines))
    drawn, ink, lines = (np.concatenate(each) for each in (shapes, colors, outlined))
    order = np.argsort(drawn[:, :, 2].max(axis=1) + 1e-6 * lines, kind="stable")
    shapes_in_order: Any = drawn[order, :, :2]
    style: dict[str, Any] = {
        "facecolors": ink[order],
        "edgecolors": ink[order],
        "linewidths": np.where(lines, line, 1.5)[order],
    }
    axes.add_collection(PolyCollection(shapes_in_order, **style, zorder=1))


def _above_a_section(mesh: Trimesh, height: float) -> Bool[np.ndarray, " faces"]:
    """Whether a face is hidden above a section: it is of a part that is cut, and upright or of a closed part."""
    if not mesh.bounds[0, 2] < height < mesh.bounds[1, 2]:
        return np.zeros(len(mesh.faces), bool)
    part, closed, _ = parts_of(mesh)
    upright = np.abs(mesh.face_normals[:, 2]) < 0.02
    low, high = np.full(part.max() + 1, np.inf), np.full(part.max() + 1, -np.inf)
    np.minimum.at(low, part, mesh.triangles[:, :, 2].min(axis=1))
    np.maximum.at(high, part, mesh.triangles[:, :, 2].max(axis=1))
    return ((low < height) & (height < high))[part] & (upright | closed[part])


def _outlines(mesh: Trimesh, above: Bool[np.ndarray, " faces"], height: float) -> Float[np.ndarray, "n 2 3"]:
    """Return the edges that are seen from above: where a surface ends or bends, and is not hidden above a height."""
    upright = np.abs(mesh.face_normals[:, 2]) < 0.02
    bent = (mesh.face_adjacency_angles > CREASE) & ~upright[mesh.face_adjacency].all(axis=1)
    alone = group_rows(mesh.edges_sorted, require_count=1)
    alone = alone[~upright[mesh.edges_face[alone]]]
    edges = np.concatenate([mesh.face_adjacency_edges[bent], mesh.edges_sorted[alone]])
    hidden = np.concatenate([above[mesh.face_adjacency[bent]].all(axis=1), above[mesh.edges_face[alone]]])
    found = mesh.vertices[edges]
    return found[~hidden | (found[:, :, 2].max(axis=1) <= height)]


def section(mesh: Trimesh, height: float) -> Float[np.ndarray, "n 2 2"]:
    """Return the lines in which a horizontal plane cuts a mesh, by their two ends (x, y), metres."""
    low, high = mesh.bounds[:, 2]
    if not low < height < high:
        return np.zeros((0, 2, 2))
    return mesh_plane(mesh, plane_normal=(0, 0, 1), plane_origin=(0, 0, height))[:, :, :2]


def solids(item: SceneObject, height: float) -> list[Path]:
    """Return the area of each closed part of an object in a horizontal plane, without its holes, metres."""
    areas = []
    for part in item.closed_parts:  # one by one: lines of parts that touch would be joined in the wrong order
        low, high = part.bounds[:, 2]
        cut_part = part.section(plane_normal=(0, 0, 1), plane_origin=(0, 0, height)) if low < height < high else None
        if cut_part is not None:
            areas.append(_area([line[:, :2] for line in cut_part.discrete]))
    return areas


def _area(loops: list[Float[np.ndarray, "n 2"]]) -> Path:
    """Return the area that closed lines bound. Lines inside others bound holes."""
    from matplotlib.path import Path

    paths = []
    for loop in loops:
        around = sum(other is not loop and bool(Path(other).contains_points(loop).all()) for other in loops)
        x, y = loop.T
        left_turning = np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]) > 0
        # In matplotlib, a hole turns in the opposite direction to the line around it.
        paths.append(Path(loop if left_turning == (around % 2 == 0) else loop[::-1], closed=True))
    return Path.make_compound_path(*paths)


def _label_place(item: SceneObject, taken: list[np.ndarray], apart: float) -> np.ndarray:
    """Find a place for a label: the centre of the object, or another point ``apart`` metres from earlier labels."""
    low, high = item.mesh.bounds[:, :2]
    for s, t in ((0.5, 0.5), (0.15, 0.15), (0.85, 0.85), (0.15, 0.85), (0.85, 0.15)):
        place = low + (high - low) * [s, t]
        if all(np.linalg.norm(place - other) > apart for other in taken):
            return place
    return (low + high) / 2
