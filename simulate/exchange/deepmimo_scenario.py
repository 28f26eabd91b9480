"""The files of a DeepMIMO 4 scenario folder: a matrix for each quantity, params.json, and the scene."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Int

from scenes.files.atomic import write_atomically, written_atomically
from scenes.scene.description import SPEED_OF_LIGHT, Scene
from simulate.engines.rays_engine import Rays
from simulate.generation.request import Request
from simulate.rays.core.multipath import Interaction, Multipath
from simulate.rays.core.propagation import MOST_PASSES

DIGITS = {
    Interaction.REFLECTION: 1,
    Interaction.DIFFRACTION: 2,
    Interaction.SCATTERING: 3,
    Interaction.TRANSMISSION: 4,
}
"""DeepMIMO's code for each interaction."""

MOST_INTERACTIONS = 15
"""Most interactions of a path that are listed, one digit each: so many digits are exact in double precision."""


class PathList(NamedTuple):
    """Paths from an element, DeepMIMO's transmitter, to positions, its receivers."""

    receivers: Int[np.ndarray, " paths"]  # index of each path's position
    responses: Complex[np.ndarray, " paths"]  # a e^{−j2πfτ}
    delays: Float[np.ndarray, " paths"]  # τ, seconds
    # direction in which the path leaves the element, world frame; not of unit length
    departures: Float[np.ndarray, "paths 3"]
    # direction from which the path reaches the position, world frame; not of unit length
    arrivals: Float[np.ndarray, "paths 3"]
    # DeepMIMO's codes of the interactions, from the element on, as the digits of one number; 0 for the line of sight
    codes: Float[np.ndarray, " paths"]
    # places of the interactions, metres, world frame; not a number after the last one
    points: Float[np.ndarray, "paths MOST_INTERACTIONS 3"]


def path_list(terms: Multipath) -> PathList:
    """The paths of a batch that contribute to a response, with their first ``MOST_INTERACTIONS`` interactions."""
    carrying = terms.responses != 0
    terms = Multipath(*(each[carrying] for each in terms))
    happened = terms.kinds != Interaction.NONE
    last = np.arange(len(terms.targets)), happened.sum(axis=1)  # index of the last vertex before the position
    table = np.zeros(max(DIGITS) + 1)
    table[list(DIGITS)] = list(DIGITS.values())
    codes = np.zeros(len(terms.targets))
    points = np.full((len(terms.targets), MOST_INTERACTIONS, 3), np.nan, np.float32)
    for number, kinds in enumerate(terms.kinds.T[:MOST_INTERACTIONS]):
        codes = np.where(happened[:, number], 10 * codes + table[kinds], codes)
        points[happened[:, number], number] = terms.vertices[happened[:, number], 1 + number]
    return PathList(
        receivers=terms.targets,
        responses=terms.responses,
        delays=terms.lengths() / SPEED_OF_LIGHT,
        departures=terms.vertices[:, 1] - terms.vertices[:, 0],
        arrivals=terms.vertices[last] - terms.vertices[:, -1],
        codes=codes,
        points=points,
    )


def sorted_paths(parts: Iterable[PathList]) -> PathList:
    """All paths as DeepMIMO needs them: by receiver, then line of sight first, then by falling power."""
    numbers, places = np.zeros(0), np.zeros((0, 3))
    nothing = PathList(
        np.zeros(0, int), numbers + 0j, numbers, places, places, numbers, np.zeros((0, MOST_INTERACTIONS, 3), "f4")
    )
    paths = PathList(*(np.concatenate(each) for each in zip(nothing, *parts, strict=True)))
    order = np.lexsort((-np.abs(paths.responses), paths.codes != 0, paths.receivers))
    return PathList(*(each[order] for each in paths))


FORMAT = "4.0.5"  # The version of DeepMIMO whose folder format is written

PAIR = "t000_tx000_r001"
"""Part of the matrices' file names: transmitter 0 of set 0, and the receivers of set 1."""

FLAT = 1e-3
"""Metres. An object of less height is flat. DeepMIMO's test for points on the terrain uses the same limit."""


def write_matrices(
    folder: Path, paths: PathList, element: Float[np.ndarray, " 3"], positions: Float[np.ndarray, "K 3"]
) -> None:
    for name, matrix in _matrices(paths, len(positions)):
        write_matrix(folder / f"{name}_{PAIR}.npz", {name: matrix})
    write_matrix(folder / f"tx_pos_{PAIR}.npz", {"tx_pos": element[None].astype(np.float32)})
    write_matrix(folder / f"rx_pos_{PAIR}.npz", {"rx_pos": positions.astype(np.float32)})


def _matrices(paths: PathList, receivers: int) -> Iterator[tuple[str, np.ndarray]]:
    """Name and values of each matrix [receivers, paths, …]; not a number where a receiver has fewer paths.

    Angles are in the world frame. The azimuth runs from +x towards +y, and the "elevation" from +z.
    """
    first = np.searchsorted(paths.receivers, paths.receivers)
    place = paths.receivers, np.arange(len(paths.receivers)) - first
    columns = place[1].max(initial=0) + 1

    def matrix(values: np.ndarray, dtype: type = np.float32) -> np.ndarray:
        table = np.full((receivers, columns, *values.shape[1:]), np.nan, dtype)
        table[place] = values
        return table

    yield "power", matrix(20 * np.log10(np.abs(paths.responses)))
    yield "phase", matrix(np.angle(paths.responses, deg=True))
    yield "delay", matrix(paths.delays)
    for angle, ways in (("aod", paths.departures), ("aoa", paths.arrivals)):
        yield f"{angle}_az", matrix(np.degrees(np.arctan2(ways[:, 1], ways[:, 0])))
        yield f"{angle}_el", matrix(np.degrees(np.arctan2(np.hypot(ways[:, 0], ways[:, 1]), ways[:, 2])))
    yield "inter", matrix(paths.codes, np.float64)
    used = max(1, int(np.isfinite(paths.points[..., 0]).sum(axis=1).max(initial=0)))
    yield "inter_pos", matrix(paths.points[:, :used])


def write_matrix(path: Path, arrays: dict[str, np.ndarray]) -> None:
    """Write arrays as a compressed .npz, as DeepMIMO 4 itself writes its matrices."""
    with written_atomically(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, **arrays)  # type: ignore[arg-type]


def write_params(folder: Path, request: Request, rays: Rays, reached: int) -> None:
    scene = request.scene
    kinds = sorted({(item.material, scene.thickness(item)) for item in scene.objects})
    params = {
        "version": FORMAT,
        "rt_params": _ray_tracing(request, rays),
        "scene": _write_scene(folder, scene, kinds),
        "materials": {f"material_{number}": _material(scene, number, kind) for number, kind in enumerate(kinds)},
        "txrx_sets": {
            "txrx_set_0": _antennas("gateway", 0, 1, 1),
            "txrx_set_1": _antennas("positions", 1, len(request.positions), reached),
        },
    }
    write_atomically(folder / "params.json", _json(params))


def _json(content: Any) -> bytes:
    return (json.dumps(content, indent=2) + "\n").encode()


def _write_scene(folder: Path, scene: Scene, kinds: list[tuple[str, float]]) -> dict[str, Any]:
    """Write the scene's triangles, in what DeepMIMO calls the mesh representation."""
    meshes = [item.mesh for item in scene.objects]
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    numbers = [kinds.index((item.material, scene.thickness(item))) for item in scene.objects]
    faces = {str(n): (mesh.faces + starts[n]).astype(np.int32) for n, mesh in enumerate(meshes)}
    materials = {str(n): np.full(len(mesh.faces), numbers[n], np.int32) for n, mesh in enumerate(meshes)}
    floor = _floor(scene)
    objects = [
        {"name": item.name, "label": "terrain" if n == floor else "objects", "id": n, "mesh_key": str(n)}
        for n, item in enumerate(scene.objects)
    ]
    vertices = np.concatenate([mesh.vertices for mesh in meshes]).astype(np.float32)
    write_matrix(folder / "vertices.npz", {"vertices": vertices})
    write_matrix(folder / "faces.npz", faces)
    write_matrix(folder / "materials.npz", materials)
    write_atomically(folder / "objects.json", _json(objects))
    triangles = sum(len(mesh.faces) for mesh in meshes)
    return {
        "num_scenes": 1,
        "n_objects": len(objects),
        "n_vertices": len(vertices),
        "n_faces": triangles,
        "n_triangular_faces": triangles,
        "representation": "mesh",
    }


def _floor(scene: Scene) -> int | None:
    """Index of the lowest object that is flat and level; None if there is no such object.

    DeepMIMO finds the object of an interaction only in scenes with one object that is terrain. It counts every point at
    the height of the terrain as a point of it.
    """
    boxes = [(n, *item.mesh.bounds[:, 2], item.mesh.area) for n, item in enumerate(scene.objects)]
    level = [(low, -area, n) for n, low, high, area in boxes if high - low < FLAT]
    return min(level)[2] if level else None


def _material(scene: Scene, number: int, kind: tuple[str, float]) -> dict[str, Any]:
    """DeepMIMO's description of a material with one thickness, metres."""
    material = scene.materials[kind[0]]
    return {
        "id": number,
        "name": kind[0],
        "permittivity": material.relative_permittivity,
        "conductivity": material.conductivity,
        "scattering_model": "lambertian" if material.scattering_coefficient else "none",
        "scattering_coefficient": material.scattering_coefficient,
        "cross_polarization_coefficient": material.xpd_coefficient,
        "thickness": kind[1],
    }


def _antennas(name: str, number: int, points: int, reached: int) -> dict[str, Any]:
    """A set of transmitters (number 0) or receivers (number 1) with one antenna each."""
    return {
        "name": name,
        "id_orig": number,
        "id": number,
        "is_tx": number == 0,
        "is_rx": number == 1,
        "num_points": points,
        "num_active_points": reached,
        "num_ant": 1,
        "dual_pol": False,
        "ant_rel_positions": [[0, 0, 0]],
        "array_orientation": [0, 0, 0],
        "grid_spacing": None,
    }


def _ray_tracing(request: Request, rays: Rays) -> dict[str, Any]:
    """How the paths were traced. ``raw_params`` has this in our own terms, with the antennas at both ends."""
    followed, scene = rays.propagation, request.scene
    depth = followed.max_depth
    passes = (depth if followed.sionna else MOST_PASSES) if followed.refraction else 0
    diffractions = (1 if followed.sionna else 2) if followed.diffraction else 0
    return {
        "raytracer_name": "bisplat-wrf",
        "raytracer_version": version("bisplat-wrf"),
        "frequency": scene.frequency,
        "max_path_depth": depth if followed.sionna else depth + passes,
        "max_reflections": depth if followed.specular else 0,
        "max_diffractions": min(depth, diffractions),
        "max_scattering": min(depth, int(followed.diffuse)),
        "max_transmissions": passes,
        "diffuse_reflections": 0 if not followed.sionna_diffuse else max(0, depth - 1),
        "diffuse_diffractions": 0,
        "diffuse_transmissions": passes if followed.diffuse else 0,
        "diffuse_final_interaction_only": followed.sionna_diffuse,
        "diffuse_random_phases": followed.diffuse,
        "terrain_reflection": followed.specular,
        "terrain_diffraction": followed.diffraction,
        "terrain_scattering": followed.diffuse,
        "num_rays": followed.rays,
        "ray_casting_method": "uniform",
        "synthetic_array": True,
        "ray_casting_range_az": 360.0,
        "ray_casting_range_el": 180.0,
        "gps_bbox": [0, 0, 0, 0],
        "raw_params": request.metadata() | {"gateway": asdict(scene.gateway), "transmitter": asdict(scene.transmitter)},
    }
