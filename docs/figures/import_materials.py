"""A facade of one node and three materials, and what chose the material of each part."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import bisplat
from scenes.importing.formats.mesh_part import ImportedFile, ImportedPart
from scenes.importing.material_rules import choose_materials

windows = [(0.6, 1.8, 1.0, 2.2), (4.2, 5.4, 1.0, 2.2)]
door = (2.5, 3.5, 0.0, 2.1)
origin, x, z = np.diag([0, 0, 0.0]), np.array([6.0, 0, 0]), np.array([0, 0, 3.0])


def pane(opening):
    return bisplat.shapes.sheet(
        (opening[0], 0, opening[2]), (opening[1] - opening[0], 0, 0), (0, 0, opening[3] - opening[2])
    )


wall = bisplat.shapes.sheet((0, 0, 0), x, z, [*windows, door])
parts = [
    ImportedPart("Facade/Brick.001", wall, "Facade", "Brick.001"),
    ImportedPart("Facade/pane", bisplat.shapes.union(*map(pane, windows)), "Facade", "pane"),
    ImportedPart("Facade/paint", pane(door), "Facade", "paint"),
]
choices = choose_materials(ImportedFile(Path("house.glb"), parts, "y"), [("pane", "glass")], "wood", 2.4e9, {})

figure, axis = plt.subplots(figsize=(8, 3.2), layout="constrained")
for part, choice in zip(parts, choices, strict=True):
    for triangle in part.mesh.triangles:
        axis.fill(triangle[:, 0], triangle[:, 2], color=choice.material.color, lw=1)
for row, (part, choice) in enumerate(zip(parts, choices, strict=True)):
    axis.text(6.3, 2.6 - 0.9 * row, part.name, fontsize=9, weight="bold")
    axis.text(6.3, 2.3 - 0.9 * row, f"{choice.material.name}, by {choice.by}", fontsize=9, color="0.3")
    axis.plot(6.1, 2.68 - 0.9 * row, "s", color=choice.material.color, ms=9)
axis.set(xlim=(-0.1, 10.2), ylim=(-0.1, 3.1), aspect="equal", title='--material "pane=glass" --default-material wood')
axis.set_axis_off()
