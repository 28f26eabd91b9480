"""A place for the smallest runs of benchmarks with full wave."""

from __future__ import annotations

from dataclasses import replace

from scenes.places.built_in import closet
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.orientation import facing
from scenes.scene.shapes import sheet


def smallest_room() -> Scene:
    """A floor and one object beside it, small enough for a run of seconds."""
    place = closet()
    floor = SceneObject("floor", sheet((0, 0, 0), (0.8, 0, 0), (0, 0.5, 0)), "concrete")
    panel = SceneObject("panel", sheet((0.0, 0.4, 0.0), (0.3, 0, 0), (0, 0, 0.3)), "metal")
    gateway = Gateway((0.7, 0.25, 0.25), facing((-1, 0, 0)), rows=1, columns=1, pattern="dipole")
    region = Transmitter((0.2, 0.2, 0.2), (0.3, 0.3, 0.3), pattern="dipole")
    return replace(place, name="smallest", gateway=gateway, transmitter=region, objects=(floor, panel))
