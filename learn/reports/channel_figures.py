"""Figures of an evaluation of channels: examples over the subcarriers, errors of the delay spread, and a map."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Complex, Float, Int
from matplotlib.figure import Figure

from learn.channels.channel_comparison import ChannelComparison
from learn.reports.figures import MapScore, draw_error_map, ranked
from learn.reports.paper import PAGE, at_paper_size, save
from learn.reports.provenance import Provenance
from learn.reports.score_distribution import draw_score_distribution
from simulate.csi.csi_dataset import CsiDataset
from simulate.spectra.band import delay_spread

LEAST_DB = -40.0
"""Magnitudes further below the largest one of an example are drawn there."""


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
    if dataset.positions is not None:
        low, high = (float(each) for each in np.percentile(snr[heard], (5, 95)))
        score = MapScore(snr[heard], (low, max(high, low + 1)), "SNR of the downlink (dB)")
        known = dataset.positions[comparison.parts.known]
        draw_error_map(dataset.positions[test][heard], [score], known, folder / "snr_map.png", made)
        captions["snr_map"] = f"SNR of {model} over the region."
    return captions


@at_paper_size()
def draw_examples_of_channels(
    dataset: CsiDataset,
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
    if dataset.frequencies is not None and dataset.frequency is not None:
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
