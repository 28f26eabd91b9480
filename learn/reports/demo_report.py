"""The report of ``bisplat demo``: one page, which begins with the scene and grows with every result."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from learn.reports.evaluation_report import crossvalidation_values, evaluation_values
from learn.reports.figures import draw_distribution, draw_spectra
from learn.reports.html_page import embedded, write_page
from learn.reports.method_styles import THIS_RUN
from learn.reports.provenance import Provenance
from scenes.scene.description import Scene
from simulate.dataset.dataset import Dataset
from simulate.rays.core.propagation import Propagation
from simulate.spectra.angular_grid import AngularGrid
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.element_array import array_of
from simulate.spectra.spectrum import picture, spectrum_of

if TYPE_CHECKING:  # these load torch, and the first page must not wait for it
    from learn.evaluation.crossvalidate import CrossValidation
    from learn.evaluation.evaluate import Evaluation

FIGURES = ("scene", "first_look", "spectra")
"""Figures that the page shows as soon as they are in the folder; ``spectra`` takes the place of ``first_look``."""


@dataclass(frozen=True)
class DemoReport:
    """The page report.html of a demo."""

    folder: Path  # the demo's folder. It has scene.png, and soon first_look.png and spectra.png.
    scene: Scene  # the demo's scene
    spectra: int  # number of spectra that the demo traces

    @property
    def path(self) -> Path:
        """The page."""
        return self.folder / "report.html"

    def write(
        self,
        to_come: Sequence[str] = (),
        evaluations: Mapping[str, Evaluation] | None = None,
        fresh: CrossValidation | None = None,
        metrics: Mapping[str, Any] | None = None,
    ) -> None:
        """Write the page with the results so far, and with the models' figure ssim_cdf.png."""
        values: dict[str, Any] = {"models": [], "fresh": None, "made": None}
        figures = embedded(self.folder, tuple(name for name in FIGURES if (self.folder / f"{name}.png").exists()))
        if evaluations:
            evaluated = self._evaluated(evaluations)
            values, figures = {**values, **evaluated}, {**evaluated["figures"], **figures}
        if fresh is not None:
            crossvalidated = crossvalidation_values(fresh, self.folder / "run")
            values, figures = {**values, **crossvalidated}, {**crossvalidated["figures"], **figures}
        if evaluations:
            figures |= embedded(self.folder, ("ssim_cdf",))  # of all models, not of the first alone
        values |= {"figures": figures, "scene": self.scene, "spectra": self.spectra, "metrics": metrics}
        write_page(self.path, "report.html.j2", values.pop("made"), to_come=to_come, **values)

    def _evaluated(self, evaluations: Mapping[str, Evaluation]) -> dict[str, Any]:
        first = next(iter(evaluations.values()))
        scores = {f"{name}{THIS_RUN}": evaluation.scores["model"] for name, evaluation in evaluations.items()}
        made = replace(Provenance.of_evaluation(first), title="demo", model=", ".join(evaluations))
        scores |= {name: baseline for name, baseline in first.scores.items() if name != "model"}
        curves = {name: each.ssim for name, each in scores.items()}
        draw_distribution(curves, self.folder / "ssim_cdf.png", provenance=made)
        values = evaluation_values(first, self.folder / "run" / "evaluation")
        rows = {name: each.summary() for name, each in scores.items()}
        return {**values, "rows": rows, "models": list(evaluations), "made": made}


SHOWN = 6  # Number of spectra to show

QUICK = Propagation(max_depth=1, rays=20_000)
"""At most one reflection or diffraction. The search for such paths takes seconds, that for all paths a minute."""


def draw_first_look(scene: Scene, positions: Float[np.ndarray, "K 3"], seed: int, folder: Path) -> None:
    """Trace the spectra of the first positions in a hurry, and draw them as first_look.png."""
    from simulate.rays.tracer import Tracer

    shown = positions[:SHOWN]
    beamformer = Beamformer(array_of(scene.gateway, scene.frequency), AngularGrid())
    responses = Tracer(scene, QUICK, seed=seed).responses(shown)
    spectra = spectrum_of(picture(beamformer.spectrum(responses)))
    draw_spectra(spectra, shown, beamformer.grid, folder / "first_look.png")


def draw_first_spectra(dataset: Dataset, folder: Path) -> None:
    """Draw the first spectra of a dataset as spectra.png."""
    draw_spectra(dataset.spectra[:SHOWN], dataset.positions[:SHOWN], dataset.grid, folder / "spectra.png")
