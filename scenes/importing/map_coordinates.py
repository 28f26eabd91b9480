"""Files in map coordinates, such as UTM: too far from the origin, and how to shift them there."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from scenes.importing.imported_file import ImportedFile
from scenes.importing.lengths import plain, plain_point
from scenes.scene.description import FARTHEST

SINGLE_PRECISION = (".glb", ".gltf", ".stl", ".ply")
"""Suffixes of formats that usually have coordinates of 24 bits."""

COARSE = 1e-3
"""Rounding of coordinates that is worth a warning, metres."""

APART = 10.0
"""How many times the size of the file the antennas may be away from it to count as given in the same coordinates."""


def far_from_origin(
    bounds: Float[np.ndarray, "2 3"], antennas: Float[np.ndarray, "n 3"], shift: Float[np.ndarray, " 3"]
) -> str | None:
    """Say that objects are too far from the origin, and which shift mends it; None if they are near enough.

    >>> far = np.array([[691231.5, 5334565.3, 515.2], [691237.5, 5334570.3, 518.0]])
    >>> far_from_origin(far, far, np.zeros(3))
    'expected coordinates within 100000 m of the origin, found the objects at (691232, 5334565, 515) to (691238, \
5334570, 518), as in map coordinates; --shift -691234 -5334568 -515 moves all of them to the origin'
    """
    if np.abs(bounds).max() <= FARTHEST:
        return None
    middle = bounds.mean(axis=0)
    best = shift - np.round([middle[0], middle[1], bounds[0, 2]]) + 0.0
    move = f"--shift {' '.join(f'{value:.0f}' for value in best)} moves all of them to the origin"
    reach = APART * float(np.linalg.norm(np.ptp(bounds, axis=0)))
    if not np.abs(antennas - middle).max() <= reach:
        move = f"give the gateway and the region in the same coordinates; then {move}"
    return (
        f"expected coordinates within {plain(FARTHEST)} m of the origin, found the objects at {plain_point(bounds[0])} "
        f"to {plain_point(bounds[1])}, as in map coordinates; {move}"
    )


def rounding_warnings(file: ImportedFile, metres: float) -> list[str]:
    """Return a warning if coordinates far from the origin were rounded to single precision."""
    if file.path.suffix.lower() not in SINGLE_PRECISION:
        return []
    vertices = np.vstack([part.mesh.vertices for part in file.parts])
    largest = float(np.abs(vertices).max())
    step = float(np.spacing(np.float32(largest))) * metres
    if step < COARSE or not np.array_equal(vertices, vertices.astype(np.float32)):
        return []
    return [
        f"coordinates of {plain(largest * metres)} m are rounded to {plain(step)} m, since the file has them in single "
        "precision; better shift the objects to the origin in the program that wrote it"
    ]
