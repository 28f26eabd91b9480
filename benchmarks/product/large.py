"""How much time and memory do commands need for large files?

python -m benchmarks.product.large --json

Measured are seconds and peak memory (GB). ``bisplat check`` and ``bisplat train`` (the default model) read 50,000
spectra of the closet in full wave. ``bisplat scene`` reads STL files of a wavy ground: one with as many triangles as a
scene may have, and one with 5 million, which is refused. The dataset is kept in a folder for the next run.
"""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro

from benchmarks.ledger.commands import measured
from benchmarks.ledger.printing import print_figures
from scenes.scene.description import MOST_TRIANGLES

PLACE = "--gateway 15 15 9 --boresight 1 0 0 --region-min 20 10 4 --region-max 25 20 5 --default-material concrete"


def write_ground(path: Path, triangles: int) -> None:
    """Write a binary STL file of a wavy ground of 30 × 30 m."""
    side = int(np.ceil(np.sqrt(triangles / 2)))
    along = np.linspace(0, 30, side + 1, dtype=np.float32)
    x, y = np.meshgrid(along, along, indexing="ij")
    points = np.stack([x, y, np.sin(x) * np.sin(y)], axis=-1)
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    corners = np.stack([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)], axis=2).reshape(-1, 9)[:triangles]
    records = np.zeros(len(corners), [("normal", "<f4", 3), ("corners", "<f4", 9), ("none", "<u2")])
    records["corners"] = corners
    path.write_bytes(bytes(80) + np.uint32(len(records)).tobytes() + records.tobytes())


def main(
    folder: Path = Path("runs/large"),
    spectra: int = 50_000,
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Measure what large datasets and meshes take."""
    least, most = MOST_TRIANGLES, 5_000_000
    with tempfile.TemporaryDirectory() as temporary:
        work = Path(temporary)
        if smallest:
            folder, spectra, least = work / "large", 10, 200
        dataset = str(folder / "dataset")
        simulate = ["simulate", "closet", "-n", str(spectra), "-o", dataset, "--engine", "fullwave"]
        measured(*simulate, "--field", "tests/data/closet")
        figures = {f"bisplat check, {spectra} spectra": measured("check", dataset)}
        figures[f"bisplat train, {spectra} spectra"] = measured("train", dataset, "-o", str(work / "run"))
        shutil.rmtree(work / "run")
        for triangles, status in ((least, 0), (most, 1)):
            write_ground(work / "ground.stl", triangles)
            command = ["scene", str(work / "ground.stl"), "-o", str(work / "scene"), *PLACE.split()]
            found = "imported and drawn" if status == 0 else "refused"
            figures[f"bisplat scene, {triangles} triangles, {found}"] = measured(*command, status=status)
    print_figures(figures, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
