"""How large are the errors of located transmitters, and how often do the stated intervals hold?

python -m benchmarks.uses.locate runs/lab-6000 data/rfid-s23-160 --json > runs/locate.json

``helmholtz`` is trained on a simulated dataset (two splits), on spectra of the same transmitters that a second gateway
receives too, and on the measured sample (two splits). Test transmitters are then located from their pictures. The
errors of the positions are in centimetres. Beside them are the errors of copying the positions of the most similar
known spectra.

``within 90 % region`` is how often the stated region contains the true position. ``within 90 % interval`` is how often
the stated interval contains the true value of a spectrum. The runs are kept in a folder for the next call.
"""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro
from tyro.conf import Positional

from benchmarks.ledger.printing import print_figures
from learn.evaluation.evaluate import evaluate
from learn.localisation.heard_pictures import LOCATED, of_test_part
from learn.reports.evaluation_report import write_locations
from learn.reports.figures import draw_reliability
from learn.training.conformal_deviation import NORMAL
from learn.training.run_folder import Run, load_spectra
from scenes.scene.antennas import Gateway
from scenes.scene.orientation import facing
from scenes.storage.scene_yaml import load_scene
from simulate.dataset.dataset_folder import read_dataset
from simulate.engines.rays_engine import Rays, seed_of_rays
from simulate.generation.simulation import simulate

SECOND = Gateway((2.4, 5.6, 2.0), facing((0.1, -1.0, -0.2)), pattern="tr38901")
"""In the lab: on the wall beside the transmitters' region."""


def row(runs: list[Run], folder: Path) -> dict[str, Any]:
    """Figures of one or several gateways. A picture of the errors is written to the folder."""
    found = of_test_part([load_spectra(each) for each in runs], LOCATED).answered()
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
    """Locate test transmitters."""
    from learn.fitted.runs import train

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
