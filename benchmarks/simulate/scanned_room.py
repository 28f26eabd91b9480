"""Are spectra in a scanned room, whose walls the import makes planes, those in the room without noise?

python -m benchmarks.simulate.scanned_room --json

A room of 6 × 4 × 2.7 m with three boxes is cut into triangles, which lose holes of 3 to 20 cm radius, and whose corners
get Gaussian noise. Rays without diffraction are traced in what ``flattened`` makes of it, and in the room as it was
drawn, at 2.4 GHz. The figures are the correlation of the element responses, its median and lowest value over positions.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import numpy as np
import trimesh
import tyro
from trimesh import Trimesh

from benchmarks.ledger.printing import print_figures
from scenes.importing.flattening import flattened
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import Scene, SceneObject
from scenes.scene.materials import p2040_materials
from scenes.scene.orientation import facing
from scenes.scene.shapes import box, union
from simulate.rays.core.propagation import Propagation
from simulate.rays.tracer import Tracer

HOLES = 60


def drawn() -> Scene:
    """The room with its furniture, as one mesh."""
    walls = box((0, 0, 0), (6, 4, 2.7))
    walls.invert()
    boxes = [((0.5, 2.9, 0), (2, 3.5, 0.75)), ((4.8, 0.2, 0), (5.6, 0.7, 1.9)), ((2.5, 0.3, 0), (4.2, 1.1, 0.8))]
    mesh = union(walls, *(box(*corners) for corners in boxes))
    gateway, region = Gateway((0.5, 0.8, 1.6), facing((1, 0.3, 0))), Transmitter((2.4, 1.5, 1), (4, 2.6, 1.6))
    return Scene("room", 2.4e9, gateway, region, (SceneObject("room", mesh, "concrete"),), p2040_materials(None, 2.4e9))


def scanned(mesh: Trimesh, edge: float, noise: float) -> Trimesh:
    """The mesh with triangles no longer than an edge, with holes and noise, metres."""
    random = np.random.default_rng(0)
    fine = Trimesh(*trimesh.remesh.subdivide_to_size(mesh.vertices, mesh.faces, edge))
    for centre in fine.triangles_center[random.choice(len(fine.faces), HOLES)]:
        fine.update_faces(np.linalg.norm(fine.triangles_center - centre, axis=1) > random.uniform(0.03, 0.2))
    fine.vertices += random.normal(0, noise, fine.vertices.shape)
    return fine


def main(
    positions: int = 100, smallest: bool = False, json_output: Annotated[bool, tyro.conf.arg(name="json")] = False
) -> None:
    """Compare responses in scans with those in the room as it was drawn."""
    scene = drawn()
    propagation = Propagation(max_depth=1 if smallest else 3, diffraction=False)
    places = np.random.default_rng(1).uniform(*scene.transmitter.region, (5 if smallest else positions, 3))
    true = Tracer(scene, propagation).responses(places)
    figures = {}
    for edge, noise in [(0.2, 0.006)] if smallest else [(0.2, 0.006), (0.07, 0.002), (0.07, 0.006), (0.07, 0.01)]:
        scan = scanned(scene.objects[0].mesh, edge, noise)
        found = flattened(replace(scene, objects=(replace(scene.objects[0], mesh=scan),)), None)
        seen = Tracer(found.scene, propagation).responses(places)
        norms = np.linalg.norm(true, axis=1) * np.linalg.norm(seen, axis=1)
        correlation = np.abs((true.conj() * seen).sum(axis=1)) / norms
        figures[f"{1000 * noise:g} mm of noise, {len(scan.faces)} triangles"] = {
            "triangles afterwards": len(found.scene.objects[0].mesh.faces),
            "correlation, median": round(float(np.median(correlation)), 4),
            "correlation, lowest": round(float(correlation.min()), 4),
        }
    print_figures(figures, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
