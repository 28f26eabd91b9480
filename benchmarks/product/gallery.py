"""The figures that the commands draw, for the gallery of the documentation.

python -m benchmarks.product.gallery --figures docs/generated --json

Measured: seconds of each command. The place is the closet in full wave, whose field is in tests/data/closet.
"""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path
from typing import Annotated

import tyro

from benchmarks.ledger.commands import measured
from benchmarks.ledger.printing import print_figures

FIELD = Path(__file__).parents[2] / "tests" / "data" / "closet"

FIGURES = {
    "evaluate-examples": "run/evaluation/examples.png",
    "evaluate-polar": "run/evaluation/examples_polar.png",
    "evaluate-cdf": "run/evaluation/ssim_cdf.png",
    "evaluate-reliability": "run/evaluation/reliability.png",
    "evaluate-locations": "run/evaluation/location_errors.png",
    "crossvalidate-map": "run/crossvalidation_map.png",
    "crossvalidate-examples": "run/crossvalidation_examples.png",
}
"""Name of a picture of the documentation -> the file that a command writes."""


def main(
    figures: Path | None = None,
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Run the commands, and copy their figures."""
    spectra, fresh = ("140", "6") if smallest else ("600", "150")  # from fewer, a run states no deviation
    with tempfile.TemporaryDirectory() as folder:
        data, run = f"{folder}/data", f"{folder}/run"
        commands = {
            "simulate": ["closet", "-o", data, "-n", spectra, "--engine", "fullwave", "--field", str(FIELD)],
            "train": [data, "-o", run, "--split", "random"],
            "evaluate": [run],
            "evaluate --locate": [run],
            "crossvalidate": [run, "--scene", "closet", "-n", fresh, "--field", data],
        }
        if smallest:
            commands = {name: commands[name] for name in ("simulate", "train", "evaluate")}
        seconds = {name: measured(*name.split(), *given)["seconds"] for name, given in commands.items()}
        if figures is not None:
            for name, path in FIGURES.items():
                if not smallest or (path.startswith("run/evaluation/") and "location" not in path):
                    shutil.copyfile(Path(folder) / path, figures / f"{name}.png")
    print_figures(seconds, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
