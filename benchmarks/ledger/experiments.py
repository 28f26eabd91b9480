"""The figures of a folder of ``bisplat compare``."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from benchmarks.ledger.entry import Measured

COLUMNS = [
    "method",
    "training spectra",
    "SSIM median",
    "spread over seeds",
    "SSIM mean",
    "5th percentile",
    "PSNR (dB)",
    "MAE",
    "AoA error (°)",
    "parameters",
    "training (s)",
    "ms per spectrum",
]

Table = dict[tuple[str, int], dict[str, float]]
"""(label of the method, number of training spectra or 0 for all) -> its figures, averaged over the seeds."""


def experiment(runs: Path, name: str) -> Measured | None:
    """A row for each method, the most accurate first, then the bound; a sweep by method and number of spectra."""
    folder = runs / name
    if not ((folder / "protocol.json").is_file() and (folder / "results.jsonl").is_file()):
        return None
    from learn.comparison.averages import averaged
    from learn.quantities.array_ceiling import CEILING, shown_name

    protocol = json.loads((folder / "protocol.json").read_text())
    rows = [json.loads(line) for line in (folder / "results.jsonl").read_text().splitlines()]
    averages = averaged(rows, ("label", "train_size"), "ssim_median")
    table: Table = {
        (row["label"], row["train_size"] or 0): {key: value for key, value in row.items() if value is not None}
        for row in averages
    }
    sweeping = any(row["train_size"] for row in rows)
    order = sorted(table) if sweeping else sorted(table, key=lambda key: -table[key]["ssim_median"])
    order.sort(key=lambda key: key[0] == CEILING)  # the bound last
    amount = f"{protocol['steps']} steps" if protocol["steps"] is not None else f"{protocol['minutes']:g} minutes"
    return Measured(
        date=rows[-1]["date"],
        conditions=f"{protocol['device']}; {amount} of training each; {rows[0]['test']} test spectra",
        columns=COLUMNS,
        rows=[_cells(shown_name(label), table[label, size]) for label, size in order],
        findings=_verdicts(table),
    )


def _cells(label: str, row: dict[str, float]) -> list[str]:
    def cell(key: str, digits: int) -> str:
        return f"{row[key]:.{digits}f}" if key in row else "–"

    return [
        label,
        cell("train", 0),
        cell("ssim_median", 3),
        f"{row['ssim_spread']:.3f} ({row['seeds']})" if row["seeds"] > 1 else "one seed",
        cell("ssim_mean", 3),
        cell("ssim_p05", 3),
        cell("psnr_mean", 1),
        cell("mae_mean", 3),
        cell("aoa_error_median_deg", 1),
        cell("parameters", 0),
        cell("seconds", 0),
        cell("milliseconds", 1),
    ]


def _verdicts(table: Table) -> list[str]:
    """For each model with all three bypasses of the paper: which costs most, against the spread over the seeds."""
    sentences = []
    parts = ("dynamic network", "delta decoder", "BST")
    for model, _ in table:
        if any((f"{model} without {part}", 0) not in table for part in parts):
            continue
        full = table[model, 0]
        bypassed = {part: table[f"{model} without {part}", 0] for part in parts}
        loss = {part: full["ssim_median"] - row["ssim_median"] for part, row in bypassed.items()}
        if any("ssim_spread" not in row for row in (full, *bypassed.values())):
            said = ", ".join(f"without {part} {-loss[part]:+.3f}" for part in parts)
            sentences.append(f"`{model}`: {said}. One seed neither confirms nor refutes the paper's ordering.")
            continue
        noise = {part: np.hypot(full["ssim_spread"], row["ssim_spread"]) for part, row in bypassed.items()}
        said = ", ".join(f"without {part} {-loss[part]:+.3f} ± {noise[part]:.3f}" for part in parts)
        ahead = [(loss["BST"] - loss[part]) / (noise["BST"] + noise[part]) for part in parts if part != "BST"]
        if min(ahead) > 1:
            verdict = "is confirmed here"
        elif min(ahead) < -1:
            verdict = "is refuted here, after so few steps at least"
        else:
            verdict = "is neither confirmed nor refuted: the spread over the seeds is wider than the differences"
        sentences.append(f"`{model}`: {said}. The paper's ordering, that bypassing BST costs most, {verdict}.")
    return sentences
