"""How close does each mechanism of the ray tracer come to full wave in several rooms, and what does it cost?

python -m benchmarks.simulate.mechanisms --figures docs/generated --json

The stored full-wave fields of the rooms are in tests/data, at points 6 or 8 cm apart. The same positions are traced
between the same dipoles. Measured are, by room and mechanism: the correlation of element responses (median over the
positions; ``together``: of all positions' responses as one vector), the median SSIM of the spectra, the median level of
rays over full wave (dB), milliseconds per spectrum, and the seconds of the search for chains.

With --fields of another folder, rooms without a stored field are simulated first, with cells of 2 cm. That takes an
hour on two cores in all. Finished runs are kept in --folder, so an interrupted benchmark continues. --ship writes the
fields.
"""

from __future__ import annotations

import shutil
import tempfile
import time
from contextlib import nullcontext
from pathlib import Path
from typing import Annotated, Any
from unittest.mock import patch

import numpy as np
import tyro
from PIL import Image

from benchmarks.ledger.printing import print_figures
from benchmarks.ledger.rays_against_full_wave import EngineComparison, compare_responses, scene_for_rays
from benchmarks.ledger.smallest_room import smallest_room
from learn.reports.figures import draw_examples
from scenes.places.built_in import bedroom, closet, workshop
from simulate.dataset.dataset import Dataset
from simulate.engines.field_folder import FIELD
from simulate.fullwave.stored_field import read_stored_field
from simulate.generation.simulation import simulate
from simulate.rays.core.propagation import Propagation
from simulate.rays.diffraction.diffraction_chains import NO_LINKS
from simulate.rays.tracer import Tracer
from simulate.spectra.spectrum import evenly, picture, spectrum_of

ROOMS = {"closet": closet, "workshop": workshop, "bedroom": bedroom}
CELL = 0.02

ONCE = "depth 3, one diffraction"
SIONNA = "depth 3, Sionna's diffraction"
SHOWN = "depth 3, diffraction"

MECHANISMS = {
    "line of sight": Propagation(max_depth=0, diffraction=False),
    "depth 1": Propagation(max_depth=1, diffraction=False),
    "depth 2": Propagation(max_depth=2, diffraction=False),
    "depth 3": Propagation(max_depth=3, diffraction=False),
    "depth 5": Propagation(max_depth=5, diffraction=False),
    "depth 3, slabs counted twice": Propagation(max_depth=3, diffraction=False, slab_phase=False),
    SIONNA: Propagation(max_depth=3, sionna=True, rays=30_000),
    ONCE: Propagation(max_depth=3),
    "depth 2, diffraction": Propagation(max_depth=2),
    SHOWN: Propagation(max_depth=3),
    "depth 4, diffraction": Propagation(max_depth=4),
    "depth 5, diffraction": Propagation(max_depth=5),
}


def compared(
    truth: Dataset, name: str, propagation: Propagation, positions: int
) -> tuple[EngineComparison, dict[str, float]]:
    """Rays of one mechanism, and their figures against full wave."""
    chosen = evenly(np.arange(len(truth.names)), positions)
    one_edge = patch("simulate.rays.diffraction.search.links_between", return_value=NO_LINKS)
    began = time.perf_counter()
    with one_edge if name == ONCE else nullcontext():
        tracer = Tracer(scene_for_rays(truth), propagation)
    found = time.perf_counter()
    tracer.responses(truth.positions[chosen[:2] if name == SIONNA else chosen])  # compiles the kernels
    ready = time.perf_counter()
    rays = tracer.responses(truth.positions[chosen])
    milliseconds = 1e3 * (time.perf_counter() - ready) / len(chosen)
    comparison = compare_responses(truth, chosen, rays)
    metrics = comparison.metrics()
    figures = {
        "correlation": round(metrics["correlation_rays"], 3),
        "together": round(metrics["correlation_rays_together"], 3),
        "ssim": round(metrics["ssim_rays"], 3),
        "level_db": round(metrics["level_bias_db"], 2),
        "ms": round(milliseconds, 1),
        "search_s": round(found - began, 1),
    }
    return comparison, figures


def draw(comparison: EngineComparison, truth: Dataset, path: Path) -> None:
    """Draw five spectra from the worst to the best: rays, full wave, difference."""
    spectra = [
        spectrum_of(picture(truth.beamformer.spectrum(responses)))
        for responses in (comparison.rays, comparison.full_wave)
    ]
    with tempfile.TemporaryDirectory() as folder:
        drawn = Path(folder) / "examples.png"
        draw_examples(spectra[0], spectra[1], comparison.scores.ssim, truth.grid, drawn, ("rays", "full wave"))
        image = Image.open(drawn).convert("RGB")
        image.resize((image.width * 3 // 4, image.height * 3 // 4)).save(path, optimize=True)  # half the bytes


def main(
    folder: Path = Path("runs/mechanisms"),
    positions: int = 400,
    positions_sionna: int = 50,
    fields: Path = Path("tests/data"),
    ship: bool = False,
    figures: Path | None = None,
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Compare the ray tracer's mechanisms with full wave."""
    rooms, mechanisms, cell = ROOMS, MECHANISMS, CELL
    if smallest:
        rooms, positions, folder, cell = {"smallest": smallest_room}, 5, Path(tempfile.mkdtemp()), 0.024
        mechanisms = {name: Propagation(max_depth=1, rays=1000, diffraction=name == SHOWN) for name in (ONCE, SHOWN)}
    result: dict[str, Any] = {}
    for room, scene in rooms.items():
        stored = fields / room if (fields / room / FIELD).is_file() else None
        truth = simulate(
            scene(), folder / room, positions, engine="fullwave", cell=None if stored else cell, field=stored
        )
        if ship and stored is None:
            (fields / room).mkdir(parents=True)
            shutil.copyfile(truth.folder / "metadata.json", fields / room / "metadata.json")
            read_stored_field(truth.folder / FIELD).thinned(4).write(fields / room / FIELD)
        for name, propagation in mechanisms.items():
            count = positions_sionna if name == SIONNA else positions
            comparison, result[f"{room}, {name}"] = compared(truth, name, propagation, count)
            if name == SHOWN and figures is not None:
                draw(comparison, truth, figures / f"mechanisms-{room}.png")
    print_figures(result, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
