"""What ``bisplat coverage`` writes: the arrays of a map, a GeoTIFF, and figures."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from learn.powers.coverage import CoverageMap
from learn.reports.coverage_figures import draw_coverage, draw_intervals
from learn.reports.geotiff import write_geotiff
from scenes.files.errors import InputError, require_flag, require_instance, require_path
from scenes.files.npz_file import write_arrays
from scenes.files.output_folder import new_folder
from scenes.files.plain_text import say
from scenes.scene.description import Scene
from simulate.dataset.dataset_folder import recorded_scene


def write_coverage(
    coverage: CoverageMap, folder: Path | str, scene: Scene | None = None, *, force: bool = False
) -> None:
    """Write a coverage map into a new folder: ``coverage.npz``, ``coverage.tif``, ``coverage.png`` and ``.pdf``, and
    ``interval.png`` and ``.pdf``.

    The GeoTIFF has float32 bands: the median of each gateway, then the lower and the upper ends of the 90 % intervals.
    Its first row is the north, the largest y; in the arrays, row 0 is the south, the smallest y. Where the map says
    nothing, both have NaN. Methods that state no interval have the medians alone.

    Args:
        coverage: the map.
        folder: the folder.
        scene: scene whose section at the map's height is drawn. None: the one that the dataset's folder has, if any.
        force: replace existing files of the same names in the folder.

    Raises:
        InputError: the folder has other files.

    Example:
        >>> import bisplat
        >>> shop = bisplat.write_rssi("museum", [[1, 2, 1], [4, 2, 1], [3, 3, 1]], [[-48.0], [-60.0], [-57.0]],
        ...                           {"door": (0, 0, 2)}, "2.4 GHz")
        >>> coverage = bisplat.coverage_map(shop, step=0.5)
        >>> bisplat.write_coverage(coverage, "museum-map")
        >>> import numpy as np
        >>> np.load("museum-map/coverage.npz")["median"].shape
        (1, 2, 6)
    """
    require_instance(CoverageMap, coverage=coverage)
    require_path(folder=folder)
    require_flag(force=force)
    if scene is not None:
        require_instance(Scene, scene=scene)
    with new_folder(Path(folder), force) as unfinished:
        write_coverage_files(coverage, unfinished, scene)


def write_coverage_files(coverage: CoverageMap, folder: Path, scene: Scene | None = None) -> None:
    """Write the files of ``write_coverage``, which explains the arguments, into an existing folder."""
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
    words = {"median": "median (dBm)", "low": "5 % quantile (dBm)", "high": "95 % quantile (dBm)"}
    write_geotiff(
        folder / "coverage.tif",
        np.concatenate(list(stated.values())),
        [f"{gateway}: {words[band]}" for band in stated for gateway in dataset.gateway_names],
        (coverage.edges[0], coverage.edges[3]),
        coverage.step,
    )
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
