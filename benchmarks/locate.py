"""How far off are located transmitters, and how often do the stated intervals hold?

python benchmarks/locate.py runs/lab-6000 data/rfid-s23-160 --json > runs/locate.json

``helmholtz`` is trained on a simulated dataset (its two splits), on spectra of the same transmitters that a second
gateway receives as well, and on the measured sample (its two splits). Test transmitters are located from their
pictures: errors of the position in centimetres, beside those of copying the positions of the known spectra that are
most alike. ``within 90 % region``: how often the stated covariance holds the true position; ``within 90 % interval``:
how often the stated deviation holds the true spectrum's values. The runs are kept in a
folder, in which the next call finds them.
"""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro
from ledger.printing import print_figures
from tyro.conf import Positional

from learn.evaluation.evaluate import evaluate
from learn.evaluation.locations import evaluate_locations
from learn.reports.figures import draw_reliability
from learn.reports.locations_report import write_locations
from learn.training.deviation import NORMAL
from learn.training.run_folder import Run
from scenes.scene.description import Gateway, facing
from scenes.storage.scene_yaml import load_scene
from simulate.dataset.dataset_folder import read_dataset
from simulate.engines.rays_engine import Rays, seed_of_rays
from simulate.generation.simulation import simulate

SECOND = Gateway((2.4, 5.6, 2.0), facing((0.1, -1.0, -0.2)), pattern="tr38901")
"""In the lab: on the wall beside the transmitters' region."""


def row(runs: list[Run], folder: Path) -> dict[str, Any]:
    """Figures of one or several gateways; the picture of the errors is written to the folder."""
    found = evaluate_locations(runs)
    write_locations(found, folder)
    metrics = found.metrics()
    figures = {
        "located": metrics["located"],
        "median, cm": round(metrics["location_error_median_cm"], 2),
        "90 %, cm": round(metrics["location_error_p90_cm"], 2),
        "fingerprint, median, cm": round(metrics["location_error_median_cm_fingerprint"], 2),
        "fingerprint, 90 %, cm": round(metrics["location_error_p90_cm_fingerprint"], 2),
        "mean of 4, median, cm": round(metrics["location_error_median_cm_fingerprint_4"], 2),
        "mean of 4, 90 %, cm": round(metrics["location_error_p90_cm_fingerprint_4"], 2),
        "within 90 % region": round(metrics["within_90_percent_region"], 3),
    }
    if len(runs) == 1:
        errors = evaluate(runs[0]).errors_in_deviations
        if errors is not None:
            draw_reliability(errors, folder / "reliability.png")
        figures["within 90 % interval"] = None if errors is None else round(float(np.mean(errors <= NORMAL)), 3)
    return figures


def main(
    simulated: Positional[Path],
    measured: Positional[Path],
    folder: Path = Path("runs/locate"),
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Locate test transmitters.

    Args:
        simulated: a dataset folder of the lab, by rays.
        measured: a measured dataset folder.
        folder: for the second gateway's dataset, the runs and their figures.
        smallest: a run of seconds that shows that the benchmark works; its figures mean nothing.
        json_output: print one JSON object.
    """
    from learn.training.train import train

    figures: dict[str, Any] = {}
    options: Any = {"model": "mlp", "steps": 1} if smallest else {}
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) if smallest else folder
        for name, dataset in (("simulated", simulated), ("measured", measured)):
            splits: Any = ("files",) if smallest else ("files", "blocked")
            for split in splits:
                run = train(dataset, folder / f"{name}-{split}", split=split, **options)
                figures[f"{name}, {split}"] = row([run], folder / f"{name}-{split}" / "evaluation")
        if not smallest:
            data = read_dataset(simulated)
            scene = replace(load_scene(data.folder / data.metadata["scene_file"]), gateway=SECOND)
            second = folder / "second-gateway"
            seed = seed_of_rays(data.metadata)
            simulate(scene, second, positions=data.positions, engine=Rays.of(data.metadata), seed=seed)
            runs = [train(simulated, folder / "simulated-files"), train(second, folder / "second-files")]
            figures["second gateway, files"] = row(runs[1:], folder / "second-files" / "evaluation")
            figures["both gateways, files"] = row(runs, folder / "both-files")
    print_figures(figures, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
