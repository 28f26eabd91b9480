"""Draw and describe a scene, so that the user can check it, and draw the plans of many beside each other."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scenes.drawing.floor_plan import REGION, draw_plan
from scenes.drawing.perspective import draw_view
from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError, reason, require_instance, require_path, shown
from scenes.files.json_yaml_xml import plain_values
from scenes.files.lengths import rounded
from scenes.files.long_work import doing
from scenes.files.plain_text import in_figure
from scenes.scene.antennas import Gateway, stated
from scenes.scene.description import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def describe_scene(scene: Scene) -> dict[str, Any]:
    """Return a summary of a scene for ``json.dumps``: lengths in metres, frequency in Hz."""
    of_material = ("relative_permittivity", "conductivity", "thickness")
    return plain_values(
        {
            "name": scene.name,
            "frequency": scene.frequency,
            "wavelength": scene.wavelength,
            "bounds": {name: rounded(corner) for name, corner in zip(("min", "max"), scene.bounds, strict=True)},
            "gateway": _describe_gateway(scene.gateway),
            "further_gateways": {name: _describe_gateway(each) for name, each in scene.further_gateways.items()},
            "transmitter": stated(scene.transmitter),
            "objects": [
                {
                    "name": item.name,
                    "material": item.material,
                    "thickness": scene.thickness(item),
                    "size": rounded(item.mesh.extents),
                    "triangles": len(item.mesh.faces),
                    "closed": bool(item.parts.closed.all()),
                }
                for item in scene.objects
            ],
            "materials": [
                {"name": name, **{key: getattr(material, key) for key in of_material}}
                for name, material in scene.materials.items()
            ],
        }
    )


def _describe_gateway(gateway: Gateway) -> dict[str, Any]:
    return {**stated(gateway), "boresight": rounded(gateway.boresight)}


FORMATS = (".png", ".pdf", ".svg")  # File types of a drawing, by the end of its name


class DrawingError(InputError):
    """A scene could not be drawn. A scene that was written before is complete without its drawing."""


def draw_scene(scene: Scene, path: str | Path) -> None:
    """Draw a scene: a floor plan on the left, a perspective view on the right.

    Objects have the colours of their materials. The plan numbers the objects and shows a section at the middle height
    of the transmitter region. In a room, what the section cuts is left out above it, such as lintels, so doorways are
    gaps. A closed door is drawn open, with the arc of its swing, which no file tells: an object or part named "door",
    as thin and wide as one, between walls.

    A ceiling above the antennas is left out, and so are the walls between the viewer and the inside of a room;
    outdoors, nothing is left out. Hidden edges of the transmitter region are dashed. If the antennas are in a small
    part of a large scene, the perspective view shows only their neighbourhood. The drawing says what it leaves out.

    Args:
        scene: the scene.
        path: the file, whose name ends in .png, .pdf or .svg. An existing file is replaced.

    Raises:
        DrawingError: the scene cannot be drawn. This is an ``InputError``.
        InputError: the name of the file has another ending.
        OSError: the file cannot be written.

    Example:
        >>> import bisplat
        >>> bisplat.draw_scene(bisplat.load_scene("closet"), "closet.png")
    """
    require_instance(Scene, scene=scene)
    require_path(path=path)
    path = Path(path)
    if path.suffix.lower() not in FORMATS:
        raise InputError(f"{path}: expected a drawing named {', '.join(FORMATS)}, found {shown(path.suffix)}")
    content = BytesIO()
    doing(f"{path}: drawing {scene.triangles:,} triangles", 30e-6 * scene.triangles)
    try:
        _figure(scene).savefig(content, format=path.suffix[1:].lower())
    except Exception as error:  # a drawing is optional, so no fault in it may end the work of which it is a part
        raise DrawingError(f"{path}: the scene could not be drawn: {type(error).__name__}: {reason(error)}") from error
    write_atomically(path, content.getbuffer())
    doing("")


def _figure(scene: Scene) -> Figure:
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    figure = Figure(figsize=(15, 7.2), dpi=110, layout="constrained")
    grid = figure.add_gridspec(1, 2, width_ratios=(1, 1.05))
    left, right = figure.add_subfigure(grid[0]), figure.add_subfigure(grid[1])
    plan = left.add_subplot()
    names, plan_shows = draw_plan(plan, scene)
    left_out = draw_view(right.add_subplot(projection="3d"), scene)
    if left_out:
        right.supxlabel(f"left out of this view: {'; '.join(left_out)}", fontsize=9)
    count = len(scene.objects)
    plan.set_title(
        f"{in_figure(scene.name)}: {scene.frequency / 1e6:g} MHz, λ = {scene.wavelength * 100:.1f} cm, "
        f"{scene.gateway.array_in_words}, {count} {'object' if count == 1 else 'objects'}\n"
        f"{plan_shows}",
        fontsize=11,
    )
    if names:
        key = [Patch(alpha=0, label=f"{number} {in_figure(name)}") for number, name in enumerate(names, start=1)]
        style: dict[str, Any] = {"ncols": 4, "frameon": False, "fontsize": 9}
        left.legend(handles=key, loc="outside lower center", handlelength=0, handletextpad=0, **style)
    section = Line2D([], [], color="0.3", lw=1.6, label="plan: section")
    handles = _legend([scene], section, *plan.get_legend_handles_labels()[0])  # doors, if there are any
    right.legend(handles=handles, loc="outside upper center", ncols=4, frameon=False, fontsize=9)
    return figure


def _legend(scenes: Iterable[Scene], *lines: Any) -> list[Any]:
    from matplotlib.patches import Patch

    colors = {name: material.color for scene in scenes for name, material in scene.materials.items()}
    return [
        *(Patch(facecolor=color, edgecolor="0.3", label=in_figure(name)) for name, color in colors.items()),
        *lines,
        Patch(facecolor=REGION, edgecolor="green", label="transmitter region"),
        Patch(facecolor="crimson", label="gateway and boresight"),
    ]


ACROSS, INCHES, MOST = 5, 3.2, 40
"""Plans in a row, size of a plan in inches, and the largest number of plans that are drawn."""


def draw_plans(scenes: Mapping[str, Scene], path: Path) -> None:
    """Draw the floor plans of the first ``MOST`` scenes side by side, as ``draw_scene`` does but without numbers."""
    from matplotlib.figure import Figure

    shown = dict(list(scenes.items())[:MOST])
    columns = min(ACROSS, len(shown))
    rows = -(-len(shown) // columns)
    wide = max(2, columns)  # as the legend is
    figure = Figure(figsize=(INCHES * wide, INCHES * rows), dpi=90, layout="constrained")
    axes = np.atleast_1d(figure.subplots(rows, columns)).ravel()
    for axis, (title, scene) in zip(axes, shown.items(), strict=False):
        draw_plan(axis, scene, numbered=False)
        axis.set(title=in_figure(title), xlabel="", ylabel="")
        axis.tick_params(labelsize=7)
    for axis in axes[len(shown) :]:
        axis.remove()
    doors = {label: line for axis in figure.axes for line, label in zip(*axis.get_legend_handles_labels(), strict=True)}
    figure.legend(
        handles=_legend(shown.values(), *doors.values()),
        loc="outside lower center",
        ncols=2 * wide,
        frameon=False,
        fontsize=9,
    )
    content = BytesIO()
    figure.savefig(content, format="png")
    write_atomically(path, content.getbuffer())
    doing("")
