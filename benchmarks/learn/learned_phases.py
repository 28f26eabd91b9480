"""What do networks learn from pictures, from responses found behind them, and from true responses?

python -m benchmarks.learn.learned_phases data/rfid-s23-160 --json > runs/learned-phases.json

The figures are median SSIMs of test spectra, for the models that predict responses. The datasets are the closet in full
wave (the field in tests/data), with several numbers of known spectra, and the measured sample, whose true responses are
unknown. ``found`` is what ``bisplat train`` does: it learns from found responses where they help, and from pictures
elsewhere. The runs are kept in a folder for the next call.
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
from learn.data.metrics import ssim
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import read_dataset
from simulate.generation.simulation import simulate

MODELS = ("bisplat-aperture", "mlp-responses")
KNOWN, TESTED = (100, 200, 400, 1000), 200


def score(dataset: Dataset, folder: Path, model: str, split: Any, steps: int, find_phases: bool) -> float:
    """Median SSIM of the test spectra after a training. A run that is in the folder is not trained again."""
    from learn.fitted.runs import train

    run = train(dataset, folder, model=model, split=split, steps=steps, find_phases=find_phases)
    test = run.split(dataset).test
    found = run.predict(dataset.positions[test]).spectra
    return round(float(np.median(ssim(found, dataset.spectra[test]))), 4)


def row(dataset: Dataset, folder: Path, model: str, split: str, steps: int) -> dict[str, Any]:
    """Scores of one model on one dataset."""
    pictures = dataset.with_values(response=None)
    figures = {
        "pictures": score(pictures, folder / "pictures", model, split, steps, False),
        "found": score(pictures, folder / "found", model, split, steps, True),
    }
    if "response" in dataset.values:
        figures["responses known"] = score(dataset, folder / "known", model, split, steps, True)
    return figures


def main(
    measured: Positional[Path | None] = None,
    field: Path = Path("tests/data/closet"),
    folder: Path = Path("runs/learned-phases"),
    steps: int = 1500,
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Train the models."""
    sizes, tested, steps = ((15,), 4, 1) if smallest else (KNOWN, TESTED, steps)
    result: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) if smallest else folder
        closet = simulate("closet", folder / "closet", max(sizes) + tested, engine="fullwave", field=field)
        order = np.random.default_rng(0).permutation(len(closet.positions))
        for model in MODELS[1:] if smallest else MODELS:
            for size in sizes:
                known = np.sort(order[tested : tested + size])
                some = replace(closet, train=known, test=np.sort(order[:tested]))
                result[f"{model}, closet, {size}"] = row(some, folder / f"{model}-{size}", model, "files", steps)
            if measured is not None and not smallest:
                sample = read_dataset(measured).with_values(response=None)
                for split in ("files", "blocked"):
                    name = f"{model}, measured, {split}"
                    result[name] = row(sample, folder / f"{model}-{split}", model, split, steps)
    print_figures(result, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
