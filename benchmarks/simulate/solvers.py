"""How many cells do our full-wave solver and gprMax advance per second on one core, and do their fields agree?

python -m benchmarks.simulate.solvers --json

The place is the closet with its default cells. Our solver runs eight elements side by side, gprMax one. The time of
gprMax is the difference of two runs of different lengths, so that its start does not count. The fields are compared in
a smaller place.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from benchmarks.ledger.printing import print_figures
from benchmarks.ledger.smallest_room import smallest_room
from scenes.places.built_in import closet
from scenes.scene.description import Scene
from simulate.fullwave.all_elements import stored_field
from simulate.fullwave.cells import edge_materials
from simulate.fullwave.element_fields import element_source
from simulate.fullwave.gprmax import installed_gprmax, run, write_geometry
from simulate.fullwave.leapfrog import advance, cells_at_rest
from simulate.fullwave.run_plan import Plan, default_cell, plan


def cells_per_second(scene: Scene, planned: Plan, sources: int, steps: int) -> float:
    """Cells times sources that our solver advances per second."""
    cells = cells_at_rest(edge_materials(scene, planned.grid), planned.grid, sources)
    cells.fields[:] = 1e-3 * np.random.default_rng(0).standard_normal(cells.fields.shape).astype(np.float32)
    times = []
    for _ in range(steps + 1):
        began = time.perf_counter()
        advance(cells, 0)
        advance(cells, 1)
        times.append(time.perf_counter() - began)
    return planned.grid.cells * sources * steps / sum(times[1:])  # the first one compiles


def cells_per_second_of_gprmax(scene: Scene, planned: Plan, steps: int) -> float:
    """Cells that gprMax advances per second, for its one source."""
    seconds = []
    with tempfile.TemporaryDirectory() as folder:
        geometry = Path(folder) / "geometry"
        geometry.mkdir()
        write_geometry(geometry, edge_materials(scene, planned.grid), planned.grid)
        for count in (100, 100 + steps):
            working = Path(folder) / str(count)
            working.mkdir()
            began = time.perf_counter()
            run(working, geometry, planned.grid, element_source(planned, 0), planned.box, [count])
            seconds.append(time.perf_counter() - began)
    return planned.grid.cells * steps / (seconds[1] - seconds[0])


def difference_db(scene: Scene, planned: Plan) -> float:
    """Difference of the two solvers' fields in the region, relative to the field."""
    with tempfile.TemporaryDirectory() as folder:
        ours, theirs = (
            stored_field(planned, Path(folder) / solver, solver=solver).values for solver in ("bisplat", "gprMax")
        )
    return float(20 * np.log10(np.linalg.norm(ours - theirs) / np.linalg.norm(theirs)))


def main(smallest: bool = False, json_output: Annotated[bool, tyro.conf.arg(name="json")] = False) -> None:
    """Time both solvers."""
    small = smallest_room()
    small_plan = plan(small, small.transmitter.region, 0.024 if smallest else 0.02)
    scene, steps = (small, 20) if smallest else (closet(), 200)
    planned = small_plan if smallest else plan(scene, scene.transmitter.region, default_cell(scene))
    ours = {
        f"million cells a second, {count} at once": round(cells_per_second(scene, planned, count, steps // 4) / 1e6)
        for count in (1, 4, 8)
    }
    theirs = cells_per_second_of_gprmax(scene, planned, 10 * steps if smallest else steps) / 1e6
    result: dict[str, Any] = {
        "bisplat": ours,
        installed_gprmax("this benchmark"): {"million cells a second": round(theirs)},
        "ratio": round(ours["million cells a second, 8 at once"] / theirs, 1),
        "difference_db": round(difference_db(small, small_plan), 1),
    }
    print_figures(result, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
