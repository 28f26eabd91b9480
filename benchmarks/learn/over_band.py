"""How well are responses over a band predicted at new positions?

python -m benchmarks.learn.over_band --json > runs/over_band.json

The dataset has responses of 8 antennas over 52 subcarriers (20 MHz) in the lab, by rays, with noise
25 dB below the signal. Methods learn from the responses at known positions, and are scored at others (`bisplat compare
--quantity response`).
"""

from __future__ import annotations

import tempfile
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import tyro

from benchmarks.ledger.printing import print_figures
from benchmarks.ledger.walks import channels_in_lab

SIZES = (50, 200, 800)
"""Numbers of training positions; a ninth as many are known besides, for validation."""

LEARNED, LEARNED_SIZES, MINUTES = ("mlp-responses", "bisplat-aperture"), (200, 800), 2.0
"""Networks, the numbers of training positions at which they are compared (split random), and minutes of training."""

COLUMNS = {
    "known": "known",
    "snr_median_db": "SNR, median, dB",
    "snr_p10_db": "SNR, 10 %, dB",
    "correlation_median": "correlation, median",
    "delay_spread_error_median_ns": "delay spread off, ns",
    "coverage_90": "in 90 % interval",
    "seconds": "seconds",
}
"""What is told of a row, by the keys of ``Comparison``."""


def main(
    folder: Path = Path("runs/walks/channels"),
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Compare methods over the band in the lab."""
    from learn.comparison.compare import compare
    from simulate.generation.simulation import simulate
    from simulate.rays.core.propagation import Propagation

    with tempfile.TemporaryDirectory() as temporary:
        if smallest:
            band, sizes = Path(temporary) / "band", (8,)
            coarse = {"bandwidth": 20e6, "subcarriers": 8, "propagation": Propagation(max_depth=1, rays=1000)}
            simulate("closet", band, 60, **coarse)
        else:
            channels_in_lab(folder)
            band, sizes = folder / "band", SIZES
        learned_sizes, minutes = (sizes, 0.01) if smallest else (LEARNED_SIZES, MINUTES)
        over_band = partial(compare, band, quantity="response")
        compared = [("random", over_band(split="random", sizes=sizes))]
        compared += [("random", over_band(LEARNED, split="random", sizes=learned_sizes, budget=minutes))]
        compared += [("blocked", over_band(split="blocked", sizes=sizes))]
        table: dict[str, dict[str, Any]] = {}
        for split, rows in compared:
            for row in rows:
                of_row = {name: row[key] for key, name in COLUMNS.items() if row[key] is not None}
                shown = {name: float(f"{value:.3g}") if name != "known" else value for name, value in of_row.items()}
                table[f"{split}, {row['train_size']}, {row['label']}"] = shown
    print_figures(table, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
