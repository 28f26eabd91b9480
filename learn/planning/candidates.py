"""Candidates for measurements: free places of a scene's region, or places among positions measured before."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.spatial import Delaunay

from scenes.files.errors import InputError
from scenes.scene.description import Scene
from scenes.scene.shapes import bounding_box
from simulate.positions.placement import free_positions

CANDIDATES = 2000
"""Number of candidates. Positions are chosen among them, and the kriging variance is averaged over them."""

FLAT = 1e-6
"""Positions lie in a plane or on a line if their extent along an axis is smaller than this, relative to that along the
longest axis. Coordinates in files have six decimals."""

STREAM = 3
"""Number of the random stream. Datasets and ``crossvalidate`` draw their positions from others, with the same seed."""

TRIES = 100
"""Largest number of draws of ``CANDIDATES`` places each in the box around measured positions, until enough are in the
hull."""


def free_candidates(scene: Scene, seed: int) -> Float[np.ndarray, "N 3"]:
    """Free places of a scene's transmitter region, drawn uniformly, as ``bisplat simulate`` draws positions."""
    return free_positions(scene, scene.transmitter.region, CANDIDATES, np.random.default_rng([seed, STREAM]))


def candidates_among(measured: Float[np.ndarray, "n 3"], seed: int, source: str) -> Float[np.ndarray, "N 3"]:
    """Draw places uniformly from the convex hull of measured positions."""
    centre, axes = extended_axes(measured)
    if not len(axes):
        raise InputError(f"{source}: expected at least two different positions, found one")
    along = (measured - centre) @ axes.T
    low, high = bounding_box(along)
    generator = np.random.default_rng(seed)
    places = np.zeros((0, len(axes)))
    hull = Delaunay(along) if len(axes) > 1 else None  # the hull of positions on a line is the box
    for _ in range(TRIES):
        drawn = low + (high - low) * generator.random((CANDIDATES, len(axes)))
        places = np.concatenate([places, drawn if hull is None else drawn[hull.find_simplex(drawn) >= 0]])[:CANDIDATES]
        if len(places) == CANDIDATES:
            break
    return centre + places @ axes


def extended_axes(positions: Float[np.ndarray, "n 3"]) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, "d 3"]]:
    """The mean of positions, and the unit vectors along which they extend: none, one, two or three."""
    centre = positions.mean(axis=0)
    _, extents, axes = np.linalg.svd(positions - centre, full_matrices=False)
    return centre, axes[extents > FLAT * max(extents[0], FLAT)]
