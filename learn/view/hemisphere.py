"""Spectra and primitives on a hemisphere about the gateway: where their dots and ellipses are, and their colours."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float, UInt32
from scipy.spatial.transform import Rotation

from learn.models.networks.bisplat import Splats
from learn.reports.plots import PHASE
from learn.view.chart import Colours, colour_of
from simulate.spectra.angular_grid import COLUMNS, ROWS, AngularGrid, direction

EVERY_DEG = 2  # Angle between neighbouring dots of a spectrum, degrees

DOT_DEG = 0.8 * EVERY_DEG
"""Radius of a dot as seen from the middle, degrees. Dots overlap: what shows between them would make a moiré."""

RADIANS = Colours(PHASE, -np.pi, np.pi, "")


def dots(radius: float, grid: AngularGrid) -> tuple[Float[np.ndarray, "dots 3"], tuple[np.ndarray, np.ndarray]]:
    """Dots spread evenly over the hemisphere, which cover it if their radius is ``DOT_DEG``."""
    rows, columns = [], []
    for row in sorted({*range(0, ROWS, EVERY_DEG), ROWS - 1}):  # the last, so that no hole is left around boresight
        count = max(1, round(COLUMNS / EVERY_DEG * np.cos(np.radians(grid.elevations_deg[row]))))
        columns.append(np.round(np.arange(count) * COLUMNS / count).astype(int))
        rows.append(np.full(count, row))
    pixel = np.concatenate(rows), np.concatenate(columns)
    return radius * grid.directions[pixel], pixel


def ellipses(splats: Splats, radius: float) -> dict[str, Any]:
    """A model's primitives as ellipses on the hemisphere, as viser's batched meshes take them.

    The semi-axes of each are one standard deviation. It is a disc of radius 1 in the x–y plane that is stretched, then
    turned by a quaternion (w, x, y, z), then moved, metres in the gateway frame. Its hue is the phase of the
    coefficient, its brightness the magnitude, and its opacity that of the primitive, both divided by the largest.
    """
    azimuth, elevation = (np.radians(axis.double().numpy()) for axis in (splats.azimuth, splats.elevation))
    scale, rotation, opacity, real_imaginary = (each[0].double().numpy() for each in splats[3:])
    towards = direction(azimuth, elevation)
    east = np.stack([-np.sin(azimuth), np.cos(azimuth), np.zeros_like(azimuth)], axis=-1)
    north = np.cross(towards, east)
    # On the sphere, a degree of azimuth is shorter than a degree of elevation by the factor cos θ.
    cosine, sine, azimuth_factor = np.cos(rotation), np.sin(rotation), np.cos(elevation)
    # East and north components of the two axes along which the Gaussian has its standard deviations.
    axis_directions = np.array([[azimuth_factor * cosine, -azimuth_factor * sine], [sine, cosine]])
    axes = radius * np.radians(scale)[:, None] * axis_directions.transpose(2, 0, 1)
    semi_axis_directions, lengths, _ = np.linalg.svd(axes)  # of the ellipse on the sphere
    first = semi_axis_directions[:, 0, 0, None] * east + semi_axis_directions[:, 1, 0, None] * north
    turns = Rotation.from_matrix(np.stack([first, np.cross(towards, first), towards], axis=-1)).as_quat()
    coefficient = real_imaginary[:, 0] + 1j * real_imaginary[:, 1]
    magnitude = np.abs(coefficient) / max(np.abs(coefficient).max(), 1e-12)
    colours = (colour_of(np.angle(coefficient), RADIANS) * (0.2 + 0.8 * magnitude[:, None])).astype(np.uint8)
    stretches = np.concatenate([lengths, np.ones((len(lengths), 1))], axis=1)
    return {
        "batched_positions": (radius * towards).astype(np.float32),
        "batched_wxyzs": np.roll(turns, 1, axis=1).astype(np.float32),
        "batched_scales": stretches.astype(np.float32),
        "batched_colors": colours,
        "batched_opacities": (opacity / opacity.max()).astype(np.float32),
    }


def disc() -> tuple[Float[np.ndarray, "vertices 3"], UInt32[np.ndarray, "faces 3"]]:
    """Vertices and triangles of a disc of radius 1 in the x–y plane."""
    corners = 24
    angle = 2 * np.pi * np.arange(corners) / corners
    rim = np.stack([np.cos(angle), np.sin(angle), np.zeros(corners)], axis=-1)
    index = np.arange(corners)
    faces = np.stack([np.full(corners, corners), index, (index + 1) % corners], axis=-1)
    return np.concatenate([rim, np.zeros((1, 3))]).astype(np.float32), faces.astype(np.uint32)
