"""The reports of ``bisplat evaluate``, ``evaluate --locate`` and ``crossvalidate``: pages, figures, JSON and CSV."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scipy.spatial import cKDTree

from learn.quantities.spectra import Spectra
from learn.reports.figures import (
    MapScore,
    draw_distribution,
    draw_error_map,
    draw_error_over_distance,
    draw_examples,
    draw_examples_polar,
    draw_reliability,
)
from learn.reports.html_page import embedded, write_page
from learn.reports.method_styles import THIS_RUN
from learn.reports.provenance import Provenance
from learn.reports.table_files import as_csv, write_tables
from scenes.files.atomic import write_atomically

if TYPE_CHECKING:  # these load torch, and the first page of the demo must not wait for it
    from learn.data.metrics import Scores
    from learn.evaluation.crossvalidate import CrossValidation
    from learn.evaluation.evaluate import Evaluation
    from learn.localisation.located_places import Located

FIGURES, RELIABILITY = ("ssim_cdf", "examples", "examples_polar"), "reliability"


def write_evaluation(evaluation: Evaluation, folder: Path) -> dict[str, Any]:
    """Write report.html, metrics.json, per_sample.csv, the table as LaTeX and CSV, and the figures as PNG and PDF.

    Return the content of metrics.json.
    """
    folder.mkdir(parents=True, exist_ok=True)
    made = Provenance.of_evaluation(evaluation)
    write_atomically(folder / "per_sample.csv", as_csv(_per_sample(evaluation)).encode())
    prediction, truth, ssim = evaluation.prediction, evaluation.truth, evaluation.scores["model"].ssim
    curves = {shown: scores.ssim for shown, scores in named_scores(evaluation).items()}
    draw_distribution(curves, folder / "ssim_cdf.png", provenance=made)
    draw_examples(prediction, truth, ssim, evaluation.dataset.grid, folder / "examples.png", provenance=made)
    draw_examples_polar(prediction, truth, ssim, evaluation.dataset.grid, folder / "examples_polar.png", made)
    if evaluation.errors_in_deviations is not None:
        draw_reliability(evaluation.errors_in_deviations, folder / f"{RELIABILITY}.png", made)
    rows = {name: scores.summary() for name, scores in named_scores(evaluation).items()}
    write_tables(rows, Spectra.columns, folder, made)
    return write_scores(evaluation, folder)


def write_scores(
    evaluation: Evaluation, folder: Path, located: Located | None = None, further_runs: Sequence[str] = ()
) -> dict[str, Any]:
    """Write metrics.json, and report.html with the figures that the folder has, both with located transmitters if there
    are some. Return the content of metrics.json.
    """
    values, made = evaluation_values(evaluation, folder), Provenance.of_evaluation(evaluation)
    metrics = {**evaluation.metrics(), "provenance": made.facts()}
    values |= {"located": None, "further_runs": further_runs}
    if located is not None:
        values["located"] = metrics["locations"] = located.metrics()
        values["figures"] |= embedded(folder, ("location_errors",))
    write_atomically(folder / "metrics.json", (json.dumps(metrics, indent=2) + "\n").encode())
    write_page(folder / "report.html", "evaluation.html.j2", made, run=evaluation.run_name, **values)
    return metrics


def named_scores(evaluation: Evaluation) -> dict[str, Scores]:
    """The scores of an evaluation, with the name of the model instead of "model"."""
    name = f"{evaluation.origin.model}{THIS_RUN}"
    return {name if method == "model" else method: scores for method, scores in evaluation.scores.items()}


def evaluation_values(evaluation: Evaluation, folder: Path) -> dict[str, Any]:
    """Values that the template evaluation_part.html.j2 shows."""
    return {
        "rows": {name: scores.summary() for name, scores in named_scores(evaluation).items()},
        "columns": Spectra.columns,
        "dataset": evaluation.dataset,
        "test": len(evaluation.test),
        "bands": evaluation.intervals_by_distance(),
        "figures": embedded(folder, FIGURES if evaluation.errors_in_deviations is None else (*FIGURES, RELIABILITY)),
    }


def _per_sample(evaluation: Evaluation) -> Iterator[Sequence[Any]]:
    """A line for each test spectrum, headings first: its name, position (metres) and scores."""
    yield ["name", "x", "y", "z", "ssim", "psnr_db", "mae", "aoa_error_deg", "ssim_nearest", "deviation"]
    model, nearest = evaluation.scores["model"], evaluation.scores["nearest"]
    for row, index in enumerate(evaluation.test):
        position = evaluation.dataset.positions[index]
        scores = (model.ssim[row], model.psnr[row], model.mae[row], model.aoa_error[row], nearest.ssim[row])
        deviation = "" if evaluation.deviation is None else f"{evaluation.deviation[row]:.6f}"
        yield [evaluation.dataset.names[index], *position, *(f"{value:.6f}" for value in scores), deviation]


CROSSVALIDATED = tuple(f"crossvalidation_{name}" for name in ("map", "distance", "examples", "polar"))


def write_crossvalidation(fresh: CrossValidation, folder: Path) -> None:
    """Write crossvalidation.html, crossvalidation.json, and the figures as PNG and PDF."""
    folder.mkdir(parents=True, exist_ok=True)
    made = Provenance.of_crossvalidation(fresh)
    metrics = {**fresh.metrics(), "provenance": made.facts()}
    write_atomically(folder / "crossvalidation.json", (json.dumps(metrics, indent=2) + "\n").encode())
    positions, known, scores = fresh.positions, fresh.known_positions, fresh.scores
    draw_error_map(
        positions, MapScore.of_spectra(scores.ssim, scores.aoa_error), known, folder / "crossvalidation_map.png", made
    )
    distance = cKDTree(known).query(positions)[0]
    draw_error_over_distance(distance, scores.ssim, scores.aoa_error, folder / "crossvalidation_distance.png", made)
    draw_examples(
        fresh.prediction, fresh.truth, scores.ssim, fresh.grid, folder / "crossvalidation_examples.png", provenance=made
    )
    draw_examples_polar(
        fresh.prediction, fresh.truth, scores.ssim, fresh.grid, folder / "crossvalidation_polar.png", made
    )
    write_page(
        folder / "crossvalidation.html",
        "crossvalidation.html.j2",
        made,
        run=fresh.run_name,
        scene=fresh.scene_name,
        truth_by=fresh.truth_by,
        **crossvalidation_values(fresh, folder),
    )


def crossvalidation_values(fresh: CrossValidation, folder: Path) -> dict[str, Any]:
    """Values that the template crossvalidation_part.html.j2 shows."""
    return {
        "fresh_rows": {f"{fresh.origin.model}{THIS_RUN}": fresh.scores.summary()},
        "columns": Spectra.columns,
        "fresh": fresh.metrics(),
        "figures": embedded(folder, CROSSVALIDATED),
    }


def write_locations(
    located: Located, folder: Path, made: Provenance | None = None, further_runs: Sequence[str] = ()
) -> None:
    """Write locations.json, locations.csv and location_errors.png (and .pdf)."""
    folder.mkdir(parents=True, exist_ok=True)
    facts = located.metrics() | ({"further_runs": list(further_runs)} if further_runs else {})
    write_atomically(folder / "locations.json", (json.dumps(facts, indent=2) + "\n").encode())
    located.write(folder / "locations.csv")
    model = "model" if made is None else f"{made.model}{THIS_RUN}"
    errors = {model if name == "locate" else name: 100 * each for name, each in located.errors.items()}
    others = f" with the runs of further gateways {', '.join(further_runs)}" if further_runs else ""
    made = made and replace(made, spectra=f"{made.spectra}, {len(located.errors['locate'])} of them located{others}")
    label, share = "error of the position (cm)", "share of located positions"
    draw_distribution(errors, folder / "location_errors.png", label, share, made, logarithmic=True)
