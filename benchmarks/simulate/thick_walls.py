"""Are walls better traced as the boxes that they are drawn as, or as one sheet each?

python -m benchmarks.simulate.thick_walls --json

A wall of a material of ITU-R P.2040 stands alone between a gateway of two dipoles and a region 0.3 m behind it, and a
small room has walls, floor and ceiling of concrete around both. All are drawn as closed boxes. Full wave fills the
boxes. Rays are traced through the boxes as drawn, through one sheet in the middle of each, and through the sheets that
the import makes, which lie on the inner faces of outer walls.

The figures are the error of the rays (norm of rays minus full wave, over that of full wave) and the ratio of their
power to that of full wave in decibels.
"""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro

from benchmarks.ledger.printing import print_figures
from scenes.importing.thick_walls import walls_as_sheets
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.materials import p2040_materials
from scenes.scene.orientation import facing
from scenes.scene.shapes import box
from simulate.fullwave.all_elements import stored_field
from simulate.fullwave.run_plan import plan
from simulate.rays.core.propagation import Propagation
from simulate.rays.tracer import Tracer

CELL = 0.025
WALLS = {"concrete": 0.2, "wood": 0.05}
"""Materials and drawn thicknesses, metres."""


def alone(material: str, thickness: float) -> Scene:
    """A wall of 2 × 1.6 m, in front of the region."""
    wall = SceneObject("wall", box((0, -1, 0), (thickness, 1, 1.6)), material)
    gateway = Gateway((-0.5, 0.05, 0.83), facing((1, 0, 0)), rows=1, columns=2, pattern="dipole")
    region = Transmitter((thickness + 0.3, -0.3, 0.6), (thickness + 0.7, 0.3, 1.0), pattern="dipole")
    return Scene(f"{material} wall", 915e6, gateway, region, (wall,), p2040_materials([material], 915e6))


def room() -> Scene:
    """A room of 2 × 1.6 × 1.6 m, inside."""
    t, x, y, z = 0.2, 2.0, 1.6, 1.6
    boxes = {
        "floor": ((-t, -t, -t), (x + t, y + t, 0)),
        "ceiling": ((-t, -t, z), (x + t, y + t, z + t)),
        "south": ((-t, -t, 0), (x + t, 0, z)),
        "north": ((-t, y, 0), (x + t, y + t, z)),
        "west": ((-t, 0, 0), (0, y, z)),
        "east": ((x, 0, 0), (x + t, y, z)),
    }
    objects = tuple(SceneObject(name, box(*corners), "concrete") for name, corners in boxes.items())
    gateway = Gateway((0.4, 0.82, 0.9), facing((1, 0, 0)), rows=1, columns=2, pattern="dipole")
    region = Transmitter((1.0, 0.4, 0.5), (1.6, 1.2, 1.1), pattern="dipole")
    return Scene("room", 915e6, gateway, region, objects, p2040_materials(["concrete"], 915e6))


def in_the_middle(sheets: Scene, boxes: Scene) -> Scene:
    """All sheets in the middle of their boxes, those of outer walls, too."""
    objects = []
    for sheet, drawn in zip(sheets.objects, boxes.objects, strict=True):
        mesh = sheet.mesh.copy().apply_translation(drawn.mesh.bounds.mean(axis=0) - sheet.mesh.bounds.mean(axis=0))
        objects.append(replace(sheet, mesh=mesh))
    return replace(sheets, objects=tuple(objects))


def compared(scene: Scene, positions: int, cell: float, propagation: Propagation) -> dict[str, float]:
    """Errors and levels of the rays, by how the walls are traced."""
    region = scene.transmitter.region
    places = np.random.default_rng(0).uniform(*region, (positions, 3))
    with tempfile.TemporaryDirectory() as folder:
        full = stored_field(plan(scene, region, cell), Path(folder), at_once=1).responses(places)
    sheets, _ = walls_as_sheets(scene)
    drawings = {"as drawn": scene, "sheets in the middle": in_the_middle(sheets, scene), "as sheets": sheets}
    figures: dict[str, float] = {}
    for name, drawing in drawings.items():
        rays = Tracer(drawing, propagation).responses(places)
        figures[f"error {name}"] = round(float(np.linalg.norm(rays - full) / np.linalg.norm(full)), 3)
        level = 20 * np.log10(np.linalg.norm(rays) / np.linalg.norm(full))
        figures[f"level {name} (dB)"] = round(float(level), 2)
    return figures


def main(
    positions: int = 300, smallest: bool = False, json_output: Annotated[bool, tyro.conf.arg(name="json")] = False
) -> None:
    """Compare rays through boxes and through sheets with full wave."""
    if smallest:
        quick = Propagation(max_depth=2, diffraction=False, rays=10_000)
        wall = replace(alone("wood", 0.05), gateway=Gateway((-0.5, 0, 1), facing((1, 0, 0)), 1, 1, pattern="dipole"))
        print_figures({wall.name: compared(wall, 5, 0.03, quick)}, json_output, smallest)
        return
    scenes = [*(alone(material, thickness) for material, thickness in WALLS.items()), room()]
    print_figures(
        {scene.name: compared(scene, positions, CELL, Propagation()) for scene in scenes}, json_output, smallest
    )


if __name__ == "__main__":
    tyro.cli(main)
