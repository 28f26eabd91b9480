"""Several frequencies from one run of full wave, against a run of each, and a closed box to try it in."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from jaxtyping import Float

from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.materials import p2040_materials
from scenes.scene.orientation import facing
from scenes.scene.shapes import sheet


def off_db(found: np.ndarray, truth: np.ndarray) -> float:
    """Root mean square difference relative to the truth, dB."""
    return round(float(20 * np.log10(np.linalg.norm(found - truth) / np.linalg.norm(truth))), 1)


def one_run_of(
    scenes: list[Scene], own: int, positions: Float[np.ndarray, "K 3"], cell: float
) -> tuple[float, list[tuple[float, float, float]]]:
    """One run of one element for several frequencies, against runs of each of them with its own materials."""
    from simulate.fullwave.cells import edge_materials
    from simulate.fullwave.element_fields import element_fields
    from simulate.fullwave.frequency_groups import index_difference
    from simulate.fullwave.run_plan import plan

    def run(place: Scene, *further: Scene) -> tuple[Any, float]:
        planned = plan(place, place.transmitter.region, cell, None, further)
        materials = edge_materials(place, planned.grid)
        began = time.process_time()
        field = element_fields(planned, [0], materials)[0]
        return field, time.process_time() - began

    middle, others = scenes[own], [each for number, each in enumerate(scenes) if number != own]
    (_, one), (field, whole) = run(middle), run(middle, *others)
    together = field.by_frequency(middle.frequency)
    errors = []
    for each in others:
        alone, _ = run(each)
        error = off_db(together[each.frequency].responses(positions), alone.responses(positions))
        errors.append((each.frequency, index_difference(middle, each, cell), error))
    return whole / one, errors


def closed_box(frequency: float) -> Scene:
    """A box of 1.4 × 1.1 × 0.9 m whose sides are of five materials, with a pane of glass in it."""
    x, y, z = 1.4, 1.1, 0.9
    sides = {
        "floor": (sheet((0, 0, 0), (x, 0, 0), (0, y, 0)), "concrete"),
        "ceiling": (sheet((0, 0, z), (x, 0, 0), (0, y, 0)), "plasterboard"),
        "south": (sheet((0, 0, 0), (x, 0, 0), (0, 0, z)), "brick"),
        "north": (sheet((0, y, 0), (x, 0, 0), (0, 0, z)), "wood"),
        "west": (sheet((0, 0, 0), (0, y, 0), (0, 0, z)), "concrete"),
        "east": (sheet((x, 0, 0), (0, y, 0), (0, 0, z)), "glass"),
        "pane": (sheet((0.75, 0, 0), (0, 0.5, 0), (0, 0, 0.6)), "glass"),
    }
    objects = tuple(SceneObject(name, mesh, material) for name, (mesh, material) in sides.items())
    materials = p2040_materials(["concrete", "plasterboard", "brick", "wood", "glass"], frequency)
    gateway = Gateway((1.15, 0.5, 0.5), facing((-1, 0, 0)), rows=1, columns=1, pattern="dipole")
    region = Transmitter((0.25, 0.3, 0.3), (0.6, 0.75, 0.6), pattern="dipole")
    return Scene("box", frequency, gateway, region, objects, materials)
