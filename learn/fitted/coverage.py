"""Coverage maps: received powers of every gateway, predicted on a horizontal grid."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import ceil
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import Delaunay

from learn.fitted.fitted_method import Fitted, fit_method
from learn.fitted.method_run import MethodRun
from learn.quantities.quantity import Prediction, joined
from scenes.files.errors import ParameterError, check_array, require_instance, require_positive, require_within, shown
from scenes.files.plain_text import say
from simulate.dataset.dataset import Dataset
from simulate.positions.positions import FARTHEST

MOST_CELLS = 1_000_000  # Largest number of cells of a map, within its rectangle

AT_ONCE = 1000  # Cells that are predicted at once

BESIDE = 1e-6
"""Metres by which a height may lie outside those of the known positions without a warning. Files have six decimals."""

NO_GATEWAY = -1  # In ``CoverageMap.strongest``: nothing is received, or the map says nothing


@dataclass(frozen=True)
class CoverageMap:
    """Predicted powers of G gateways in nx × ny square cells, at one height.

    x and y of the world frame are those of the cells' middles, and both rise with the index: row 0 is the south, the
    smallest y. Where the map says nothing, the powers are NaN.

    Attributes:
        fitted: the fitted method, with the dataset.
        x: middles of the columns, metres.
        y: middles of the rows, metres.
        height: z of all cells, metres.
        step: side of a cell, metres.
        inside: whether a cell is within the horizontal hull of the known positions. Elsewhere the method extrapolates.
        median: predicted powers, dBm. A power below the dataset's ``floor_dbm`` predicts that nothing is received.
        low, high: ends of the interval that holds the power with a probability of 90 %, dBm. None: the method states
            none.

    Example:
        >>> import bisplat
        >>> heard = {"powers": [[-48.0], [-60.0], [-57.0]], "gateways": {"door": (0, 0, 2)}, "frequency": "2.4 GHz"}
        >>> yard = bisplat.write_dataset("yard", [[1, 2, 1], [4, 2, 1], [3, 3, 1]], **heard)
        >>> coverage = bisplat.coverage_map(yard, method="inverse-distance", step=0.5)
        >>> coverage.strongest[0].tolist(), coverage.width is None
        ([0, 0, 0, 0, 0, 0], True)
    """

    fitted: Fitted = field(repr=False)
    x: Float[np.ndarray, " nx"]
    y: Float[np.ndarray, " ny"]
    height: float
    step: float
    inside: Bool[np.ndarray, "ny nx"]
    median: Float[np.ndarray, "G ny nx"]
    low: Float[np.ndarray, "G ny nx"] | None = None
    high: Float[np.ndarray, "G ny nx"] | None = None

    def __repr__(self) -> str:
        gateways, rows, columns = self.median.shape
        of = f"{gateways} gateway{'s' * (gateways > 1)}, {columns} × {rows} cells of {self.step:g} m"
        return f"CoverageMap({self.fitted.label!r}: {of} at z = {self.height:g} m)"

    @property
    def dataset(self) -> Dataset:
        """The received powers that the map was made from."""
        return self.fitted.dataset

    @property
    def width(self) -> Float[np.ndarray, "G ny nx"] | None:
        """Width of the 90 % interval, dB; None if the method states none."""
        return None if self.low is None or self.high is None else self.high - self.low

    @property
    def received(self) -> Bool[np.ndarray, "G ny nx"]:
        """Whether the gateway is predicted to receive something; False where the map says nothing."""
        return self.median >= self.dataset.floor_dbm

    @property
    def strongest(self) -> Int[np.ndarray, "ny nx"]:
        """Index of the gateway that receives most; −1 where none receives anything, or where the map says nothing."""
        powers = np.where(self.received, self.median, -np.inf)
        return np.where(self.received.any(axis=0), powers.argmax(axis=0), NO_GATEWAY)

    @property
    def edges(self) -> tuple[float, float, float, float]:
        """Smallest x and y, and largest x and y, of the outer edges of the cells, metres."""
        half = self.step / 2
        return self.x[0] - half, self.y[0] - half, self.x[-1] + half, self.y[-1] + half


def coverage_map(
    powers: MethodRun | Fitted | Dataset | Path | str,
    *,
    height: float | None = None,
    step: float = 0.1,
    region: tuple[float, float, float, float] | None = None,
    method: str = "helmholtz",
    report: Callable[[str, int, int], None] = lambda phase, done, total: None,
) -> CoverageMap:
    """Predict the power of every gateway on a horizontal grid.

    Walls count only as far as the known powers show them: nothing is traced, unless ``powers`` is fitted by "twin".

    Args:
        powers: received powers, their folder, or a run of them. Of a folder, the method learns from all positions, the
            test part as well.
        height: z of the map, metres. None: the median height of the known positions.
        step: side of the square cells, metres.
        region: smallest x and y, then largest x and y of the map, metres, world frame; its right and upper edge are
            moved out to a whole number of cells. None: the bounding box of the known positions, of which the part
            within their convex hull is predicted, and the rest is NaN. In a stated region every cell is predicted.
        method: method to fit, as for ``compare``. It is not used for a run.
        report: called with the phase, the number of cells done, and that of all cells.

    Returns:
        The map. ``export`` writes it as arrays and figures.

    Raises:
        InputError: the folder cannot be read.
        ParameterError: a parameter is outside its range, or the map has more than 1,000,000 cells.

    Example:
        >>> import bisplat
        >>> heard = {"powers": [[-48.0], [-60.0], [-57.0]], "gateways": {"door": (0, 0, 2)}, "frequency": "2.4 GHz"}
        >>> porch = bisplat.write_dataset("porch", [[1, 2, 1], [4, 2, 1], [3, 3, 1]], **heard)
        >>> coverage = bisplat.coverage_map(porch, step=0.5, region=(0, 0, 4, 3))
        >>> coverage
        CoverageMap('helmholtz': 1 gateway, 8 × 6 cells of 0.5 m at z = 1 m)
        >>> coverage.median.shape, coverage.x[:2].tolist(), bool(coverage.median[0, 0, 0] > coverage.median[0, 5, 7])
        ((1, 6, 8), [0.25, 0.75], True)
    """
    require_instance(MethodRun, Fitted, Dataset, str, Path, powers=powers)
    require_positive(step=step)
    if height is not None:
        require_within(-FARTHEST, FARTHEST, "a height in metres", height=height)
    asked = None if region is None else _checked(region)
    given = powers.fitted if isinstance(powers, MethodRun) else powers
    fitted = given if isinstance(given, Fitted) else fit_method(given, "power", method)
    known = fitted.dataset.positions[fitted.known]
    height = float(np.median(known[:, 2]) if height is None else height)
    low, high = known[:, 2].min(), known[:, 2].max()
    if not low - BESIDE <= height <= high + BESIDE:
        say(f"warning: the height {height:g} m is outside those of the known positions, {low:g} to {high:g} m")
    box = np.stack([known[:, :2].min(axis=0), known[:, :2].max(axis=0)]) if asked is None else asked
    counts = _cells(box, step)
    first = box[0] if asked is not None else box.mean(axis=0) - step * np.array(counts) / 2
    x, y = (corner + step * (np.arange(count) + 0.5) for corner, count in zip(first, counts, strict=True))
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    inside = _within_hull(points, known[:, :2], step)
    wanted = np.flatnonzero(inside if asked is None else np.ones(len(points), bool))
    places = np.column_stack([points[wanted], np.full(len(wanted), height)])
    found = _predicted(fitted, places, report)

    def on_grid(values: Float[np.ndarray, "K G"]) -> Float[np.ndarray, "G ny nx"]:
        grid = np.full((values.shape[1], len(points)), np.nan)
        grid[:, wanted] = values.T
        return grid.reshape(-1, len(y), len(x))

    interval = () if found.low is None or found.high is None else (on_grid(found.low), on_grid(found.high))
    shape = (len(y), len(x))
    return CoverageMap(fitted, x, y, height, float(step), inside.reshape(shape), on_grid(found.value), *interval)


def _checked(region: tuple[float, float, float, float]) -> Float[np.ndarray, "2 2"]:
    corners = check_array("region", region, (4,), "smallest x and y, then largest x and y").reshape(2, 2)
    if (corners[0] >= corners[1]).any() or np.abs(corners).max() > FARTHEST:
        expected = f"expected smallest x and y, then larger x and y, in metres within {FARTHEST:g}"
        raise ParameterError("region", f"{expected}, found {shown(region)}")
    return corners


def _cells(box: Float[np.ndarray, "2 2"], step: float) -> tuple[int, int]:
    """The fewest cells along x and y that cover a rectangle, at least one each way."""
    extent = box[1] - box[0]
    columns, rows = (max(1, ceil(round(float(each) / step, 6))) for each in extent)
    if columns * rows > MOST_CELLS:
        least = float(max(np.sqrt(extent.prod() / MOST_CELLS), extent.max() / MOST_CELLS))
        raise ParameterError(
            "step",
            f"expected at least {1.01 * least:.3g} m, for at most {MOST_CELLS:,} cells, found {step:g} m "
            f"({columns:,} × {rows:,} cells)",
        )
    return columns, rows


def _within_hull(
    points: Float[np.ndarray, "n 2"], known: Float[np.ndarray, "k 2"], step: float
) -> Bool[np.ndarray, " n"]:
    """Whether points are in the hull of the cells around known positions, which has an area even for a single one."""
    around = step / 2 * np.array([[-1, -1], [-1, 1], [1, -1], [1, 1]])
    hull = Delaunay((known[:, None] + around).reshape(-1, 2))
    return hull.find_simplex(points) >= 0


def _predicted(fitted: Fitted, places: Float[np.ndarray, "K 3"], report: Callable[[str, int, int], None]) -> Prediction:
    parts = []
    for start in range(0, len(places), AT_ONCE):
        parts.append(fitted.predict(places[start : start + AT_ONCE]))
        report("cells", min(start + AT_ONCE, len(places)), len(places))
    return joined(parts)
