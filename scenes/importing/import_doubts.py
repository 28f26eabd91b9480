"""Doubts about an imported file: its unit, where its antennas are, and coordinates of a map, far from the origin.

The gateway and the transmitter region are in metres, whatever the file's unit. The scene should be about as large as
the space between them: a room in millimetres that is read as metres is a thousand times too large.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from scenes.checks.enclosure import barycentric
from scenes.importing.imported_file import ImportedFile
from scenes.importing.lengths import METRES, in_each_unit, plain, plain_point, plain_size
from scenes.scene.description import FARTHEST, Scene

FLAT = 1.0
"""Height of a scene that is only ground, metres. Antennas above it are in the open."""

SINGLE_PRECISION = (".glb", ".gltf", ".stl", ".ply")
"""Suffixes of formats that usually have coordinates of 24 bits."""

COARSE = 1e-3
"""Rounding of coordinates that is worth a warning, metres."""

APART = 10.0
"""How many times the size of the file the antennas may be away from it to count as given in the same coordinates."""

DOUBTED = (1 / 3, 60.0)
"""Smallest and largest plausible ratio: the size of the scene over that of the box around the gateway and the
transmitter region. Below it, the antennas are far outside the scene; above it, they are in one corner. A street of 1 km
with a transmitter region of 30 m and a gateway nearby is plausible. A room in inches or centimetres that is read as
metres is not."""

REFUSED = (1 / 30, 400.0)
"""Smallest and largest possible ratio. Beyond it, the unit must be wrong. Millimetres for metres are always beyond."""

TYPICAL = 2.0
"""Typical ratio of a room. The unit whose ratio is nearest to it is suggested."""


def antenna_warnings(scene: Scene) -> list[str]:
    """Return a sentence for each odd place of the gateway or the transmitter region."""
    beside = _beside(scene)
    sentences = [beside] if beside else [_partly_beside(scene), _above(scene)]
    return [sentence for sentence in (*sentences, _below(scene), _looking_away(scene)) if sentence]


def _beside(scene: Scene) -> str | None:
    """Tell whether the gateway or the whole region is horizontally outside the scene."""
    low, high = scene.bounds
    names = [name for name, (least, most) in _spans(scene).items() if np.any((most < low)[:2] | (least > high)[:2])]
    if not names:
        return None
    return (
        f"expected the gateway and the transmitter region within the scene, {_horizontal(scene)}, found the "
        f"{' and the '.join(names)} outside it; is the up axis right?"
    )


def _partly_beside(scene: Scene) -> str | None:
    low, high = scene.bounds
    least, most = scene.transmitter.region
    if np.all((least >= low - 1e-6)[:2] & (most <= high + 1e-6)[:2]):
        return None
    return (
        f"expected the transmitter region within the scene, {_horizontal(scene)}, found a part of it outside: it "
        f"reaches from {plain_point(least)} to {plain_point(most)}"
    )


def _above(scene: Scene) -> str | None:
    """Tell whether the region is above everything, or only the gateway while the region is below a roof."""
    low, high = scene.bounds
    if high[2] - low[2] < FLAT:
        return None
    above = [name for name, (least, _) in _spans(scene).items() if least[2] > high[2]]
    if "transmitter region" not in above and not ("gateway" in above and _roofed(scene)):
        return None
    return (
        f"expected the gateway and the transmitter region below the top of the scene, z = {plain(high[2])} m, found "
        f"the {' and the '.join(above)} above it"
    )


def _below(scene: Scene) -> str | None:
    low, _ = scene.bounds
    below = [name for name, (least, _) in _spans(scene).items() if least[2] < low[2] - 1e-6]
    if not below:
        return None
    return (
        f"expected the gateway and the transmitter region above the lowest surface, z = {plain(low[2])} m, found the "
        f"{' and the '.join(below)} below it"
    )


def _looking_away(scene: Scene) -> str | None:
    gateway = scene.gateway
    towards = scene.transmitter.corners() - gateway.position
    if (towards @ gateway.boresight > 0).any():
        return None
    centre = scene.transmitter.region.mean(axis=0) - gateway.position
    return (
        "expected a gateway that looks towards the transmitter region, found the whole region behind it; the boresight "
        f"is {plain_point(gateway.boresight)}, and the direction to the region "
        f"{plain_point(centre / max(float(np.linalg.norm(centre)), 1e-9))}"
    )


def _spans(scene: Scene) -> dict[str, tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 3"]]]:
    position = np.array(scene.gateway.position)
    low, high = scene.transmitter.region
    return {"gateway": (position, position), "transmitter region": (low, high)}


def _horizontal(scene: Scene) -> str:
    low, high = scene.bounds
    return f"x {plain(low[0])} to {plain(high[0])} m and y {plain(low[1])} to {plain(high[1])} m"


def _roofed(scene: Scene) -> bool:
    """Whether a surface is straight above the centre of the transmitter region."""
    centre = scene.transmitter.region.mean(axis=0)
    triangles = np.vstack([item.mesh.triangles for item in scene.objects])
    weights, covered = barycentric(*np.moveaxis(triangles[:, :, :2] - centre[:2], 1, 0))
    heights = (weights[covered] * triangles[covered][:, :, 2]).sum(axis=1)
    return bool((heights > centre[2]).any())


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


class UnitDoubt(NamedTuple):
    """A reason to doubt a unit."""

    sentence: str  # what was expected, what was found, which unit would fit, and the size in each unit
    impossible: bool  # whether the unit cannot be right


def unit_doubt(
    bounds: Float[np.ndarray, "2 3"], antennas: Float[np.ndarray, "n 3"], unit: str, wavelength: float
) -> UnitDoubt | None:
    """Return the reason to doubt the unit of a file; None if the unit is plausible.

    >>> unit_doubt(np.array([[0, 0, 0], [5000, 4000, 3000]]), np.array([[0.5, 2, 2], [4, 3, 1]]), "m", 0.33).sentence
    'expected a scene about as large as the gateway and the transmitter region together, 3.77 m, found one of \
5000 x 4000 x 3000 m with the unit m; with the unit mm it would be 5 x 4 x 3 m (in the others: cm 50 x 40 x 30 m, in \
127 x 102 x 76.2 m, ft 1524 x 1219 x 914 m)'
    >>> unit_doubt(np.array([[0, 0, 0], [5, 4, 3]]), np.array([[0.5, 2, 2], [4, 3, 1]]), "m", 0.33) is None
    True
    """
    if not np.abs(antennas).max() <= FARTHEST:
        return None  # other checks refuse this case and the next one
    extents = bounds[1] - bounds[0]
    size, span = float(np.linalg.norm(extents)), float(np.linalg.norm(np.ptp(antennas, axis=0)))
    if not (size > 0 and span > 0):
        return None
    ratio = size / span
    too_small = size < wavelength
    if not too_small and DOUBTED[0] <= ratio <= DOUBTED[1]:
        return None
    found = f"found one of {plain_size(extents)} with the unit {unit}"
    if too_small and DOUBTED[0] <= ratio <= DOUBTED[1]:
        expected = f"expected a scene larger than the wavelength, {plain(wavelength)} m"
    else:
        expected = (
            f"expected a scene about as large as the gateway and the transmitter region together, {plain(span)} m"
        )
    sizes = in_each_unit(extents, unit)
    fits = min(METRES, key=lambda other: abs(math.log(ratio * METRES[other] / METRES[unit] / TYPICAL)))
    suggestion = "are the gateway and the region right?"
    if fits != unit:
        suggestion = f"with the unit {fits} it would be {sizes[fits]}"
    others = ", ".join(f"{other} {size}" for other, size in sizes.items() if other not in (unit, fits))
    return UnitDoubt(
        f"{expected}, {found}; {suggestion} (in the others: {others})",
        too_small or not REFUSED[0] <= ratio <= REFUSED[1],
    )
