"""The report of ``bisplat crossvalidate``: a page, its figures, and the metrics as JSON."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scipy.spatial import cKDTree

from learn.reports.figures import MapScore, draw_error_map, draw_error_over_distance, draw_examples, draw_examples_polar
from learn.reports.html_page import SCORE_COLUMNS, embedded, write_page
from learn.reports.method_styles import THIS_RUN
from learn.reports.provenance import Provenance
from scenes.files.atomic import write_atomically

if TYPE_CHECKING:  # loads torch
    from learn.evaluation.crossvalidate import CrossValidation

FIGURES = ("crossvalidation_map", "crossvalidation_distance", "crossvalidation_examples", "crossvalidation_polar")


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
        **page_values(fresh, folder),
    )


def page_values(fresh: CrossValidation, folder: Path) -> dict[str, Any]:
    """Values that the template crossvalidation_part.html.j2 shows."""
    return {
        "fresh_rows": {f"{fresh.origin.model}{THIS_RUN}": fresh.scores.summary()},
        "columns": SCORE_COLUMNS,
        "fresh": fresh.metrics(),
        "figures": embedded(folder, FIGURES),
    }
