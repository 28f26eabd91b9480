"""Spectra and primitives on a hemisphere around the gateway, in the gateway's frame."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, UInt8

from learn.colours import PHASE
from learn.model import Splats
from learn.view.chart import LINEAR, Colours, colour_of
from simulate.spectrum import AZIMUTHS_DEG, ELEVATIONS_DEG, direction

EVERY_DEG = 3
"""Degrees between the dots a spectrum is drawn with."""

TURN = Colours(PHASE, -np.pi, np.pi, "")


def dots(radius: float) -> tuple[Float[np.ndarray, "dots 3"], tuple[np.ndarray, np.ndarray]]:
    """Places on the hemisphere, evenly spread, and the pixel of a spectrum (rows, columns) each shows."""
    rows, columns = [], []
    for row in range(0, len(ELEVATIONS_DEG), EVERY_DEG):
        count = max(1, round(len(AZIMUTHS_DEG) / EVERY_DEG * np.cos(np.radians(ELEVATIONS_DEG[row]))))
        columns.append(np.round(np.arange(count) * len(AZIMUTHS_DEG) / count).astype(int))
        rows.append(np.full(count, row))
    pixel = np.concatenate(rows), np.concatenate(columns)
    towards = direction(np.radians(AZIMUTHS_DEG[pixel[1]]), np.radians(ELEVATIONS_DEG[pixel[0]]))
    return radius * towards, pixel


class Ellipses(NamedTuple):
    """Gaussians as viser draws them."""

    centers: Float[np.ndarray, "N_p 3"]
    covariances: Float[np.ndarray, "N_p 3 3"]
    rgbs: UInt8[np.ndarray, "N_p 3"]
    opacities: Float[np.ndarray, "N_p 1"]


def ellipses(splats: Splats, radius: float) -> Ellipses:
    """A model's primitives on the hemisphere: size and turn, opacity, and the coefficient as a colour.

    The colour's hue is the coefficient's phase (the colour map of phases), its brightness the magnitude over the
    largest one.

    Args:
        splats: of one transmitter.
        radius: of the hemisphere, metres.
    """
    azimuth, elevation = (np.radians(axis.double().numpy()) for axis in (splats.azimuth, splats.elevation))
    scale, rotation, opacity, pair = (each[0].double().numpy() for each in splats[3:])
    towards = direction(azimuth, elevation)
    east = np.stack([-np.sin(azimuth), np.cos(azimuth), np.zeros_like(azimuth)], axis=-1)
    north = np.cross(towards, east)
    # On the chart a degree of azimuth is a degree; on the sphere it is shorter by cosθ.
    cosine, sine = np.cos(rotation), np.sin(rotation)
    narrow = np.cos(elevation)
    first = narrow[:, None] * cosine[:, None] * east + sine[:, None] * north
    second = -narrow[:, None] * sine[:, None] * east + cosine[:, None] * north
    axes = radius * np.radians(scale)[:, :, None] * np.stack([first, second], axis=1)
    covariances = np.einsum("nki,nkj->nij", axes, axes)
    coefficient = pair[:, 0] + 1j * pair[:, 1]
    magnitude = np.abs(coefficient) / max(np.abs(coefficient).max(), 1e-12)
    rgbs = (colour_of(np.angle(coefficient), TURN) * (0.2 + 0.8 * magnitude[:, None])).astype(np.uint8)
    return Ellipses(
        (radius * towards).astype(np.float32), covariances.astype(np.float32), rgbs, opacity[:, None].astype(np.float32)
    )


def colours_of_dots(picture: Float[np.ndarray, "90 360"], pixel: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """RGB of each dot."""
    return colour_of(picture[pixel], LINEAR)
