"""What ``bisplat predict --map`` writes: the arrays of a map, and figures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from learn.fitted.coverage import NO_GATEWAY, CoverageMap
from learn.reports.paper import PAGE, at_paper_size, save
from learn.reports.plots import MAGNITUDE
from learn.reports.provenance import Provenance
from scenes.drawing.floor_plan import section
from scenes.files.errors import InputError, require_instance
from scenes.files.npz_file import write_arrays
from scenes.files.output_folder import new_folder
from scenes.files.plain_text import in_figure, say
from scenes.scene.description import Scene
from simulate.dataset.rooms_folder import recorded_scene


def write_coverage(coverage: CoverageMap, folder: Path, scene: Scene | None, force: bool) -> None:
    """Write a coverage map into a new folder, as ``export`` explains it."""
    if scene is not None:
        require_instance(Scene, scene=scene)
    with new_folder(folder, force) as unfinished:
        write_coverage_files(coverage, unfinished, scene)


def write_coverage_files(coverage: CoverageMap, folder: Path, scene: Scene | None = None) -> None:
    """Write the files of ``write_coverage`` into an existing folder."""
    scene = _recorded(coverage) if scene is None else scene
    dataset = coverage.dataset
    bands = {"median": coverage.median, "low": coverage.low, "high": coverage.high}
    stated = {name: values for name, values in bands.items() if values is not None}
    arrays = {
        **{"x": coverage.x, "y": coverage.y, "height": np.array(coverage.height), "step": np.array(coverage.step)},
        **{"inside": coverage.inside, "strongest": coverage.strongest},
        **{"gateway_names": np.array(dataset.gateway_names), "gateway_positions": dataset.gateway_positions},
        **{"known_positions": dataset.positions[coverage.fitted.known], "floor_dbm": np.array(dataset.floor_dbm)},
    }
    write_arrays(folder / "coverage.npz", stated | arrays)
    draw_coverage(coverage, folder / "coverage.png", scene)
    if coverage.width is not None:
        draw_intervals(coverage, folder / "interval.png", scene)


def _recorded(coverage: CoverageMap) -> Scene | None:
    """The scene of the dataset's folder. If it cannot be read, the map is drawn without it."""
    try:
        return recorded_scene(coverage.dataset.folder, coverage.dataset.metadata)
    except (InputError, OSError) as error:
        say(f"warning: the map is drawn without its scene, which cannot be read ({error})")
        return None


MOST_PANELS = 24  # Most gateways with a panel; a figure of more would not fit a page

BROADEST, NARROWEST = 5, 2  # Most and least panels in a row: high maps stand side by side, broad ones do not

SILENT = "0.82"  # Grey of cells in which nothing is received

INTERVAL = "magma_r"  # Colour map of the widths of intervals: dark is uncertain

SHOWN = (1, 99)  # Percentiles of the powers at which the colours end: one deep fade would make all others look alike

MARGIN = 0.04  # Margin around a map, as a share of its larger side


def draw_coverage(coverage: CoverageMap, path: Path, scene: Scene | None = None) -> None:
    """Draw the predicted power of each gateway with one colour scale, and the strongest gateway."""
    heard = coverage.median[coverage.received]
    low, high = np.percentile(heard, SHOWN) if heard.size else (coverage.dataset.floor_dbm, 0.0)
    scale = {"cmap": colormaps[MAGNITUDE], "vmin": low, "vmax": max(high, low + 1e-6)}
    _draw_maps(coverage, coverage.median, scale, "received power (dBm)", path, scene)


def draw_intervals(coverage: CoverageMap, path: Path, scene: Scene | None = None) -> None:
    """Draw the width of the 90 % interval of each gateway's power."""
    width = coverage.width
    assert width is not None
    scale = {"cmap": colormaps[INTERVAL], "vmin": np.nanmin(width), "vmax": np.nanmax(width) + 1e-6}
    _draw_maps(coverage, width, scale, "width of the 90 % interval (dB)", path, scene)


@at_paper_size()
def _draw_maps(
    coverage: CoverageMap,
    values: Float[np.ndarray, "G ny nx"],
    scale: dict[str, Any],
    label: str,
    path: Path,
    scene: Scene | None,
) -> None:
    """Draw values of each gateway; of powers grey where nothing is received, and the strongest gateway."""
    shown, of_powers = min(len(values), MOST_PANELS), values is coverage.median
    figure, axes = _panels(coverage, shown + of_powers)
    lines = _outline(coverage, scene)
    silent = np.isfinite(coverage.median) & ~coverage.received & of_powers
    for gateway, axis in enumerate(axes[:shown]):
        image = _draw(coverage, axis, np.where(silent[gateway], np.nan, values[gateway]), scale, lines)
        if silent[gateway].any():
            grey: dict[str, Any] = {"cmap": ListedColormap([SILENT]), "extent": image.get_extent(), "origin": "lower"}
            axis.imshow(np.where(silent[gateway], 0.0, np.nan), interpolation="nearest", zorder=0.5, **grey)
        _mark(coverage, axis, [gateway])
        axis.set_title(in_figure(coverage.dataset.gateway_names[gateway]))
    ends = "both" if of_powers else "neither"
    figure.colorbar(image, ax=list(axes), label=label, aspect=30, pad=0.02, extend=ends)
    handles = _draw_strongest(coverage, axes[shown], lines) if of_powers else []
    handles += _handles(coverage, lines, bool(silent.any()))
    figure.legend(handles=handles, loc="outside upper left", ncols=5, handlelength=1.4)
    name, method, known = coverage.dataset.folder.resolve().name, coverage.fitted.label, len(coverage.fitted.known)
    made = Provenance(f"Coverage of {name}, predicted by {method} from {known} known positions", method, name)
    save(figure, path, made, _note(coverage, shown))


def _panels(coverage: CoverageMap, count: int) -> tuple[Figure, list[Axes]]:
    """A figure of as many panels as needed, of the map's shape."""
    left, bottom, right, top = coverage.edges
    aspect = float(np.clip((top - bottom) / (right - left), 0.25, 2.5))
    columns = min(count, int(np.clip(round(3.6 * aspect**0.5), NARROWEST, BROADEST)))
    rows = -(-count // columns)
    across = (PAGE - 1.2) / columns - 0.1
    figure = Figure(figsize=(PAGE, 0.75 + rows * (across * aspect + 0.45)), layout="constrained")
    grid = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    axes = list(grid.flat)
    for axis in axes[count:]:
        axis.remove()
    for index, axis in enumerate(axes[:count]):
        axis.tick_params(labelbottom=index + columns >= count, labelleft=index % columns == 0)
        axis.set_xlabel("x (m)" if index + columns >= count else "")
        axis.set_ylabel("y (m)" if index % columns == 0 else "")
    return figure, axes[:count]


def _window(coverage: CoverageMap) -> Float[np.ndarray, "2 2"]:
    """Corners (min, max) of what a panel shows: the map with a margin, metres."""
    left, bottom, right, top = coverage.edges
    margin = MARGIN * max(right - left, top - bottom)
    return np.array([[left - margin, bottom - margin], [right + margin, top + margin]])


def _outline(coverage: CoverageMap, scene: Scene | None) -> Float[np.ndarray, "n 2 2"]:
    """The lines of the scene's section at the map's height that may be seen in a panel."""
    objects = [] if scene is None else [section(item.mesh, coverage.height) for item in scene.objects]
    lines = np.concatenate([np.zeros((0, 2, 2)), *objects])
    low, high = _window(coverage)
    return lines[((lines.max(axis=1) >= low) & (lines.min(axis=1) <= high)).all(axis=1)]


def _draw(
    coverage: CoverageMap,
    axis: Axes,
    values: Float[np.ndarray, "ny nx"],
    scale: dict[str, Any],
    lines: Float[np.ndarray, "n 2 2"],
) -> AxesImage:
    """Draw values, the section of the scene and the known positions. Return the image."""
    left, bottom, right, top = coverage.edges
    extent = (left, right, bottom, top)
    image = axis.imshow(values, origin="lower", extent=extent, interpolation="nearest", **scale)
    axis.add_collection(LineCollection(list(lines), colors="0.15", linewidths=0.5))
    known = coverage.dataset.positions[coverage.fitted.known]
    size = np.clip(32 / np.sqrt(len(known)), 0.7, 5.0)  # points: smaller where there are many
    axis.plot(known[:, 0], known[:, 1], ".", color="black", mec="none", ms=size, alpha=0.5)
    low, high = _window(coverage)
    axis.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    return image


def _mark(coverage: CoverageMap, axis: Axes, gateways: list[int]) -> None:
    """Mark gateways; one beyond the panel by a hollow mark at its edge, on the side where it is."""
    x_limits, y_limits = axis.get_xlim(), axis.get_ylim()
    for gateway in gateways:
        x, y, _ = coverage.dataset.gateway_positions[gateway]
        place = np.clip(x, *x_limits), np.clip(y, *y_limits)
        filled = "crimson" if place == (x, y) else "white"
        axis.plot(*place, "s", ms=5, mew=1.2, mfc=filled, mec="crimson", ls="none", clip_on=False, zorder=5)


def _draw_strongest(coverage: CoverageMap, axis: Axes, lines: Float[np.ndarray, "n 2 2"]) -> list[Any]:
    """Draw which gateway is the strongest. Return the entries of the legend, of gateways that are so somewhere."""
    strongest = coverage.strongest
    found = [int(each) for each in np.unique(strongest) if each != NO_GATEWAY]
    table = distinct(len(found))
    silent = (strongest == NO_GATEWAY) & np.isfinite(coverage.median).all(axis=0)
    number = np.where(silent, len(found), np.nan)
    for place, gateway in enumerate(found):
        number[strongest == gateway] = place
    colours = ListedColormap([*table, SILENT])
    _draw(coverage, axis, number, {"cmap": colours, "vmin": -0.5, "vmax": len(found) + 0.5}, lines)
    _mark(coverage, axis, found)
    axis.set_title("strongest gateway")
    names = coverage.dataset.gateway_names
    return [Patch(color=table[place], label=in_figure(names[gateway])) for place, gateway in enumerate(found)]


def distinct(count: int) -> list[Any]:
    """Colours (RGB or RGBA, 0…1) of so many gateways, as different as they can be."""
    if count <= 20:
        return list(colormaps["tab10" if count <= 10 else "tab20"].colors[:count])  # type: ignore[attr-defined]
    return list(colormaps["gist_rainbow"](np.linspace(0, 1, count)))


def _handles(coverage: CoverageMap, lines: Float[np.ndarray, "n 2 2"], silent: bool) -> list[Any]:
    """The entries of the legend that both figures have."""
    square: dict[str, Any] = {"marker": "s", "ms": 5, "mec": "crimson", "ls": "none"}
    low, high = _window(coverage)
    places = coverage.dataset.gateway_positions[:, :2]
    within = ((places >= low) & (places <= high)).all(axis=1)
    handles: list[Any] = [Line2D([], [], marker=".", color="black", ls="none", label="known position")]
    if within.any():
        handles.append(Line2D([], [], mfc="crimson", label="gateway", **square))
    if not within.all():
        handles.append(Line2D([], [], mfc="white", label="gateway further out", **square))
    if len(lines):
        handles.append(Line2D([], [], color="0.15", lw=0.8, label="section of the scene"))
    if silent:
        handles.append(Patch(color=SILENT, label="nothing received"))
    return handles


def _note(coverage: CoverageMap, shown: int) -> str:
    """What a reader must know."""
    sentences = [f"z = {coverage.height:.2f} m, cells of {coverage.step:g} m."]
    if not np.isfinite(coverage.median[0]).all():
        sentences.append("White: outside the hull of the known positions.")
    elif not coverage.inside.all():
        sentences.append("Away from the known positions the powers are extrapolated.")
    if shown < len(coverage.median):
        sentences.append(f"The first {shown} of {len(coverage.median)} gateways.")
    return " ".join(sentences)
