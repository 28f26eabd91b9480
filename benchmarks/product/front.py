"""The picture on the front page: a room, and the spectrum of one transmitter in it, true, predicted and copied.

python -m benchmarks.product.front --figure docs/generated/front.png --json

The room is the lab, whose field in full wave is in tests/data/lab. The model is the default one, trained on two hundred
spectra at random positions. The spectrum shown is the one whose SSIM is the median of the test spectra: half of all
predictions are better, half are worse.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro
from matplotlib.figure import Figure

import bisplat
from benchmarks.ledger.printing import print_figures
from learn.evaluation.evaluate import Evaluation
from scenes.drawing.perspective import draw_view
from simulate.spectra.spectrum import spectrum_of

FIELD = Path(__file__).parents[2] / "tests" / "data" / "lab"

SPECTRA = 250
"""Two hundred to learn from, the rest to test."""


def main(
    figure: Path | None = None,
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Train on the lab, and draw the median prediction."""
    scene = bisplat.load_scene("lab")
    with tempfile.TemporaryDirectory() as folder:
        spectra = 40 if smallest else SPECTRA
        dataset = bisplat.simulate(scene, f"{folder}/data", spectra, engine="fullwave", field=FIELD)
        evaluation = bisplat.evaluate(bisplat.train(dataset, f"{folder}/run", split="random"))
    scores = evaluation.scores["model"].ssim
    median = int(np.argsort(scores)[len(scores) // 2])
    if figure is not None:
        picture(scene, evaluation, median).savefig(figure, dpi=130)
    figures = {
        "known_spectra": spectra - len(scores),
        "test_spectra": len(scores),
        "ssim_median": round(float(np.median(scores)), 4),
        "ssim_median_nearest": round(float(np.median(evaluation.scores["nearest"].ssim)), 4),
    }
    print_figures(figures, json_output, smallest)


def picture(scene: bisplat.Scene, evaluation: Evaluation, shown: int) -> Figure:
    """The room on the left; on the right a test spectrum, as it is, as predicted, and as copied from nearby."""
    drawn = Figure(figsize=(10, 4.4), layout="constrained")
    left, right = drawn.subfigures(1, 2, width_ratios=[1, 1.1])
    draw_view(left.add_subplot(projection="3d"), scene)
    left.suptitle("A room. The gateway (red) looks into it;\na transmitter is somewhere in the green box.", fontsize=10)
    apart = np.linalg.norm(evaluation.dataset.positions - evaluation.positions[shown], axis=1)
    apart[evaluation.test] = np.inf
    copied = spectrum_of(evaluation.dataset.pictures[apart.argmin()])
    model, nearest = (evaluation.scores[name].ssim[shown] for name in ("model", "nearest"))
    rows = {
        "true (Maxwell's equations)": evaluation.truth[shown],
        f"predicted from {len(evaluation.known_positions)} known spectra: SSIM {model:.2f}": evaluation.prediction[
            shown
        ],
        f"the nearest known spectrum: SSIM {nearest:.2f}": copied,
    }
    for axes, (words, spectrum) in zip(right.subplots(3, 1, sharex=True), rows.items(), strict=True):
        bisplat.plot_spectrum(spectrum, axes).set_title(words, fontsize=9)
        axes.label_outer()
    right.suptitle("The spectrum: how much arrives from which direction", fontsize=10)
    return drawn


if __name__ == "__main__":
    tyro.cli(main)
