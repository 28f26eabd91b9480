"""The report of ``bisplat evaluate`` for received powers and for channels: one method beside the baselines."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Complex, Float, Int
from matplotlib.figure import Figure

from learn.comparison.comparison import Comparison
from learn.data.split_distances import distance_bands
from learn.quantities.channels import examples
from learn.quantities.powers import score_powers
from learn.quantities.quantity import Prediction
from learn.reports.comparison_report import draw_scores, write_results
from learn.reports.figures import MapScore, draw_distribution, draw_error_map, ranked
from learn.reports.html_page import embedded, write_page
from learn.reports.paper import PAGE, at_paper_size, save
from learn.reports.plots import MAGNITUDE
from learn.reports.provenance import Provenance
from learn.reports.table_files import as_csv
from scenes.files.atomic import write_atomically
from simulate.dataset.dataset import Dataset
from simulate.spectra.band import delay_spread


def write_method_report(comparison: Comparison, model: str, folder: Path) -> None:
    """Write report.html, results.json, per_sample.csv, the table as LaTeX and CSV, and the figures as PNG and PDF."""
    made = Provenance.of_comparison(comparison, f"{model} on held-out {comparison.quantity.things}")
    write_results(comparison, folder, made)
    name, of_each = draw_scores(comparison, folder, made), comparison.quantity.of_each
    captions, table, section = SECTIONS.get(comparison.quantity.name, _others)(comparison, model, folder, made)
    captions = {name: f"Distribution of the {of_each.label}, {of_each.share}.", **captions}
    write_atomically(folder / "per_sample.csv", as_csv(table).encode())
    warning = None if comparison.distances is None else comparison.distances.warning()
    write_page(
        folder / "report.html",
        "scores.html.j2",
        made,
        model=model,
        comparison=comparison,
        facts=comparison.facts(),
        rows={row["label"]: row for row in comparison.table()},
        columns=comparison.columns,
        warning=warning,
        of_powers=section,
        figures=dict(zip(captions.values(), embedded(folder, tuple(captions)).values(), strict=True)),
    )


Section = tuple[dict[str, str], Iterable[Sequence[Any]], dict[str, Any]]
"""Captions of figures by their names, the lines of per_sample.csv, and what the page shows besides."""


def _powers(comparison: Comparison, model: str, folder: Path, made: Provenance) -> Section:
    """What the report of powers shows: the scores of each gateway, and how often the intervals hold."""
    dataset, each = comparison.dataset, comparison.each[model]
    truth = dataset.powers[comparison.test]
    of_gateways = {}
    for number, name in enumerate(dataset.gateway_names):
        of_one: dict[str, Any] = {part: each[part][:, [number]] for part in ("value", "low", "high") if part in each}
        of_gateways[name] = score_powers(Prediction(**of_one), truth[:, [number]], dataset.floor_dbm)
    columns = comparison.quantity.columns
    section = {"gateways": of_gateways, "columns": columns, "bands": intervals_by_distance(comparison, model)}
    return _draw_power_errors(comparison, model, folder, made), _each_power(comparison, each), section


def intervals_by_distance(comparison: Comparison, model: str) -> list[dict[str, Any]]:
    """How often the 90 % intervals hold, by the distance to the nearest known position. Empty: none is stated."""
    each, truth = comparison.each[model], comparison.dataset.powers[comparison.test]
    if "low" not in each or comparison.distances is None:
        return []
    within, width = (each["low"] <= truth) & (truth <= each["high"]), each["high"] - each["low"]
    found = []
    for words, near in distance_bands(comparison.distances.distance / comparison.distances.wavelength):
        counted = near[:, None] & ~np.isnan(truth)
        if counted.any():
            share, median = float(within[counted].mean()), float(np.median(width[counted]))
            row = {"distance": words, "powers": int(counted.sum())}
            found.append({**row, "coverage_90": share, "interval_median_db": median})
    return found


def _each_power(comparison: Comparison, each: Mapping[str, np.ndarray]) -> Iterable[Sequence[Any]]:
    """A line for each test position and gateway, headings first."""
    dataset = comparison.dataset
    yield ["position", "x", "y", "z", "gateway", "rssi_dbm", "predicted_dbm", "low_dbm", "high_dbm"]
    for row, index in enumerate(comparison.test):
        for column, gateway in enumerate(dataset.gateway_names):
            power = dataset.powers[index, column]
            values = ["" if power != power else f"{power:g}"]  # NaN: not received
            values += [f"{each[part][row, column]:.3f}" if part in each else "" for part in ("value", "low", "high")]
            yield [index, *dataset.positions[index], gateway, *values]


def _channels(comparison: Comparison, model: str, folder: Path, made: Provenance) -> Section:
    """What the report of channels shows."""
    return _draw_channels(comparison, model, folder, made), _each_row(comparison), {}


def _others(comparison: Comparison, model: str, folder: Path, made: Provenance) -> Section:
    """What the report of another quantity shows."""
    return {}, _each_row(comparison), {}


def _each_row(comparison: Comparison) -> Iterable[Sequence[Any]]:
    """A line for each test row, headings first: the score of each method."""
    places, key = comparison.dataset.places, comparison.quantity.of_each.key
    yield ["row", *([] if places is None else "xyz"), *(f"{key}_{name}" for name in comparison.each)]
    for row, index in enumerate(comparison.test):
        scores = [each[key][row] for each in comparison.each.values()]
        where = [] if places is None else places[index]
        yield [index, *where, *("" if one != one else f"{one:.3f}" for one in scores)]


WORST = 95  # Percentile of the errors at which the colour scale ends


def _draw_power_errors(comparison: Comparison, model: str, folder: Path, made: Provenance) -> dict[str, str]:
    """Draw error_map.png (and .pdf): the median error of all gateways at each test position."""
    dataset, parts, errors = comparison.dataset, comparison.parts, comparison.each[model]["error_db"]
    heard = ~np.isnan(errors).all(axis=1)
    if not heard.any():
        return {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        typical = np.nanmedian(errors[heard], axis=1)
    ends = float(np.percentile(typical, WORST)) or 1.0
    score = MapScore(typical, (0.0, ends), "median error of the gateways (dB)", f"{MAGNITUDE}_r")
    draw_error_map(
        dataset.positions[comparison.test][heard],
        [score],
        dataset.positions[parts.known],
        folder / "error_map.png",
        made,
    )
    return {"error_map": f"Where {model} errs: the median error of all gateways at each test position."}


LEAST_DB = -40.0  # Magnitudes further below the largest one of an example are drawn there


def _draw_channels(comparison: Comparison, model: str, folder: Path, made: Provenance) -> dict[str, str]:
    """Draw examples.png, delay_spread.png if the bandwidth is known, and snr_map.png if positions are (and PDFs)."""
    dataset, test, snr = comparison.dataset, comparison.test, comparison.each[model]["snr_db"]
    captions: dict[str, str] = {}
    kept = examples(len(test))
    heard = ~np.isnan(snr)
    if not heard.any():
        return captions
    shown = heard[kept]
    rows = test[kept][shown]
    predicted = comparison.each[model]["examples"][shown]
    draw_examples_of_channels(dataset, rows, predicted, snr[kept][shown], folder / "examples.png", made)
    captions["examples"] = (
        "Test rows from the lowest to the highest SNR: magnitude at the antenna that receives most. The uplink is left "
        "of the dotted line, and the downlink right of it."
    )
    if dataset.band is not None:
        bandwidth = dataset.downlink.shape[2] * dataset.band.spacing
        true = delay_spread(dataset.downlink[rows], bandwidth)
        late = {
            row["label"]: 1e9 * np.abs(delay_spread(comparison.each[row["label"]]["examples"][shown], bandwidth) - true)
            for row in comparison.table()
        }
        label = "error of the delay spread (ns)"
        draw_distribution(late, folder / "delay_spread.png", label, "share of rows", made)
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


SECTIONS: dict[str, Callable[[Comparison, str, Path, Provenance], Section]] = {"power": _powers, "channel": _channels}
"""What the report of a quantity shows besides the table and the distribution of the scores."""
