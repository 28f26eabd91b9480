"""How large must an object be for rays to be right about it?

python -m benchmarks.simulate.object_size --json

A cube of metal or wood hangs between a gateway of 2 × 2 dipoles and a region behind it, 0.7 m from the gateway and 0.1
m from the region. Rays with and without diffraction are compared with full wave, by the side of the cube in
wavelengths. The figures are what the cube changes of the responses (norm of full wave minus free space, over that of
full wave), and the error of the rays (norm of rays minus full wave, over that of full wave).
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from benchmarks.ledger.exact_fields import free_space_response
from benchmarks.ledger.printing import print_figures
from scenes.checks.occupancy import element_positions
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.materials import p2040_materials
from scenes.scene.orientation import facing
from scenes.scene.shapes import box
from simulate.fullwave.all_elements import stored_field
from simulate.fullwave.dipole import element_direction, transmitter_direction
from simulate.fullwave.run_plan import plan
from simulate.rays.core.propagation import Propagation
from simulate.rays.tracer import Tracer

SIDES = (0.25, 0.5, 1.0, 2.0, 3.0)
"""Wavelengths."""

CELL = 0.02
RAYS = {"without diffraction": Propagation(diffraction=False), "with diffraction": Propagation()}


def hanging(material: str, side: float) -> Scene:
    """A cube whose side is given in wavelengths, and whose faces lie on faces of the cells."""
    half = max(1, round(side * 0.3276 / CELL / 2)) * CELL
    cube = SceneObject("cube", box((-half, -half, -half), (half, half, half)), material, 0.02)
    gateway = Gateway((-0.7 - half, 0.05, 0.03), facing((1.0, 0.0, 0.0)), rows=2, columns=2, pattern="dipole")
    region = Transmitter((half + 0.1, -0.5, -0.3), (half + 0.6, 0.5, 0.3), pattern="dipole")
    return Scene("cube", 915e6, gateway, region, (cube,), p2040_materials([material], 915e6))


def compared(scene: Scene, positions: int, cell: float) -> dict[str, float]:
    """What the cube changes, and the errors of the rays."""
    region = scene.transmitter.region
    places = np.random.default_rng(0).uniform(*region, (positions, 3))
    with tempfile.TemporaryDirectory() as folder:
        full = stored_field(plan(scene, region, cell), Path(folder), at_once=2).responses(places)
    up, along = element_direction(scene), transmitter_direction(scene)
    free = np.stack(
        [
            free_space_response(element, up, places, along, scene.frequency)
            for element in element_positions(scene.gateway, scene.wavelength)
        ],
        axis=1,
    )

    def error(found: np.ndarray) -> float:
        return round(float(np.linalg.norm(found - full) / np.linalg.norm(full)), 3)

    return {"changed by the cube": error(free)} | {
        f"error {name}": error(Tracer(scene, each).responses(places)) for name, each in RAYS.items()
    }


def main(
    positions: int = 1000, smallest: bool = False, json_output: Annotated[bool, tyro.conf.arg(name="json")] = False
) -> None:
    """Compare rays with full wave around cubes."""
    result: dict[str, Any] = {}
    for material in ("metal",) if smallest else ("metal", "wood"):
        for side in SIDES[:1] if smallest else SIDES:
            name = f"{material}, {side:g} wavelengths"
            result[name] = compared(hanging(material, side), 5 if smallest else positions, CELL)
    print_figures(result, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
