"""The figures, tables and page of ``bisplat compare``, for any quantity."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from learn.comparison.averages import average_name, footnote_of, spread_of
from learn.comparison.comparison import Comparison
from learn.comparison.results_folder import run_folder
from learn.quantities.array_ceiling import CEILING
from learn.reports.figures import draw_distribution
from learn.reports.html_page import embedded, write_page
from learn.reports.method_styles import DOUBTFUL, line_styles
from learn.reports.paper import COLUMN, PAGE, at_paper_size, save
from learn.reports.provenance import Provenance
from learn.reports.table_files import marked_rows, write_tables
from scenes.files.atomic import write_atomically
from scenes.files.plain_text import in_figure

SHOWN = 95  # Percentile of the errors of the worst method at which the axis of their distribution ends


def write_comparison(comparison: Comparison, folder: Path, variants: bool = False) -> None:
    """Write table.html, results.json, table.tex, table.csv and the figures (PNG and PDF).

    The figures are the distribution of the scores of the first seed; of several sizes, the score over the number of
    training rows; the learning curves of what was trained by steps here; and of variants of a model, all scores.
    """
    made, figures = Provenance.of_comparison(comparison), {}
    write_results(comparison, folder, made)
    sizes = {row["train_size"] for row in comparison.rows if row["label"] != CEILING}
    if comparison.each and len(sizes) == 1:
        name = draw_scores(comparison, folder, made)
        figures[name] = f"Distribution of {comparison.quantity.of_each.label}, first seed."
    if sizes != {None}:
        draw_sizes(comparison, folder, made)
        figures["sweep"] = f"{_measure(comparison)} over the number of training {comparison.quantity.things}."
    if variants:
        draw_variants(comparison, folder / "variants.png", made)
        figures["variants"] = f"{_measure(comparison)} of each variant."
    if draw_learning_curves(comparison, folder, made):
        figures["learning_curves"] = "Score on the validation part over the steps of training."
    write_page(
        folder / "table.html",
        "compare.html.j2",
        made,
        comparison=comparison,
        rows=_marked(comparison),
        seeds=max(row["seeds"] for row in comparison.averages()),
        figures=dict(zip(figures.values(), embedded(folder, tuple(figures)).values(), strict=True)),
    )


def write_results(comparison: Comparison, folder: Path, made: Provenance) -> None:
    """Write results.json, with all scores and where they come from, and their table.tex and table.csv."""
    facts = {**comparison.facts(), "provenance": made.facts()}
    write_atomically(folder / "results.json", (json.dumps(facts, indent=2) + "\n").encode())
    write_tables(_marked(comparison), comparison.columns, folder, made, footnote_of(comparison.doubts()))


def _marked(comparison: Comparison) -> dict[str, Mapping[str, Any]]:
    """The rows of the table by name, which is marked if there are doubts."""
    return marked_rows(comparison.table(), comparison.doubts())


def _measure(comparison: Comparison) -> str:
    """The score that ranks, in words."""
    return comparison.quantity.columns[comparison.quantity.ranked_by]


def draw_scores(comparison: Comparison, folder: Path, made: Provenance) -> str:
    """Draw how the scores of each method spread over the test rows, first seed. Return the name of the figure."""
    of_each, quantity = comparison.quantity.of_each, comparison.quantity
    scores = {name: comparison.each[name][of_each.key] for name in map(average_name, comparison.table())}
    doubts, name = comparison.doubts(), f"{of_each.key.partition('_')[0]}_cdf"
    ends: tuple[float | None, float | None] = (None, None)
    heard = [each[~np.isnan(each)] for each in scores.values()]
    if quantity.small_is_good and all(each.size for each in heard):
        ends = 0, max(float(np.percentile(each, SHOWN)) for each in heard) or 1
    marked = {f"{name}{DOUBTFUL if name in doubts else ''}": each for name, each in scores.items()}
    draw_distribution(marked, folder / f"{name}.png", of_each.label, of_each.share, made, ends)
    return name


@at_paper_size()
def draw_sizes(comparison: Comparison, folder: Path, made: Provenance) -> None:
    """Draw sweep.png: the score over the number of training rows. Of several seeds, the bars are deviations."""
    key, doubts = comparison.quantity.ranked_by, comparison.doubts()
    averages = [row for row in comparison.averages() if row["train_size"] is not None]
    stated = [row for row in averages if row.get(key) is not None]
    styles = line_styles(row["label"] for row in stated)
    figure = Figure(figsize=(COLUMN, 2.9), layout="constrained")
    axis = figure.subplots()
    for label in dict.fromkeys(row["label"] for row in stated):
        rows = sorted((row for row in stated if row["label"] == label), key=lambda row: row["train_size"])
        spreads = [row.get(spread_of(key), np.nan) for row in rows]  # nan draws no bar
        marked = f"{label}{DOUBTFUL}" if any(average_name(row) in doubts for row in rows) else label
        bars = spreads if np.isfinite(spreads).any() else None
        points = [row["train_size"] for row in rows], [row[key] for row in rows]
        axis.errorbar(*points, yerr=bars, capsize=2, label=in_figure(marked), **styles[label])
    label = f"{_measure(comparison)}\n{over_seeds(averages).strip()}"
    axis.set(xscale="log", xlabel=f"training {comparison.quantity.things}", ylabel=label)
    sizes = sorted({row["train_size"] for row in averages})
    if len(sizes) == 1:  # an axis of two decades around one point would promise a curve
        axis.set_xlim(0.8 * sizes[0], 1.25 * sizes[0])
    axis.set_xticks(sizes, [f"{size:g}" for size in sizes], rotation=45 if len(sizes) > 5 else 0)
    axis.minorticks_off()
    axis.grid(alpha=0.3)
    if stated:
        figure.legend(loc="outside upper center", ncols=2, handlelength=3.2)
    save(figure, folder / "sweep.png", made, footnote_of(doubts))


def over_seeds(averages: Sequence[Mapping[str, Any]]) -> str:
    """What the points and bars of a figure are, if there are several seeds."""
    return " (mean ± deviation over seeds)" if any(row["seeds"] > 1 for row in averages) else " (one seed)"


@at_paper_size()
def draw_variants(comparison: Comparison, path: Path, made: Provenance) -> None:
    """Draw the score of every row, with its deviation over the seeds."""
    rows, doubts = comparison.averages()[::-1], comparison.doubts()
    figure = Figure(figsize=(PAGE, 0.6 + 0.2 * len(rows)), layout="constrained")
    axis = figure.subplots()
    styles, key = line_styles(row["label"] for row in rows), comparison.quantity.ranked_by
    for place, row in enumerate(rows):
        style = {name: styles[row["label"]][name] for name in ("color", "marker") if name in styles[row["label"]]}
        spread = row.get(key.replace("median", "spread"))
        axis.errorbar(row[key], place, xerr=spread, ls="", capsize=2, **{"marker": "o", **style})
    axis.set_yticks(range(len(rows)), [in_figure(label) for label in marked_rows(rows, doubts)])
    axis.set_ylim(-0.5, len(rows) - 0.5)
    axis.locator_params(axis="x", nbins=6)
    axis.set_xlabel(f"{_measure(comparison)}{over_seeds(rows)}")
    axis.grid(axis="x", alpha=0.3)
    save(figure, path, made, footnote_of(doubts))


def validation_curve(run: Path) -> tuple[list[int], list[float]]:
    """Steps and validation SSIMs that a training logged, over all its interruptions; empty if it was not by steps."""
    found: dict[int, float] = {}
    for log in sorted(run.glob("logs/version_*/metrics.csv"), key=lambda path: int(path.parent.name.split("_")[1])):
        with log.open(newline="") as file:
            found |= {
                int(row["step"]) + 1: float(row["validation_ssim"])
                for row in csv.DictReader(file)
                if row.get("validation_ssim")
            }
    steps = sorted(found)
    return steps, [found[step] for step in steps]


@at_paper_size()
def draw_learning_curves(comparison: Comparison, folder: Path, made: Provenance) -> bool:
    """Draw the learning curve of every row that was trained by steps, each method in a colour. False: there is none."""
    curves = [(row, *validation_curve(folder / run_folder(row))) for row in comparison.rows]
    curves = [curve for curve in curves if curve[1]]
    if not curves:
        return False
    styles = line_styles(row["label"] for row in comparison.rows)
    figure = Figure(figsize=(COLUMN, 2.3 + 0.15 * len({row["label"] for row, *_ in curves})), layout="constrained")
    axis = figure.subplots()
    for row, steps, ssim in curves:
        label = in_figure(row["label"]) if row["seed"] == 0 else ""
        axis.plot(steps, ssim, label=label, **styles[row["label"]])
    axis.set(xlabel="training steps", ylabel="median SSIM, validation part")
    axis.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
    axis.grid(alpha=0.3)
    figure.legend(loc="outside upper left", handlelength=3.2)
    save(figure, folder / "learning_curves.png", made)
    return True
