"""How long does full wave take in the closet, has it converged, and how far are the rays from it?

python -m benchmarks.simulate.fullwave --json

Measured are the minutes and the peak memory (GB) of ``bisplat simulate closet --engine fullwave``, and the seconds of
10,000 further spectra from the stored field.

Three comparisons follow, each by median SSIM and by the correlation of the element responses. The correlation is |⟨a,
b⟩| over the product of the norms, as the median over the positions. ``together`` takes the responses of all positions
as one vector.

- Rays as ``bisplat simulate`` traces them are compared with full wave.
- Full wave is compared between cells of three sizes, for the four elements in the middle of the array.
- Rays without diffraction are compared with full wave in the closet without furniture, by depth, for the same elements.

Finished runs are kept in --folder, so an interrupted benchmark continues. The benchmark takes about half an hour on two
cores. No other program should run during the first part, whose minutes are counted.
"""

from __future__ import annotations

import json
import resource
import shutil
import sys
import tempfile
import time
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from benchmarks.ledger.printing import print_figures
from benchmarks.ledger.rays_against_full_wave import compare_engines
from benchmarks.ledger.smallest_room import smallest_room
from learn.quantities.complex_scores import correlation
from scenes.places.built_in import closet
from scenes.scene.description import Scene
from simulate.dataset.dataset import Dataset
from simulate.engines.field_folder import FIELD
from simulate.fullwave.run_plan import default_cell
from simulate.fullwave.stored_field import read_stored_field
from simulate.generation.simulation import simulate
from simulate.rays.core.propagation import Propagation

FURNITURE = ("cabinet", "panel", "table", "shelf")

WORKERS = 2
"""Runs of the solver at a time."""

DEPTHS = {f"depth {depth}": Propagation(max_depth=depth, diffraction=False) for depth in (0, 1, 2, 3, 5)}


class Clock:
    """Counts the seconds of work that may be interrupted, and its peak memory, and keeps both in a file."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.seconds, self.memory = json.loads(path.read_text()) if path.exists() else (0.0, 0.0)
        if self.seconds is None:
            raise SystemExit(
                f"{path}: expected seconds, found that a run was killed before it wrote them; delete {path.parent}"
            )

    def __enter__(self) -> Clock:
        self.path.write_text(json.dumps([None, None]))  # until the end
        self.began = time.perf_counter()
        return self

    def __exit__(self, *_: object) -> None:
        self.seconds += time.perf_counter() - self.began
        self.memory = max(self.memory, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6)
        self.path.write_text(json.dumps([self.seconds, self.memory]))


def four_elements(scene: Scene) -> Scene:
    """The scene with the four elements in the middle of its array of 4 × 4."""
    return replace(scene, gateway=replace(scene.gateway, rows=2, columns=2))


MIDDLE = [5, 6, 9, 10]
"""Numbers of these elements in the whole array."""


def agreement(first: np.ndarray, second: np.ndarray) -> dict[str, float]:
    """Correlation of two sets of responses [K, elements]."""
    return {
        "median": round(float(np.median(correlation(first, second))), 4),
        "together": round(float(correlation(first.reshape(1, -1), second.reshape(1, -1))[0]), 4),
    }


def main(
    folder: Path = Path("runs/fullwave"),
    positions: int = 400,
    ship: Path | None = None,
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Simulate the closet in full wave, with other cells, and without furniture."""
    scene, further, depths, rays = closet(), 10_000, DEPTHS, Propagation()
    if smallest:
        scene, positions, further = smallest_room(), 5, 20
        rays = Propagation(max_depth=1, rays=10_000, diffraction=False)
        depths = {"depth 1": rays}
        folder = Path(tempfile.mkdtemp())
    folder.mkdir(parents=True, exist_ok=True)
    cell = default_cell(scene) * (1.2 if smallest else 1)

    clock = Clock(folder / "seconds.json")
    with nullcontext() if (folder / "closet" / FIELD).exists() else clock:
        truth = simulate(scene, folder / "closet", positions, engine="fullwave", cell=cell, workers=WORKERS)
    if ship is not None:
        ship.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(truth.folder / "metadata.json", ship / "metadata.json")
        read_stored_field(truth.folder / FIELD).thinned(3).write(ship / FIELD)
    began = time.perf_counter()
    with tempfile.TemporaryDirectory() as more:
        simulate(scene, more, further, engine="fullwave", field=truth.folder)
    seconds_further = time.perf_counter() - began

    def with_four(name: str, place: Scene, side: float) -> Dataset:
        few = place if smallest else four_elements(place)
        where = truth.positions
        return simulate(few, folder / name, positions=where, engine="fullwave", cell=side, workers=WORKERS)

    finer, coarser = (with_four(f"cells-{ratio}", scene, ratio * cell) for ratio in (0.75, 1.25))
    shell = tuple(item for item in scene.objects if item.name not in FURNITURE)
    empty = with_four("empty", replace(scene, name="empty", objects=shell), cell)
    middle = truth.responses if smallest else truth.responses[:, MIDDLE]
    converged, coarse = agreement(finer.responses, middle), agreement(coarser.responses, middle)

    found = compare_engines(truth.folder, rays, positions).metrics()
    without = {name: compare_engines(empty.folder, each, positions).metrics() for name, each in depths.items()}
    keys = ("correlation_rays", "correlation_rays_together", "ssim_rays", "level_bias_db")
    result: dict[str, Any] = {
        "minutes": round(clock.seconds / 60, 1),
        "peak_memory_gb": round(clock.memory, 2),
        f"seconds_of_{further}_further_spectra": round(seconds_further, 1),
        "correlation_rays": round(found["correlation_rays"], 4),
        "ssim_rays": round(found["ssim_rays"], 4),
        "correlation_converged": converged["median"],
        "correlation_converged_together": converged["together"],
        "correlation_of_coarser_cells": coarse["median"],
        "cell_mm": round(1e3 * cell, 2),
        "rays without furniture": {
            name: {key: round(value[key], 4) for key in keys} for name, value in without.items()
        },
    }
    print_figures(result, json_output, smallest)


if __name__ == "__main__":
    sys.exit(tyro.cli(main))
