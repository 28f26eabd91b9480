"""Full-wave responses of rooms that several benchmarks use, for an array of one element. What was solved is kept.

The file random_rooms.npz has the responses of each room under a hash of the scene, the positions and the size of the
cells. So an interrupted benchmark continues, and only changed rooms are solved again.
"""

from __future__ import annotations

import hashlib
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Complex, Float

from scenes.places.random_room import random_room
from scenes.scene.description import Scene
from scenes.storage.scene_yaml import load_scene
from simulate.fullwave.all_elements import stored_field
from simulate.fullwave.run_plan import plan

CELL, POSITIONS = 0.025, 400
"""Size of the cells, metres; number of transmitter positions."""

LARGER = "conference", "lab"
"""Built-in places that are larger than the random rooms. Full wave takes a quarter of an hour for each."""

KEPT = Path(__file__).parents[1] / "simulate" / "random_rooms.npz"


def scene_of(seed: int | str) -> Scene:
    """A random room by its seed, or a built-in place by its name, with dipoles as antennas."""
    if isinstance(seed, int):
        return random_room(seed)
    scene = load_scene(seed)
    return replace(
        scene,
        gateway=replace(scene.gateway, pattern="dipole"),
        transmitter=replace(scene.transmitter, pattern="dipole"),
    )


def of_one_element(scene: Scene) -> Scene:
    """The scene with an array of one element, which full wave solves in one run."""
    return replace(scene, gateway=replace(scene.gateway, rows=1, columns=1))


def solved(scene: Scene, places: Float[np.ndarray, "K 3"], cell: float, keep: bool = True) -> Complex[np.ndarray, " K"]:
    """Responses of the array's one element in full wave, kept ones if the room was solved before."""
    name = _key(scene, places, cell)
    kept = _kept() if keep else {}
    if name in kept:
        return kept[name]
    with tempfile.TemporaryDirectory() as folder:
        field = stored_field(plan(scene, scene.transmitter.region, cell), Path(folder), at_once=1)
        found = field.responses(places).ravel().astype(np.complex64)
    if keep:
        np.savez(KEPT, **_kept() | {name: found})  # type: ignore[arg-type]  # read again: another benchmark may have added
    return found


def _kept() -> dict[str, Complex[np.ndarray, " K"]]:
    return dict(np.load(KEPT)) if KEPT.exists() else {}


def correlation(a: Complex[np.ndarray, " K"], b: Complex[np.ndarray, " K"]) -> float:
    """The correlation of two fields over all positions, 0 to 1."""
    return float(abs(np.vdot(a, b)) / (np.linalg.norm(a) * np.linalg.norm(b)))


def _key(scene: Scene, places: Float[np.ndarray, "K 3"], cell: float) -> str:
    """A hash of all that decides a room's responses in full wave."""
    found = hashlib.sha256(repr((scene.gateway, scene.transmitter, scene.frequency, cell)).encode())
    found.update(places.round(6).tobytes())
    for item in scene.objects:
        found.update(repr((scene.materials[item.material], scene.thickness(item))).encode())
        found.update(item.mesh.triangles.round(6).tobytes())
    return found.hexdigest()
