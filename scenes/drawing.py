"""A drawing of a scene, and its description as plain data, by which the user can check it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial.transform import Rotation
from trimesh import Trimesh

from scenes.description import Gateway, Scene, SceneObject
from scenes.occupancy import closed_parts
from scenes.shapes import bounding_box

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from mpl_toolkits.mplot3d.axes3d import Axes3D

LIGHT = np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8])
VIEW = {"elev": 38.0, "azim": -125.0}  # degrees, matplotlib's: from low x and low y
REGION = (0.1, 0.6, 0.2, 0.2)  # RGBA
NUMBERED = 50  # objects; more numbers would hide the plan


def describe_scene(scene: Scene) -> dict[str, Any]:
    """A scene as data that ``json.dumps`` takes: lengths in metres, frequency in hertz."""
    transmitter = scene.transmitter
    return {
        "name": scene.name,
        "frequency": scene.frequency,
        "wavelength": scene.wavelength,
        "bounds": {"min": _rounded(scene.bounds[0]), "max": _rounded(scene.bounds[1])},
        "gateway": _describe_gateway(scene.gateway),
        "further_gateways": {name: _describe_gateway(gateway) for name, gateway in scene.further_gateways.items()},
        "transmitter": {
            "region": {"min": list(transmitter.region_min), "max": list(transmitter.region_max)},
            "pattern": transmitter.pattern,
            "polarization": transmitter.polarization,
            "orientation": list(transmitter.orientation),
        },
        "objects": [
            {
                "name": item.name,
                "material": item.material,
                "size": _rounded(item.mesh.extents),
                "triangles": len(item.mesh.faces),
                "closed": _is_closed(item.mesh),
            }
            for item in scene.objects
        ],
        "materials": [
            {
                "name": material.name,
                "relative_permittivity": material.relative_permittivity,
                "conductivity": material.conductivity,
                "thickness": material.thickness,
            }
            for material in scene.materials.values()
        ],
    }


def _describe_gateway(gateway: Gateway) -> dict[str, Any]:
    return {
        "position": list(gateway.position),
        "orientation": list(gateway.orientation),
        "boresight": _rounded(gateway.boresight),
        "rows": gateway.rows,
        "columns": gateway.columns,
        "spacing": gateway.spacing,
        "pattern": gateway.pattern,
        "polarization": gateway.polarization,
    }


def _rounded(vector: Float[np.ndarray, " 3"]) -> list[float]:
    return [round(float(c), 4) + 0.0 for c in vector]  # + 0.0 turns -0.0 into 0.0


def _is_closed(mesh: Trimesh) -> bool:
    """Whether every triangle belongs to a part that bounds a volume."""
    return sum(len(part.faces) for part in closed_parts(mesh)) == len(mesh.faces)


def draw_scene(scene: Scene, path: str | Path) -> None:
    """Write a PNG of the plan and of a view from above, objects in their materials' colours.

    Triangles within the top tenth of the height are left out, and so is the side of the room that faces the viewer,
    so that the inside is visible.

    Args:
        scene: the scene.
        path: the PNG file.
    """
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    figure = Figure(figsize=(15, 7.2), dpi=110, layout="constrained")
    grid = figure.add_gridspec(1, 2, width_ratios=(1, 1.05))
    left, right = figure.add_subfigure(grid[0]), figure.add_subfigure(grid[1])
    plan = left.add_subplot()
    names = _draw_plan(plan, scene)
    _draw_view(right.add_subplot(projection="3d"), scene)
    plan.set_title(
        f"{scene.name}: {scene.frequency / 1e6:g} MHz, λ = {scene.wavelength * 100:.1f} cm, "
        f"{scene.gateway.rows} × {scene.gateway.columns} array, {len(scene.objects)} objects"
    )
    if names:
        key = [Patch(alpha=0, label=f"{number} {name}") for number, name in enumerate(names, start=1)]
        style: dict[str, Any] = {"ncols": 4, "frameon": False, "fontsize": 9}
        left.legend(handles=key, loc="outside lower center", handlelength=0, handletextpad=0, **style)
    handles = [Patch(facecolor=m.color, edgecolor="0.3", label=name) for name, m in scene.materials.items()]
    handles.append(Patch(facecolor=REGION, edgecolor="green", label="transmitter region"))
    handles.append(Patch(facecolor="crimson", label="gateway and boresight"))
    right.legend(handles=handles, loc="outside upper center", ncols=4, frameon=False, fontsize=9)
    figure.savefig(Path(path), format="png")


def _visible(scene: Scene, item: SceneObject) -> Bool[np.ndarray, " triangles"]:
    """Triangles below the ceiling."""
    low, high = scene.bounds[:, 2]
    return item.mesh.triangles[:, :, 2].min(axis=1) <= high - 0.1 * (high - low)


def enclosing(scene: Scene, item: SceneObject, triangles: Float[np.ndarray, "n 3 3"]) -> Bool[np.ndarray, " n"]:
    """Triangles that enclose the place: floor and walls, drawn behind the furniture."""
    low, high = scene.bounds
    box = item.mesh.bounds
    wide = np.ptp(box, axis=0) > 0.5 * (high - low)
    against = np.minimum(box[1] - low, high - box[0]) < 0.25  # m; a thick wall or slab at the edge
    if any(against[axis] and np.delete(wide, axis).all() for axis in range(3)):
        return np.ones(len(triangles), dtype=bool)
    flush = (triangles.max(axis=1) < low + 0.06) | (triangles.min(axis=1) > high - 0.06)  # panes, doors
    return flush[:, 2] | (flush[:, :2].any(axis=1) & wide[2])


def _label_place(item: SceneObject, taken: list[np.ndarray], apart: float) -> np.ndarray:
    """The centre of the object in plan, or a point of it that is ``apart`` metres from the labels so far."""
    low, high = item.mesh.bounds[:, :2]
    for s, t in ((0.5, 0.5), (0.15, 0.15), (0.85, 0.85), (0.15, 0.85), (0.85, 0.15)):
        place = low + (high - low) * [s, t]
        if all(np.linalg.norm(place - other) > apart for other in taken):
            return place
    return (low + high) / 2


def _draw_plan(axes: Axes, scene: Scene) -> list[str]:
    """Seen from above, higher objects over lower ones; returns the names of the numbered objects."""
    from matplotlib.collections import PolyCollection
    from matplotlib.patches import Rectangle

    low, high = scene.bounds
    size = float(np.max(high - low))
    names: list[str] = []
    taken: list[np.ndarray] = []
    for item in scene.objects:
        keep = _visible(scene, item)
        if not keep.any():
            continue
        triangles = item.mesh.triangles[keep]
        color = scene.materials[item.material].color
        shell = bool(enclosing(scene, item, triangles).all())
        top = 1.0 if shell else 2 + (triangles[:, :, 2].max() - low[2]) / size
        flat = PolyCollection(
            list(triangles[:, :, :2]), facecolors=[color], edgecolors=[color], linewidths=1.5, zorder=top
        )
        axes.add_collection(flat)
        if len(scene.objects) <= NUMBERED and not shell:
            corner, extent = item.mesh.bounds[0, :2], item.mesh.extents[:2]
            axes.add_patch(Rectangle(corner, *extent, fill=False, ec="0.25", lw=0.6, zorder=top))
            names.append(item.name)
            taken.append(_label_place(item, taken, apart=0.022 * size))
            style = {"boxstyle": "circle,pad=0.15", "fc": "white", "ec": "none", "alpha": 0.75}
            x, y = taken[-1]
            axes.text(x, y, str(len(names)), ha="center", va="center", fontsize=7, zorder=5, bbox=style)

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
    return names


def _draw_view(axes: Axes3D, scene: Scene) -> None:
    from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

    axes.computed_zorder = False  # walls first, then the furniture, then the antennas
    axes.view_init(**VIEW)
    viewer = Rotation.from_euler("ZY", [VIEW["azim"], -VIEW["elev"]], degrees=True).apply([1, 0, 0])
    low, high = scene.bounds
    layers: dict[bool, list[tuple[np.ndarray, np.ndarray]]] = {True: [], False: []}
    for item in scene.objects:
        keep = _visible(scene, item)
        triangles, normals = item.mesh.triangles[keep], item.mesh.face_normals[keep]
        shell = enclosing(scene, item, triangles)
        upright = np.abs(normals[:, 2]) < 0.5
        # The viewer stands at low x and low y, outside the walls there.
        hidden = shell & upright & (triangles.max(axis=1) < low + 0.25)[:, :2].any(axis=1)
        # Sorting by depth fails between the front and the back of one solid: leave out the backs.
        outwards = np.sign(item.mesh.volume) if item.mesh.is_watertight else 0
        back = ~shell & (outwards * (normals @ viewer) < 0)
        shade = 0.65 + 0.35 * np.abs(normals @ LIGHT)
        colors = np.clip(np.outer(shade, scene.materials[item.material].color), 0, 1)
        for is_shell, layer in layers.items():
            chosen = (shell == is_shell) & ~hidden & ~back
            layer.append((triangles[chosen], colors[chosen]))
    for is_shell, layer in layers.items():
        triangles, colors = (np.concatenate(parts) for parts in zip(*layer, strict=True))
        if len(triangles):
            style = {"facecolors": colors, "edgecolors": colors, "linewidths": 0.3}
            axes.add_collection3d(Poly3DCollection(list(triangles), zorder=1 if is_shell else 2, **style))

    corners = scene.transmitter.corners()
    edges = [(a, b) for i, a in enumerate(corners) for b in corners[i + 1 :] if np.sum(a != b) == 1]
    axes.add_collection3d(Line3DCollection(edges, colors="green", linewidths=1.4, zorder=3))
    gateways = (scene.gateway, *scene.further_gateways.values())
    for gateway in gateways:
        boresight = 0.12 * np.max(high - low) * gateway.boresight
        axes.scatter(*gateway.position, color="crimson", marker="s", s=40, zorder=4)
        axes.quiver(*gateway.position, *boresight, color="crimson", linewidth=2, zorder=4)
    # Outdoors the antennas may be above all objects.
    low, high = bounding_box(np.vstack([scene.bounds, corners, *(gateway.position for gateway in gateways)]))
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_xlabel("x [m]", labelpad=8)
    axes.set_ylabel("y [m]", labelpad=8)
    axes.set_zlabel("z [m]", labelpad=-2)
    axes.set_box_aspect(high - low, zoom=1.05)
