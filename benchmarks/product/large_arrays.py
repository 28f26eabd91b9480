"""How long do a dataset, its check, a training and an evaluation take with larger arrays?

python -m benchmarks.product.large_arrays --json > runs/large_arrays.json

The lab by rays, with arrays of 4 × 4, 8 × 8 and 16 × 16 elements and the split ``random``, which tests on 100 of 500
spectra. Each command is a process of its own: simulate, check, train (the default model) and evaluate. "pictures alone"
is a copy of the dataset without recorded responses, as other programs write it. There, ``train`` finds the responses
behind all known pictures, and ``evaluate`` those behind 50 test pictures, for the array's ceiling.
"""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path
from typing import Annotated

import tyro

from benchmarks.ledger.commands import Measured, measured
from benchmarks.ledger.printing import print_figures

SPECTRA, SIDES = 500, (4, 8, 16)


def main(smallest: bool = False, json_output: Annotated[bool, tyro.conf.arg(name="json")] = False) -> None:
    """Measure what larger arrays take."""
    spectra, sides = (20, (4,)) if smallest else (SPECTRA, SIDES)
    figures: dict[str, Measured] = {}
    for side in sides:
        with tempfile.TemporaryDirectory() as temporary:
            array, work = f"{side} × {side}", Path(temporary)
            data, pictures = work / "data", work / "pictures"
            size = ["--array", f"{side}x{side}", "-n", str(spectra)]
            fast = ["--max-depth", "0"] if smallest else []
            figures[f"simulate, {array}"] = measured("simulate", "lab", *size, *fast, "-o", str(data))
            shutil.copytree(data, pictures, ignore=shutil.ignore_patterns("channels.npz"))
            for folder, name in ((data, array), (pictures, f"{array}, pictures alone")):
                run = str(work / f"run-{folder.name}")
                figures[f"check, {name}"] = measured("check", str(folder))
                figures[f"train, {name}"] = measured("train", str(folder), "-o", run, "--split", "random")
                figures[f"evaluate, {name}"] = measured("evaluate", run)
    print_figures(figures, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
