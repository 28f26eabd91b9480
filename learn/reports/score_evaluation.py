"""The report of ``bisplat evaluate`` for received powers and for channels."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Complex, Float, Int
from matplotlib.figure import Figure

from learn.channels.compare_channels import ChannelComparison
from learn.comparison.score_table import ScoreTable
from learn.powers.power_comparison import PowerComparison
from learn.reports.figures import MapScore, draw_error_map, ranked
from learn.reports.html_page import embedded, write_page
from learn.reports.paper import PAGE, at_paper_size, save
from learn.reports.plots import MAGNITUDE
from learn.reports.provenance import Provenance
from learn.reports.score_report import draw_score_distribution, draw_scores
from learn.reports.table_files import as_csv, write_scores
from scenes.files.atomic import write_atomically
from simulate.dataset.dataset import Dataset
from simulate.spectra.band import delay_spread


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
    write_atomically(folder / "per_sample.csv", as_csv(table).encode())
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
            power = dataset.powers[index, column]
            values = ["" if power != power else f"{power:g}"]  # NaN: not received
            values += ["" if each is None else f"{each[row, column]:.3f}" for each in parts]
            yield [index, *dataset.positions[index], gateway, *values]


def _channels(comparison: ChannelComparison) -> Iterable[Sequence[Any]]:
    """A line for each test row, headings first: the SNR of each method."""
    places = comparison.dataset.places
    yield ["row", *([] if places is None else "xyz"), *(f"snr_db_{name}" for name in comparison.snr_db)]
    for row, index in enumerate(comparison.parts.test):
        values = ["" if each[row] != each[row] else f"{each[row]:.3f}" for each in comparison.snr_db.values()]
        yield [index, *([] if places is None else places[index]), *values]


WORST = 95  # Percentile of the errors at which the colour scale ends


def draw_power_figures(comparison: PowerComparison, model: str, folder: Path, made: Provenance) -> dict[str, str]:
    """Draw error_map.png (and .pdf): the median error of all gateways at each test position."""
    dataset, parts, errors = comparison.dataset, comparison.parts, comparison.errors[model]
    captions = {"error_cdf": "Distribution of the absolute errors, all gateways together."}
    heard = ~np.isnan(errors).all(axis=1)
    if not heard.any():
        return captions
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        typical = np.nanmedian(errors[heard], axis=1)
    ends = float(np.percentile(typical, WORST)) or 1.0
    score = MapScore(typical, (0.0, ends), "median error of the gateways (dB)", f"{MAGNITUDE}_r")
    draw_error_map(
        dataset.positions[parts.test][heard],
        [score],
        dataset.positions[parts.known],
        folder / "error_map.png",
        made,
    )
    captions["error_map"] = f"Where {model} errs: the median error of all gateways at each test position."
    return captions


LEAST_DB = -40.0  # Magnitudes further below the largest one of an example are drawn there


def draw_channel_figures(comparison: ChannelComparison, model: str, folder: Path, made: Provenance) -> dict[str, str]:
    """Draw examples.png, delay_spread.png if the bandwidth is known, and snr_map.png if positions are (and PDFs)."""
    dataset, test, snr = comparison.dataset, comparison.parts.test, comparison.snr_db[model]
    captions = {"snr_cdf": "Distribution of the SNR of the predicted downlink over the test rows."}
    heard = ~np.isnan(snr)
    if not heard.any():
        return captions
    shown = heard[comparison.shown]
    rows = test[comparison.shown][shown]
    predicted = comparison.examples[model][shown]
    draw_examples_of_channels(dataset, rows, predicted, snr[comparison.shown][shown], folder / "examples.png", made)
    captions["examples"] = (
        "Test rows from the lowest to the highest SNR: magnitude at the antenna that receives most. The uplink is left "
        "of the dotted line, and the downlink right of it."
    )
    if dataset.band is not None:
        bandwidth = dataset.downlink.shape[2] * dataset.band.spacing
        true = delay_spread(dataset.downlink[rows], bandwidth)
        late = {
            row["label"]: 1e9 * np.abs(delay_spread(comparison.examples[row["label"]][shown], bandwidth) - true)
            for row in comparison.table()
        }
        label = "error of the delay spread (ns)"
        draw_score_distribution(late, label, "share of rows", folder / "delay_spread.png", made)
        captions["delay_spread"] = (
            f"Absolute errors of the downlink's RMS delay spread at {len(rows)} test rows. The true spreads have a "
            f"median of {1e9 * np.median(true):.3g} ns. "
            f"Delays are told apart from {1e9 / bandwidth:.0f} ns on."
        )
    if dataset.places is not None:
        low, high = (float(each) for each in np.percentile(snr[heard], (5, 95)))
        score = MapScore(snr[heard], (low, max(high, low + 1)), "SNR of the downlink (dB)")
        known = dataset.positions[comparison.parts.known]
        draw_error_map(dataset.positions[test][heard], [score], known, folder / "snr_map.png", made)
        captions["snr_map"] = f"SNR of {model} over the region."
    return captions


@at_paper_size()
def draw_examples_of_channels(
    dataset: Dataset,
    rows: Int[np.ndarray, " E"],
    predicted: Complex[np.ndarray, "E A S"],
    snr: Float[np.ndarray, " E"],
    path: Path,
    made: Provenance,
) -> None:
    """Draw five examples, from the worst to the best SNR: measured and predicted magnitude over the subcarriers."""
    chosen = ranked(snr)
    figure = Figure(figsize=(PAGE, 0.6 + 1.1 * len(chosen)), layout="constrained")
    axes = figure.subplots(len(chosen), 1, sharex=True)
    each = dataset.uplink.shape[2]
    places, label = np.arange(2.0 * each), "subcarrier"
    if dataset.frequencies is not None:
        places, label = (dataset.frequencies - dataset.frequency.hertz) / 1e6, "frequency from the carrier (MHz)"
    for axis, (name, index) in zip(axes, chosen, strict=True):
        both = np.concatenate([dataset.uplink[rows[index]], dataset.downlink[rows[index]]], axis=1)
        antenna = int(np.abs(both).sum(axis=1).argmax())
        largest = np.abs(both[antenna]).max()
        axis.plot(places, in_db(both[antenna] / largest), color="0.35", lw=1.6, label="measured")
        axis.plot(
            places[each:], in_db(predicted[index, antenna] / largest), color="#1f4e9e", ls="--", label="predicted"
        )
        axis.axvline((places[each - 1] + places[each]) / 2, color="0.6", ls=":", lw=0.8)
        axis.set_ylabel(f"{name}\n{snr[index]:.1f} dB")
        axis.grid(alpha=0.3)
    axes[0].set_title("magnitude relative to the largest (dB)")
    axes[-1].set_xlabel(label)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper left", ncols=2)
    save(figure, path, made)


def in_db(magnitude: Complex[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """Magnitudes in dB, at least ``LEAST_DB``."""
    return 20 * np.log10(np.maximum(np.abs(magnitude), 10 ** (LEAST_DB / 20)))
