"""A short walk through positions: nearest neighbour, then 2-opt."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from scenes.checks.occupancy import crosses
from scenes.scene.description import Scene

LEAST_GAIN = 1e-9
"""Smaller gains, in metres, are rounding errors."""


@dataclass(frozen=True)
class Tour:
    """An open walk that visits every position once."""

    order: Int[np.ndarray, " n"]  # [n] indices of the positions
    length: float  # sum of the straight lines between consecutive positions, metres
    crossings: int  # number of these lines that cross a surface of the scene


def short_tour(
    positions: Float[np.ndarray, "n 3"],
    scene: Scene | None = None,
    report: Callable[[int, int], None] = lambda done, total: None,
) -> Tour:
    """A short open walk that visits every position once.

    A line that crosses a surface of the scene counts as longer by the diagonal of the box around the positions, to
    allow for a detour. Two walks are improved by reversing parts of them (2-opt) until no reversal makes them shorter,
    and the better one is returned. One begins as the walk to the nearest remaining position each time, the other in the
    order given.

    >>> short_tour(np.array([[0.0, 0, 0], [2, 0, 0], [1, 0, 0]])).length
    2.0
    """
    lengths = np.linalg.norm(positions[:, None] - positions[None], axis=-1)
    crossing = np.zeros(lengths.shape, bool) if scene is None else crossing_lines(positions, scene, report)
    costs = lengths + crossing * np.linalg.norm(np.ptp(positions, axis=0))
    starts = (_to_the_nearest(costs), np.arange(len(positions)))
    order = min((_without_detours(start, costs) for start in starts), key=lambda order: _along(order, costs))
    return Tour(order, _along(order, lengths), round(_along(order, crossing)))


def crossing_lines(
    positions: Float[np.ndarray, "n 3"], scene: Scene, report: Callable[[int, int], None]
) -> Bool[np.ndarray, "n n"]:
    """Whether the straight line between each pair of positions crosses a surface of the scene."""
    first, second = np.triu_indices(len(positions), 1)
    starts, ends = positions[first], positions[second]
    low, high = np.minimum(starts, ends), np.maximum(starts, ends)
    found = np.zeros(len(first), bool)
    for number, item in enumerate(scene.objects):
        report(number, len(scene.objects))
        triangles = np.asarray(item.mesh.triangles)
        near = (triangles.min(axis=1) <= positions.max(axis=0)) & (triangles.max(axis=1) >= positions.min(axis=0))
        for triangle in triangles[near.all(axis=1)]:
            beside = (low <= triangle.max(axis=0)) & (high >= triangle.min(axis=0))
            open_lines = np.flatnonzero(beside.all(axis=1) & ~found)
            found[open_lines] = crosses(starts[open_lines], ends[open_lines], triangle)
    result = np.zeros((len(positions), len(positions)), bool)
    result[first, second] = result[second, first] = found
    return result


def _along(order: Int[np.ndarray, " n"], costs: np.ndarray) -> float:
    """Sum of the costs of a walk's lines."""
    return float(costs[order[:-1], order[1:]].sum())


def _to_the_nearest(costs: Float[np.ndarray, "n n"]) -> Int[np.ndarray, " n"]:
    """The walk that goes to the nearest remaining position each time, from one end of the longest line."""
    open_costs = costs.copy()
    order = [int(costs.max(axis=1).argmax())]
    for _ in range(len(costs) - 1):
        open_costs[:, order[-1]] = np.inf
        order.append(int(open_costs[order[-1]].argmin()))
    return np.array(order)


def _without_detours(order: Int[np.ndarray, " n"], costs: Float[np.ndarray, "n n"]) -> Int[np.ndarray, " n"]:
    """A walk after all reversals of a part of it that make it shorter (2-opt)."""
    order, count = order.copy(), len(order)
    better = True
    while better:
        better = False
        for start in range(count - 1):
            ends = np.arange(start + 1, count)  # the part from start to end is reversed
            first, last = order[start], order[ends]
            gains = np.zeros(len(ends))
            if start > 0:
                gains += costs[order[start - 1], first] - costs[order[start - 1], last]
            gains[:-1] += costs[last[:-1], order[ends[:-1] + 1]] - costs[first, order[ends[:-1] + 1]]
            best = int(gains.argmax())
            if gains[best] > LEAST_GAIN:
                order[start : ends[best] + 1] = order[start : ends[best] + 1][::-1].copy()
                better = True
    return order
