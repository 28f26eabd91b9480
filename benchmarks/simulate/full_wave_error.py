"""How far is full wave itself from the truth in random rooms: with finer cells, and turned against the grid?

python -m benchmarks.simulate.full_wave_error --json > runs/full_wave_error.json

The judge of ``random_rooms.py`` has cells of 2.5 cm, a thirteenth of a wavelength. Waves along their axes are a little
too short on them, diagonal ones too long, and turned and curved surfaces are staircases. Here some rooms are solved
again: with cells of 1.5 cm, and turned by 45° about the vertical together with their antennas, so that what was along
the axes is now a staircase, and the other way round. Correlations are over the whole field, of 400 positions. A room
takes about 10 minutes; what was solved is kept.

"dispersed rays" have the error of the cells: the phase of each path is that of its length with the wavenumbers that
waves in its directions have on cells of 2.5 cm (``simulate.fullwave.yee_grid``). Where they are much nearer to full
wave than rays, the judge errs. For two larger places this is the only figure, since finer cells would take hours there.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any

import numpy as np
import tyro
from jaxtyping import Complex, Float
from scipy.spatial.transform import Rotation
from trimesh import Trimesh

from benchmarks.ledger.printing import print_figures
from benchmarks.ledger.smallest_room import smallest_room
from benchmarks.ledger.solved_rooms import CELL, LARGER, POSITIONS, correlation, of_one_element, scene_of, solved
from scenes.scene.description import Scene
from simulate.fullwave.yee_grid import frequencies_on_grid, numerical_frequency
from simulate.positions.placement import place
from simulate.rays.core.propagation import Propagation
from simulate.rays.tracer import Tracer

FINE, TURN = 0.015, 45.0
"""Size of the finer cells, metres; angle by which rooms are turned, degrees."""

ROOMS = 14, 38, 25
"""The two rooms for finding faults and the one for judging where rays and full wave are farthest apart."""


def turned(scene: Scene, places: Float[np.ndarray, "K 3"], degrees: float) -> tuple[Scene, Float[np.ndarray, "K 3"]]:
    """A scene and positions in it, turned about the vertical axis of the world."""
    turn = Rotation.from_euler("z", degrees, degrees=True)
    meshes = [Trimesh(turn.apply(item.mesh.vertices), item.mesh.faces, process=False) for item in scene.objects]
    corners = turn.apply(scene.transmitter.corners())
    gateway = replace(
        scene.gateway,
        position=tuple(turn.apply(scene.gateway.position)),
        orientation=tuple((turn * Rotation.from_quat(scene.gateway.orientation)).as_quat()),
    )
    transmitter = replace(
        scene.transmitter,
        region_min=tuple(corners.min(axis=0)),
        region_max=tuple(corners.max(axis=0)),
        orientation=tuple((turn * Rotation.from_quat(scene.transmitter.orientation)).as_quat()),
    )
    objects = tuple(replace(item, mesh=mesh) for item, mesh in zip(scene.objects, meshes, strict=True))
    return replace(scene, gateway=gateway, transmitter=transmitter, objects=objects), turn.apply(places)


def wavenumber_error(directions: Float[np.ndarray, "n 3"], wavelength: float, cell: float) -> Float[np.ndarray, " n"]:
    """Relative error of the wavenumber of waves in some directions: above 0 along an axis, below along a diagonal."""
    frequencies = frequencies_on_grid(2 * np.pi / wavelength * directions, cell)
    return numerical_frequency(wavelength, cell) / frequencies - 1


def dispersed(tracer: Tracer, places: Float[np.ndarray, "K 3"], cell: float) -> Complex[np.ndarray, " K"]:
    """Responses of the middle element by rays whose paths have the phases of waves on cells."""
    wavelength = tracer.ray_scene.description.wavelength
    result = np.zeros(len(places), np.complex128)
    for terms in tracer.middle_multipath(places):
        steps = np.diff(terms.vertices, axis=1)
        lengths = np.linalg.norm(steps, axis=-1)
        there = lengths > 0  # paths of fewer vertices repeat the last one
        excess = np.zeros(lengths.shape)
        excess[there] = lengths[there] * wavenumber_error(steps[there] / lengths[there][:, None], wavelength, cell)
        phases = 2 * np.pi / wavelength * excess.sum(axis=1)
        np.add.at(result, terms.targets, terms.responses * np.exp(-1j * phases))
    return result


def main(
    rooms: tuple[int, ...] = ROOMS,
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Solve random rooms again with finer cells, and turned."""
    cell, fine, positions, propagation = CELL, FINE, POSITIONS, Propagation()
    if smallest:
        rooms, cell, fine, positions = rooms[:1], 0.024, 0.02, 5
        propagation = Propagation(max_depth=1, diffraction=False, rays=1000)
    result: dict[str, Any] = {}
    seeds: tuple[int | str, ...] = (*rooms, *LARGER)
    for seed in seeds:
        scene = of_one_element(smallest_room() if smallest else scene_of(seed))
        places = place(scene, "uniform", positions, 0)
        tracer = Tracer(scene, propagation)
        rays = tracer.responses(places).ravel()
        coarse = solved(scene, places, cell, keep=not smallest)
        near = round(correlation(rays, coarse), 3), round(correlation(dispersed(tracer, places, cell), coarse), 3)
        if isinstance(seed, str):
            result[seed] = {"rays and full wave": near[0], "dispersed rays and full wave": near[1]}
            continue
        other = solved(*turned(scene, places, TURN), cell, keep=not smallest)
        finer = solved(scene, places, fine, keep=not smallest)
        result[f"room {seed}"] = {
            "rays and full wave": near[0],
            "dispersed rays and full wave": near[1],
            "rays and full wave turned": round(correlation(rays, other), 3),
            "rays and finer full wave": round(correlation(rays, finer), 3),
            "full wave and turned": round(correlation(coarse, other), 3),
            "full wave and finer": round(correlation(coarse, finer), 3),
        }
    print_figures(result, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
