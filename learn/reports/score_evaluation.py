"""The report of ``bisplat evaluate`` for received powers and for channels."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from io import StringIO
from pathlib import Path
from typing import Any

from learn.channels.channel_comparison import ChannelComparison
from learn.comparison.score_table import ScoreTable
from learn.powers.power_comparison import PowerComparison
from learn.reports.channel_figures import draw_channel_figures
from learn.reports.html_page import embedded, write_page
from learn.reports.power_figures import draw_power_figures
from learn.reports.provenance import Provenance
from learn.reports.score_report import draw_scores
from learn.reports.table_files import write_scores
from scenes.files.atomic import write_atomically


def write_score_evaluation(comparison: ScoreTable, model: str, folder: Path) -> None:
    """Write report.html, results.json, per_sample.csv, the table as LaTeX and CSV, and the figures as PNG and PDF."""
    made = Provenance.of_scores(comparison, f"{model} on held-out {comparison.THINGS}")
    write_scores(comparison, folder, made)
    draw_scores(comparison, folder, made)
    if isinstance(comparison, PowerComparison):
        captions = draw_power_figures(comparison, model, folder, made)
        table, of_powers = _powers(comparison, model), _of_powers(comparison, model)
    elif isinstance(comparison, ChannelComparison):
        captions = draw_channel_figures(comparison, model, folder, made)
        table, of_powers = _channels(comparison), {}
    write_atomically(folder / "per_sample.csv", _csv(table).encode())
    warning = None if comparison.distances is None else comparison.distances.warning()
    write_page(
        folder / "report.html",
        "scores.html.j2",
        made,
        model=model,
        comparison=comparison,
        rows={row["label"]: row for row in comparison.table()},
        columns=comparison.COLUMNS,
        warning=warning,
        of_powers=of_powers,
        figures=dict(zip(captions.values(), embedded(folder, tuple(captions)).values(), strict=True)),
    )


def _of_powers(comparison: PowerComparison, model: str) -> dict[str, Any]:
    """What the page shows of powers alone: the scores of each gateway, and how often the intervals hold."""
    of_gateways = {}
    for name in comparison.dataset.gateway_names:
        (of_gateways[name],) = [row for row in comparison.gateway_averages(name) if row["label"] == model]
    columns = {key: title for key, title in comparison.COLUMNS.items() if key not in ("steps", "seconds")}
    return {"gateways": of_gateways, "columns": columns, "bands": comparison.intervals_by_distance(model)}


def _powers(comparison: PowerComparison, model: str) -> Iterable[Sequence[Any]]:
    """A line for each test position and gateway, headings first."""
    dataset, predicted = comparison.dataset, comparison.predicted[model]
    yield ["position", "x", "y", "z", "gateway", "rssi_dbm", "predicted_dbm", "low_dbm", "high_dbm"]
    for row, index in enumerate(comparison.parts.test):
        for column, gateway in enumerate(dataset.gateway_names):
            parts = (predicted.median, predicted.low, predicted.high)
            power = dataset.rssi_dbm[index, column]
            values = ["" if power != power else f"{power:g}"]  # NaN: not received
            values += ["" if each is None else f"{each[row, column]:.3f}" for each in parts]
            yield [index, *dataset.positions[index], gateway, *values]


def _channels(comparison: ChannelComparison) -> Iterable[Sequence[Any]]:
    """A line for each test row, headings first: the SNR of each method."""
    places = comparison.dataset.positions
    yield ["row", *([] if places is None else "xyz"), *(f"snr_db_{name}" for name in comparison.snr_db)]
    for row, index in enumerate(comparison.parts.test):
        values = ["" if each[row] != each[row] else f"{each[row]:.3f}" for each in comparison.snr_db.values()]
        yield [index, *([] if places is None else places[index]), *values]


def _csv(lines: Iterable[Sequence[Any]]) -> str:
    text = StringIO()
    csv.writer(text, lineterminator="\n").writerows(lines)
    return text.getvalue()
