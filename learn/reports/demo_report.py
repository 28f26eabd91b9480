"""The report of ``bisplat demo``: one page, which begins with the scene and grows with every result."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from learn.reports import crossvalidation_report, evaluation_report
from learn.reports.figures import draw_ssim_distribution
from learn.reports.html_page import embedded, write_page
from learn.reports.method_styles import THIS_RUN
from learn.reports.provenance import Provenance

if TYPE_CHECKING:  # these load torch, and the first page must not wait for it
    from learn.evaluation.crossvalidate import CrossValidation
    from learn.evaluation.evaluate import Evaluation
    from scenes.scene.description import Scene

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
            crossvalidated = crossvalidation_report.page_values(fresh, self.folder / "run")
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
        draw_ssim_distribution(
            {name: each.ssim for name, each in scores.items()}, self.folder / "ssim_cdf.png", provenance=made
        )
        values = evaluation_report.page_values(first, self.folder / "run" / "evaluation")
        rows = {name: each.summary() for name, each in scores.items()}
        return {**values, "rows": rows, "models": list(evaluations), "made": made}
