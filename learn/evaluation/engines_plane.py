"""Rays against full wave on a horizontal plane: errors by the number of interactions, and where paths end."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Complex, Float, Int

from learn.evaluation.engines import scene_for_rays
from simulate.dataset.dataset_folder import read_dataset
from simulate.engines.engine import Setting
from simulate.engines.fullwave_engine import FullWave
from simulate.rays.core.propagation import Propagation

POINTS_PER_WAVELENGTH = 12
"""Number of points of the plane per wavelength, along x and along y."""


@dataclass(frozen=True)
class EnginePlane:
    """Levels and errors on a horizontal plane through the middle of the transmitter region."""

    name: str  # name of the full-wave dataset's folder
    x: Float[np.ndarray, " nx"]  # x of the points' columns, metres
    y: Float[np.ndarray, " ny"]  # y of the points' rows, metres
    z: float  # height of the plane, metres
    level_db: Float[np.ndarray, "ny nx"]  # power of the full wave's responses, relative to its mean over the plane, dB
    # ``|rays − full wave|²`` relative to the same mean, dB, by the largest number of interactions on a path
    errors_db: dict[int, Float[np.ndarray, "ny nx"]]
    # number of paths with at most one interaction to the element nearest the array's centre. Where it changes, a
    # direct or reflected path ends: there is a shadow boundary or a reflection boundary of geometrical optics.
    paths: Int[np.ndarray, "ny nx"]


def compare_on_plane(folder: Path | str, propagation: Propagation, seed: int = 1) -> EnginePlane:
    """Compare rays with a full-wave dataset's stored field at the points of a plane.

    The rays follow the direct path alone, then at most one interaction, then as many as ``propagation`` allows.
    """
    dataset = read_dataset(folder)
    scene = scene_for_rays(dataset)
    (x_low, y_low, z_low), (x_high, y_high, z_high) = scene.transmitter.region
    step = scene.wavelength / POINTS_PER_WAVELENGTH
    x, y = (
        np.linspace(low, high, 1 + int(np.ceil((high - low) / step)))
        for low, high in ((x_low, x_high), (y_low, y_high))
    )
    z = (z_low + z_high) / 2
    columns, rows = np.meshgrid(x, y)
    points = np.stack([columns.ravel(), rows.ravel(), np.full(columns.size, z)], axis=1)
    full_wave = FullWave.kept(Setting(scene, scene.transmitter.region, seed), dataset.folder).responses(points)
    mean = float((np.abs(full_wave) ** 2).sum(axis=1).mean())

    def decibels(responses: Complex[np.ndarray, "K elements"]) -> Float[np.ndarray, "ny nx"]:
        power = (np.abs(responses) ** 2).sum(axis=1) / mean
        return 10 * np.log10(np.maximum(power, 1e-12)).reshape(columns.shape)

    from simulate.rays.tracer import Tracer

    depth = min(1, propagation.max_depth)
    geometric = replace(propagation, max_depth=depth, diffuse=False, diffraction=False, sionna=False)
    followed = {depth: replace(propagation, max_depth=depth) for depth in sorted({0, depth, propagation.max_depth})}
    tracers = {each: Tracer(scene, each, None, seed) for each in {*followed.values(), geometric}}
    return EnginePlane(
        name=Path(folder).resolve().name,
        x=x,
        y=y,
        z=z,
        level_db=decibels(full_wave),
        errors_db={depth: decibels(tracers[each].responses(points) - full_wave) for depth, each in followed.items()},
        paths=np.count_nonzero(tracers[geometric].middle_by_chain(points), axis=1).reshape(columns.shape),
    )
