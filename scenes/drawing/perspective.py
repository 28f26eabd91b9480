"""The perspective view of a scene. Surfaces hide what is behind them, and a room is open towards the viewer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import trimesh
from jaxtyping import Bool, Float, Int
from scipy.spatial.transform import Rotation

from scenes.checks.enclosure import UNDER_CEILING, Plane, barycentric, ceiling_height, cut, opened_ceiling, opened_walls
from scenes.drawing.floor_plan import REGION
from scenes.scene.antennas import Gateway
from scenes.scene.description import Scene
from scenes.scene.shapes import bounding_box

if TYPE_CHECKING:
    from mpl_toolkits.mplot3d.axes3d import Axes3D

LIGHT = np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8])
VIEW = {"elev": 38.0, "azim": -125.0}  # matplotlib's angles, degrees: the viewer is at low x and low y
COLUMNS = 1600  # width of the picture, pixels: twice that of the figure
MOST_ROWS = 4000  # height of the picture, pixels; that of a tall, narrow scene has fewer columns
SAMPLES = 400  # points along a line that are tested for visibility
CROP = 0.5  # if the neighbourhood of the antennas is smaller than this share of the scene, only it is drawn

PAIRS = 1_000_000
"""Most pairs of a triangle and a pixel that are processed together. This limits the memory."""


@dataclass(frozen=True)
class DepthBuffer:
    extent: tuple[float, float, float, float]  # left, right, bottom and top edge, in the units of the triangles
    depth: Float[np.ndarray, "rows columns"]  # of the nearest triangle, infinite if there is none; row 0 at the bottom
    nearest: Int[np.ndarray, "rows columns"]  # index of the nearest triangle, −1 if there is none

    def shows(self, points: Float[np.ndarray, "n 3"], tolerance: float) -> Bool[np.ndarray, " n"]:
        """Whether each point is visible: no triangle is in front of it."""
        left, right, bottom, top = self.extent
        rows, columns = self.depth.shape
        column = ((points[:, 0] - left) / (right - left) * columns).astype(int).clip(0, columns - 1)
        row = ((points[:, 1] - bottom) / (top - bottom) * rows).astype(int).clip(0, rows - 1)
        return points[:, 2] <= self.depth[row, column] + tolerance


def draw_view(axes: Axes3D, scene: Scene) -> list[str]:
    """Draw a scene as seen from low x and low y. Hidden parts of the transmitter region and gateways are dashed."""
    from matplotlib.image import AxesImage

    gateways = (scene.gateway, *scene.further_gateways.values())
    antennas = np.vstack([scene.transmitter.corners(), *(gateway.position for gateway in gateways)])
    triangles, colors, left_out = _surfaces(scene, antennas)
    shown = np.vstack([triangles.reshape(-1, 3), antennas])  # outdoors the antennas may be above all objects
    low, high = bounding_box(shown)
    _set_up(axes, low, high)

    screen = _project(axes, triangles)
    left, bottom = _project(axes, shown)[:, :2].min(axis=0)
    right, top = _project(axes, shown)[:, :2].max(axis=0)
    columns = max(1, min(COLUMNS, round(MOST_ROWS * (right - left) / (top - bottom)))) if top > bottom else COLUMNS
    buffer = depth_buffer(screen, (left, right, bottom, top), columns)
    tolerance = 2e-3 * float(np.ptp(screen[:, :, 2]))
    picture = np.zeros((*buffer.depth.shape, 4))
    filled = buffer.nearest >= 0
    picture[filled] = np.column_stack([colors, np.ones(len(colors))])[buffer.nearest[filled]]
    picture[_outlines(buffer, tolerance), :3] *= 0.6
    region = trimesh.creation.box(bounds=scene.transmitter.region).triangles
    before = depth_buffer(_project(axes, region), buffer.extent, columns)
    tint = np.zeros_like(picture)
    tint[np.isfinite(before.depth) & (before.depth <= buffer.depth + tolerance)] = REGION
    for pixels in (picture, tint):
        image = AxesImage(axes, extent=buffer.extent, origin="lower", interpolation="antialiased", zorder=1)
        image.set_data(pixels)
        axes.add_image(image)
    for edge in box_edges(scene.transmitter.region):
        _draw_line(axes, buffer, edge, tolerance)
    for gateway in gateways:
        _draw_gateway(axes, buffer, gateway, 0.12 * float(np.max(high - low)), tolerance)
    return left_out


def box_edges(box: Float[np.ndarray, "2 3"]) -> Float[np.ndarray, "n 2 3"]:
    """Return the edges of a box by their two ends; of a box that is a point, a line of length 0."""
    corners = np.stack(np.meshgrid(*np.transpose(box), indexing="ij"), axis=-1).reshape(8, 3)
    ends = [(a, b) for i, a in enumerate(corners) for b in corners[i + 1 :] if np.sum(a != b) == 1]
    return np.array(ends or [(corners[0], corners[0])], np.float32)


def _surfaces(
    scene: Scene, antennas: Float[np.ndarray, "n 3"]
) -> tuple[Float[np.ndarray, "n 3 3"], Float[np.ndarray, "n 3"], list[str]]:
    """Return the triangles to draw, metres, their shaded colours (RGB), and what is left out."""
    everything = np.concatenate([item.mesh.triangles for item in scene.objects])
    ceiling = ceiling_height(scene, everything)
    viewer = Rotation.from_euler("ZY", [VIEW["azim"], -VIEW["elev"]], degrees=True).apply([1, 0, 0])
    walls = opened_walls(scene, everything, viewer, roofed=ceiling < np.inf)
    reach = _reach(scene, antennas, everything)
    left_out = []
    if ceiling < np.inf:
        left_out.append(f"everything above z = {ceiling - UNDER_CEILING:.2f} m")
    if walls:
        left_out.append("1 wall in front" if len(walls) == 1 else f"{len(walls)} walls in front")
    if reach < np.inf:
        left_out.append(f"what is beyond {reach:.0f} m from the antennas")
    planes = opened_ceiling(ceiling) + walls + _square_around(antennas, reach)
    parts = [cut(item.mesh.triangles, planes) for item in scene.objects]
    if not any(len(part) for part in parts):  # an empty drawing would show less than one that hides something
        parts, left_out = [np.asarray(item.mesh.triangles) for item in scene.objects], []
    colors = [scene.materials[item.material].color for item in scene.objects]
    triangles = np.concatenate(parts)
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True).clip(1e-30)
    shade = 0.65 + 0.35 * np.abs(normals @ LIGHT)
    shaded = np.clip(shade[:, None] * np.repeat(colors, [len(part) for part in parts], axis=0), 0, 1)
    return triangles, shaded, left_out


def _reach(scene: Scene, antennas: Float[np.ndarray, "n 3"], triangles: Float[np.ndarray, "n 3 3"]) -> float:
    """Return how far along x and y from the middle of the antennas to draw, metres; infinite for a small scene."""
    low, high = bounding_box(antennas[:, :2])
    middle = (low + high) / 2
    across = np.maximum(triangles[:, :, :2].min(axis=1) - middle, middle - triangles[:, :, :2].max(axis=1))
    nearest = float(across.max(axis=1).min())
    reach = max(1.5 * float(np.max(high - low)), 1.5 * nearest)
    return reach if 2 * reach <= CROP * np.ptp(scene.bounds, axis=0)[:2].max() else np.inf


def _square_around(antennas: Float[np.ndarray, "n 3"], reach: float) -> list[Plane]:
    """Return the sides of an upright square around the antennas, none for an infinite reach."""
    if reach == np.inf:
        return []
    middle = np.array([*bounding_box(antennas[:, :2]).mean(axis=0), 0.0])
    return [(middle + reach * side, -side) for side in np.vstack([np.eye(3)[:2], -np.eye(3)[:2]])]


def _set_up(axes: Axes3D, low: Float[np.ndarray, " 3"], high: Float[np.ndarray, " 3"]) -> None:
    from matplotlib.ticker import MaxNLocator

    axes.computed_zorder = False
    axes.view_init(**VIEW)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(high - low, zoom=0.97)
    extents = high - low
    for axis, extent in zip((axes.xaxis, axes.yaxis, axes.zaxis), extents, strict=True):
        # No more ticks than fit: a town is a hundred times as wide as it is high.
        axis.set_major_locator(MaxNLocator(int(np.clip(14 * extent / extents.max(), 1, 8)), steps=[1, 2, 5, 10]))
    axes.set_xlabel("x [m]", labelpad=8)
    axes.set_ylabel("y [m]", labelpad=8)
    axes.zaxis.set_rotate_label(False)
    axes.set_zlabel("z [m]", labelpad=7, rotation=90)


def _project(axes: Axes3D, points: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
    """Project points into the picture: across, up, and depth, which grows with the distance from the viewer."""
    from mpl_toolkits.mplot3d.proj3d import proj_transform

    return np.stack(proj_transform(*points.reshape(-1, 3).T, axes.get_proj()), axis=1).reshape(points.shape)


def _outlines(buffer: DepthBuffer, step: float) -> Bool[np.ndarray, "rows columns"]:
    """Find the pixels where the depth jumps. On a plane, the depth is linear and its second difference is zero."""
    seen = np.isfinite(buffer.depth)
    depth = np.where(seen, buffer.depth, buffer.depth[seen].max(initial=0) + 2 * step)
    jumps = np.zeros_like(seen)
    jumps[1:-1] |= np.abs(np.diff(depth, 2, axis=0)) > step
    jumps[:, 1:-1] |= np.abs(np.diff(depth, 2, axis=1)) > step
    return jumps & seen


def _draw_line(axes: Axes3D, buffer: DepthBuffer, ends: Float[np.ndarray, "2 3"], tolerance: float) -> None:
    """Draw an edge of the region, with hidden parts dashed."""
    points = _project(axes, ends[0] + np.linspace(0, 1, SAMPLES)[:, None] * (ends[1] - ends[0]))
    visible = buffer.shows(points, tolerance)
    changes = np.flatnonzero(np.diff(visible)) + 1
    for run in np.split(np.arange(SAMPLES), changes):
        style = {"lw": 1.6} if visible[run[0]] else {"lw": 1.0, "ls": (0, (3, 2)), "alpha": 0.8}
        to = run[-1] + 2  # up to the first point of the next run, to leave no gap
        _flat_line(axes, points[run[0] : to], color="green", zorder=3, **style)


def _flat_line(axes: Axes3D, points: Float[np.ndarray, "n 3"], **style) -> None:
    from matplotlib.lines import Line2D

    axes.add_artist(Line2D(points[:, 0], points[:, 1], **style))


def _draw_gateway(axes: Axes3D, buffer: DepthBuffer, gateway: Gateway, length: float, tolerance: float) -> None:
    """Draw a gateway and its boresight, hollow and dotted if something hides the gateway."""
    place = np.array(gateway.position)
    ends = _project(axes, np.array([place, place + length * gateway.boresight]))
    visible = bool(buffer.shows(ends[:1], tolerance)[0])
    _flat_line(axes, ends[:1], marker="s", ms=6.5, color="crimson", mfc="crimson" if visible else "none", zorder=4)
    arrow = {"color": "crimson", "lw": 2, "arrowstyle": "-|>", "ls": "-" if visible else ":"}
    axes.annotate("", ends[1, :2], ends[0, :2], arrowprops=arrow, zorder=4)


def depth_buffer(
    triangles: Float[np.ndarray, "n 3 3"], extent: tuple[float, float, float, float], columns: int
) -> DepthBuffer:
    left, right, bottom, top = extent
    pixel = (right - left) / columns
    rows = max(1, round((top - bottom) / pixel))
    depth, nearest = np.full(rows * columns, np.inf), np.full(rows * columns, -1)
    corners = (triangles[:, :, :2] - [left, bottom]) / pixel - 0.5  # pixels, with whole numbers at their centres
    first = np.ceil(corners.min(axis=1)).clip(0).astype(int)
    last = np.floor(corners.max(axis=1)).clip(-1, [columns - 1, rows - 1]).astype(int)
    wide, high = (last - first + 1).clip(0).T
    ends = np.cumsum(wide * high)
    start = 0
    while start < len(triangles):
        done = ends[start - 1] if start else 0
        stop = max(start + 1, int(np.searchsorted(ends, done + PAIRS, side="right")))
        which = np.repeat(np.arange(start, stop), (wide * high)[start:stop])
        number = np.arange(len(which)) - (ends - wide * high - done)[which]
        across, up = first[which, 0] + number % wide[which], first[which, 1] + number // wide[which]
        a, b, c = np.moveaxis(corners[which] - np.stack([across, up], axis=1)[:, None], 1, 0)
        weights, covered = barycentric(a, b, c)
        which, at = which[covered], (up * columns + across)[covered]
        z = (weights[covered] * triangles[which, :, 2]).sum(axis=1)
        nearer = np.flatnonzero(z < depth[at])
        nearer = nearer[np.argsort(-z[nearer], kind="stable")]  # of several at a pixel, the last one written remains
        depth[at[nearer]], nearest[at[nearer]] = z[nearer], which[nearer]
        start = stop
    return DepthBuffer(extent, depth.reshape(rows, columns), nearest.reshape(rows, columns))
