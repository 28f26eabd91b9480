"""Whether an imported file is plausible: its unit, where its antennas are, and coordinates far from the origin.

The gateway and the transmitter region are in metres, whatever the file's unit. The scene should be about as large as
the space between them: a room in millimetres that is read as metres is a thousand times too large.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from scenes.checks.enclosure import lowest_above
from scenes.files.lengths import METRES, plain, plain_point, plain_size
from scenes.importing.formats.mesh_part import ImportedFile
from scenes.scene.description import FARTHEST, Scene

FLAT = 1.0  # Height of a scene that is only ground, metres. Antennas above it are in the open.

SINGLE_PRECISION = (".glb", ".gltf", ".stl", ".ply")
"""Suffixes of formats that usually have coordinates of 24 bits."""

COARSE = 1e-3  # Rounding of coordinates that is worth a warning, metres

APART = 10.0
"""How many times the size of the file the antennas may be away from it to count as given in the same coordinates."""

DOUBTED = (1 / 3, 60.0)
"""Smallest and largest plausible ratio: the size of the scene over that of the box around the gateway and the
transmitter region. Below it, the antennas are far outside the scene; above it, they are in one corner. A street of 1 km
with a transmitter region of 30 m and a gateway nearby is plausible. A room in inches or centimetres that is read as
metres is not."""

REFUSED = (1 / 30, 400.0)
"""Smallest and largest possible ratio. Beyond it, the unit must be wrong. Millimetres for metres are always beyond."""

TYPICAL = 2.0  # Typical ratio of a room. The unit whose ratio is nearest to it is suggested.


class Doubt(NamedTuple):
    """A reason to doubt how a file is read."""

    sentence: str  # what was expected, what was found, and which option would fit
    decisive: bool  # whether it cannot be right, so that the file is refused


def antenna_warnings(scene: Scene) -> list[str]:
    """Return a sentence for each odd place of the gateway or the transmitter region."""
    low, high = scene.bounds
    gateway, region = scene.gateway, scene.transmitter.region
    position, centre = np.array(gateway.position), region.mean(axis=0)
    spans = {"gateway": (position, position), "transmitter region": tuple(region)}
    within = f"within the scene, x {plain(low[0])} to {plain(high[0])} m and y {plain(low[1])} to {plain(high[1])} m,"
    both = "expected the gateway and the transmitter region"
    beside = [name for name, (least, most) in spans.items() if np.any((most < low)[:2] | (least > high)[:2])]
    above = [name for name, (least, _) in spans.items() if least[2] > high[2]]
    below = [name for name, (least, _) in spans.items() if least[2] < low[2] - 1e-6]
    sentences = []
    if beside:
        sentences.append(f"{both} {within} found the {' and the '.join(beside)} outside it; is the up axis right?")
    elif not np.all((region[0] >= low - 1e-6)[:2] & (region[1] <= high + 1e-6)[:2]):
        sentences.append(
            f"expected the transmitter region {within} found a part of it outside: it reaches from "
            f"{plain_point(region[0])} to {plain_point(region[1])}"
        )
    roof = lowest_above(centre, np.vstack([item.mesh.triangles for item in scene.objects]))
    # The region is above everything, or only the gateway while the region is below a roof.
    if not beside and high[2] - low[2] >= FLAT and ("transmitter region" in above or (above and roof < np.inf)):
        sentences.append(
            f"{both} below the top of the scene, z = {plain(high[2])} m, found the {' and the '.join(above)} above it"
        )
    if below:
        sentences.append(
            f"{both} above the lowest surface, z = {plain(low[2])} m, found the {' and the '.join(below)} below it"
        )
    if not ((scene.transmitter.corners() - position) @ gateway.boresight > 0).any():
        towards = (centre - position) / max(float(np.linalg.norm(centre - position)), 1e-9)
        sentences.append(
            "expected a gateway that looks towards the transmitter region, found the whole region behind it; the "
            f"boresight is {plain_point(gateway.boresight)}, and the direction to the region {plain_point(towards)}"
        )
    return sentences


def far_from_origin(
    bounds: Float[np.ndarray, "2 3"], antennas: Float[np.ndarray, "n 3"], shift: Float[np.ndarray, " 3"]
) -> str | None:
    """Say that objects are too far from the origin, and which shift mends it; None if they are near enough."""
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


def unit_doubt(
    bounds: Float[np.ndarray, "2 3"], antennas: Float[np.ndarray, "n 3"], unit: str, wavelength: float
) -> Doubt | None:
    """Return the reason to doubt the unit of a file; None if the unit is plausible."""
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
    sizes = {other: plain_size(extents * metres / METRES[unit]) for other, metres in METRES.items()}
    fits = min(METRES, key=lambda other: abs(math.log(ratio * METRES[other] / METRES[unit] / TYPICAL)))
    suggestion = "are the gateway and the region right?"
    if fits != unit:
        suggestion = f"with the unit {fits} it would be {sizes[fits]}"
    others = ", ".join(f"{other} {size}" for other, size in sizes.items() if other not in (unit, fits))
    return Doubt(
        f"{expected}, {found}; {suggestion} (in the others: {others})",
        too_small or not REFUSED[0] <= ratio <= REFUSED[1],
    )
