"""The positions of an array's elements, in metres: their number, their range, and that no two are at one place."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from scenes.files.errors import check_array

MOST_ELEMENTS = 1024
"""Most elements of an array. Memory grows with the elements, or with their square."""

FARTHEST_ELEMENT = 100.0
"""Metres. Largest coordinate of an element in the gateway frame. An array of millimetres read as metres exceeds it."""

SAME_PLACE = 1e-6
"""Metres. Two elements that are nearer to each other are at one place."""

Positions = tuple[tuple[float, float, float], ...]
"""Positions x, y, z of elements, metres, gateway frame."""


def as_positions(parameter: str, given: ArrayLike) -> Positions:
    """Turn positions of elements from a user into tuples.

    >>> as_positions("elements", [[0, 0, 0], [0.1, 0, 0]])
    ((0.0, 0.0, 0.0), (0.1, 0.0, 0.0))
    """
    if isinstance(given, list | tuple) and not given:
        return ()  # which ``fault_of`` refuses
    rows = check_array(parameter, given, (None, 3), "rows of x, y, z of each element, metres", finite=False)
    return tuple((x, y, z) for x, y, z in (rows + 0.0).tolist())


def fault_of(positions: Positions) -> str | None:
    """What is wrong with the positions of an array's elements, "expected ..., found ..."; None: nothing.

    >>> fault_of(((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.0, 0.0, 0.0)))
    'expected each element at a place of its own, found elements 0 and 2 at one place, [0.0, 0.0, 0.0]'
    >>> fault_of(((0.0, 0.0, 160.0),))
    'expected elements within ±100 m of the gateway, found element 0 at [0.0, 0.0, 160.0]; are they in metres?'
    """
    if not 1 <= len(positions) <= MOST_ELEMENTS:
        return f"expected 1 to {MOST_ELEMENTS} elements, found {len(positions)}"
    rows = np.array(positions)
    bad = ~np.isfinite(rows).all(axis=1)
    if bad.any():
        first = int(bad.argmax())
        return f"expected finite positions, found element {first} at {rows[first].tolist()}"
    far = np.abs(rows).max(axis=1) > FARTHEST_ELEMENT
    if far.any():
        first = int(far.argmax())
        found = f"element {first} at {rows[first].tolist()}"
        return f"expected elements within ±{FARTHEST_ELEMENT:g} m of the gateway, found {found}; are they in metres?"
    pairs = cKDTree(rows).query_pairs(SAME_PLACE)
    if pairs:
        first, second = min(pairs)
        found = f"elements {first} and {second} at one place, {rows[first].tolist()}"
        return f"expected each element at a place of its own, found {found}"
    return None
