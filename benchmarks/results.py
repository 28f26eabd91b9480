"""Write docs/results.md from what the commands in it left behind; no figure is typed by hand.

python benchmarks/results.py
"""

from __future__ import annotations

import json
import os
import platform
from pathlib import Path
from typing import Any

RUNS = Path("runs")
MODELS = ("bisplat-aperture", "bisplat", "bisplat-plus")
SPLITS = ("files", "blocked")


def read(path: Path) -> dict[str, Any] | None:
    """A JSON file, None where the command that writes it has not been run."""
    return json.loads(path.read_text()) if path.is_file() else None


def machine() -> str:
    """What the commands ran on."""
    cpu = next((line.split(":")[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")), "?")
    return f"{os.cpu_count()} cores of {cpu}, {platform.system()}, Python {platform.python_version()}"


def demo_section() -> list[str]:
    """The demo's metrics.json."""
    metrics = read(RUNS / "demo" / "metrics.json")
    training = read(RUNS / "demo" / "run" / "training.json")
    if metrics is None or training is None:
        return []
    rows = [
        f"| {name} | {value:.4g} |" if isinstance(value, float) else f"| {name} | {value} |"
        for name, value in metrics.items()
    ]
    return [
        "## The demo",
        "",
        "```\nmake demo\n```",
        "",
        f"{training['date']}, {training['device']}; training took {training['seconds']:.0f} s of it.",
        "",
        "| metrics.json | |",
        "| --- | --- |",
        *rows,
        "",
    ]


def measured_section() -> list[str]:
    """Runs on the measured RFID sample."""
    lines = [
        "## The measured RFID sample",
        "",
        "```",
        "bisplat train ../shared/data/rfid-s23-160 -o runs/rfid-MODEL-SPLIT --model MODEL --split SPLIT \\",
        "    --steps STEPS --batch-size BATCH",
        "bisplat evaluate runs/rfid-MODEL-SPLIT --json",
        "```",
        "",
        "160 spectra of NeRF²'s RFID measurement. `files` is the sample's own random split, which leaks: the positions",
        "follow a path. `blocked` holds out every fourth run of ten positions. Median SSIM (scikit-image, data range",
        "1) on the test part; the baselines are on the same split.",
        "",
        "| split | model | SSIM | nearest | inverse distance | mean picture | ceiling | AoA error (°) | steps "
        "| batch | training |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for split in SPLITS:
        for model in MODELS:
            folder = RUNS / f"rfid-{model}-{split}"
            metrics, training = read(folder / "evaluation" / "metrics.json"), read(folder / "training.json")
            config = read(folder / "config.json")
            if metrics is None or training is None or config is None:
                continue
            baselines = [
                metrics["baselines"][name]["ssim_median"]
                for name in ("nearest", "inverse_distance", "mean_picture", "array_ceiling")
            ]
            figures = " | ".join(f"{value:.3f}" for value in (metrics["ssim_median"], *baselines))
            lines.append(
                f"| {split} | {model} | {figures} | {metrics['aoa_error_median_deg']:.1f} | {training['steps']} | "
                f"{config['batch_size']} | "
                f"{training['seconds'] / 60:.1f} min, {training['device']}, {training['date']} |"
            )
    return [*lines, ""]


def benchmark_section(name: str, title: str, command: str, remarks: str) -> list[str]:
    """One JSON object that a benchmark printed, kept in runs/NAME.json."""
    figures = read(RUNS / f"{name}.json")
    if figures is None:
        return []
    rows = [f"| {key} | {value} |" for key, value in figures.items()]
    return [
        f"## {title}",
        "",
        f"```\n{command} > runs/{name}.json\n```",
        "",
        remarks,
        "",
        "| | |",
        "| --- | --- |",
        *rows,
        "",
    ]


def main() -> None:
    """Write docs/results.md."""
    lines = [
        "# Results",
        "",
        "Written by `python benchmarks/results.py` from what the commands below left in `runs/`.",
        f"Machine: {machine()}.",
        "",
        *demo_section(),
        *measured_section(),
        *benchmark_section(
            "simulate",
            "Simulation: chains found once against one solver call per transmitter",
            "python benchmarks/simulate.py --json",
            "The lab at depth 5. `ratio` is the loop's time per transmitter over ours, everything from the start of "
            "the command to the last file on disk included, at the second size. Both are compared with a third, denser "
            "tracing of ten million rays per transmitter: the nearer one is the more complete.\n\n"
            "![cost](simulate.png)",
        ),
        *benchmark_section(
            "render",
            "Renderer: compiled against reference",
            "python benchmarks/render.py --json",
            "Forward and backward, batch of 8, 500 primitives, 90 × 360.",
        ),
    ]
    Path("docs/results.md").write_text("\n".join(lines))


if __name__ == "__main__":
    main()
