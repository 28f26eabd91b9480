"""Furniture of the built-in places, in the form that suits the ray tracer.

Geometric optics holds for surfaces of about a wavelength (33 cm at 915 MHz) and more. Legs, edges, feet and chairs are
left out, since they do not reflect like mirrors. A board is one sheet, not a box: the ray tracer's material already is
a slab with a thickness, and two faces would make it two slabs.
"""

from __future__ import annotations

from collections.abc import Sequence

from trimesh import Trimesh

from scenes.scene.description import Gateway, Scene, SceneObject, Transmitter
from scenes.scene.materials import p2040_materials
from scenes.scene.shapes import rotate, sheet, union

FREQUENCY = 915e6  # Hz, the RFID band of NeRF²'s measurements


def furnished(name: str, objects: Sequence[SceneObject], gateway: Gateway, transmitter: Transmitter) -> Scene:
    """A built-in place at 915 MHz, its materials those of ITU-R P.2040."""
    materials = p2040_materials((item.material for item in objects), FREQUENCY)
    return Scene(name, FREQUENCY, gateway, transmitter, tuple(objects), materials)


def table(x: float, y: float, length: float, width: float, height: float = 0.74) -> Trimesh:
    """A table's board, its corner of lowest x and y at (x, y); metres."""
    return sheet((x, y, height), (length, 0, 0), (0, width, 0))


def panel(x: float, y: float, length: float, bottom: float, top: float, degrees: float = 0.0) -> Trimesh:
    """An upright sheet centred on (x, y), along x before it is turned; metres, degrees."""
    return rotate(sheet((x - length / 2, y, bottom), (length, 0, 0), (0, 0, top - bottom)), degrees)


def shelf(x: float, y: float, length: float, width: float, heights: Sequence[float]) -> Trimesh:
    """Horizontal boards one above the other, without sides; metres."""
    return union(*(table(x, y, length, width, height) for height in heights))
