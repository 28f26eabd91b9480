"""Write docs/results.md from what the commands in it left behind; no figure is typed by hand.

python benchmarks/results.py
"""

from __future__ import annotations

import json
import os
import platform
import shutil
import sys
from pathlib import Path
from typing import Any

sys.path.pop(0)  # this folder, whose simulate.py is not the package of that name

from learn.experiment import summary
from scenes.scene_yaml import BUILT_IN

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


def earlier(config: dict[str, Any] | None) -> str:
    """A mark for runs of code that has since changed: they have six octaves of the position and no averaged weights."""
    return "" if config is not None and "size" in config else " (by an earlier commit, see docs/model.md)"


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
        f"{training['date']}, {training['device']}; training took {training['seconds']:.0f} s of it"
        f"{earlier(read(RUNS / 'demo' / 'run' / 'config.json'))}.",
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
        "1) on the test part; the baselines are on the same split. Read the baselines first: a model below them has",
        "nothing to offer there yet. Rows of different steps × batch do not compare architectures: bisplat-plus had a",
        "short run only. Times on one thread are those of two runs side by side.",
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
                f"{training['seconds'] / 60:.1f} min, {training['device']}, {training['date']}"
                f"{earlier(config)} |"
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


def experiment_section(name: str, title: str, command: str, remarks: str, figure: str) -> list[str]:
    """A folder of compare, ablate or sweep, kept as runs/NAME; its figure is copied beside the page."""
    folder = RUNS / name
    protocol = read(folder / "protocol.json")
    if protocol is None or not (folder / figure).is_file():
        return []
    rows = [json.loads(line) for line in (folder / "results.jsonl").read_text().splitlines()]
    sweeping = any(row["train_size"] for row in rows)
    table = summary(rows, lambda row: (row["label"], row["train_size"] or 0))
    order = sorted(table, key=(lambda key: key) if sweeping else (lambda key: -table[key]["ssim_median"]))
    shutil.copy(folder / figure, Path("docs") / f"{name}.png")
    lines = [
        f"## {title}",
        "",
        f"```\n{command}\n```",
        "",
        f"{protocol['device']}, {protocol['minutes']:g} minutes of training each; {rows[-1]['date']}. {remarks}",
        "",
        "| method | training spectra | SSIM median | spread over seeds | SSIM mean | 5th percentile | PSNR (dB) | MAE "
        "| AoA error (°) | parameters | training (s) | ms per spectrum |",
        "| --- " * 12 + "|",
    ]
    for key in order:
        row = table[key]
        spread = f"{row['ssim_spread']:.3f} ({row['seeds']})" if row["seeds"] > 1 else "one seed"
        figures = [row[name] for name in ("ssim_mean", "ssim_p05", "psnr_mean", "mae_mean", "aoa_error_median_deg")]
        costs = [row.get(name) for name in ("parameters", "training_seconds", "milliseconds_per_spectrum")]
        cells = [
            key[0],
            f"{row['train']:.0f}" if "train" in row else "–",
            f"{row['ssim_median']:.3f}",
            spread,
            *(f"{value:.3f}" for value in figures[:2]),
            f"{figures[2]:.1f}",
            f"{figures[3]:.3f}",
            f"{figures[4]:.1f}",
            *("–" if value is None else f"{value:.0f}" for value in costs[:2]),
            "–" if costs[2] is None else f"{costs[2]:.1f}",
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return [*lines, "", f"![{title}]({name}.png)", ""]


def scale_section() -> list[str]:
    """10⁸ spectra, from the benchmark's time per spectrum and the demo's bytes per spectrum."""
    figures, dataset = read(RUNS / "simulate.json"), RUNS / "demo" / "dataset"
    if figures is None or not dataset.is_dir():
        return []
    milliseconds = figures["milliseconds_per_further_spectrum_to_50000"]
    pictures = [path.stat().st_size for path in (dataset / "spectrum").iterdir()]
    channels = (dataset / "channels.npz").stat().st_size / len(pictures)
    pictured = sum(pictures) / len(pictures)
    count = 10**8
    days = milliseconds / 1e3 * count / 86400
    rows = {
        "one such machine": f"{days:.0f} days",
        "200 such machines": f"{24 * days / 200:.1f} hours, and the search for chains once",
        "pictures": f"{pictured / 1e3:.1f} kB each, {pictured * count / 1e12:.2f} TB in 10⁸ files",
        "the same as uint8 arrays": f"{90 * 360 * count / 1e12:.2f} TB",
        "channels alone (spectra follow from them)": f"{channels:.0f} bytes each, {channels * count / 1e9:.0f} GB",
        "parts of 100 positions": f"{count // 100:,} tasks of {milliseconds / 10:.1f} s",
    }
    return [
        "## What 10⁸ spectra would take",
        "",
        "Computed from the figures above and from the files of the demo; [docs/scale.md](scale.md) says what follows.",
        "",
        "| | |",
        "| --- | --- |",
        *(f"| {name} | {value} |" for name, value in rows.items()),
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
            "completeness",
            "Which of the two is the more complete",
            "python benchmarks/completeness.py --json",
            "Path by path at five positions of the lab: the share of the power that only a search of four million "
            "rays for that one transmitter found, and the share that only our chains have. What keeps the comparison "
            "with the loop below a median SSIM of 0.99 and a 5th percentile of 0.97 is what the loop misses.",
        ),
        *benchmark_section(
            "path",
            "A simulated path beside the measured one",
            "python benchmarks/path.py ../shared/data/rfid-s23-160 --json",
            "Median SSIM of pairs of spectra, by the distance of their positions: `--placement path` in the lab, and "
            "the measured RFID sample. A bin of fewer than five pairs is left out (nan).",
        ),
        *benchmark_section(
            "render",
            "Renderer: compiled against reference",
            "python benchmarks/render.py --figure docs/render.png --json",
            "Forward and backward, batch of 8, 500 primitives, 90 × 360. `compiled_torch` is `torch.compile` of the "
            "reference. Memory is what a pass adds to a process at its highest.\n\n![time against N_p](render.png)",
        ),
        *benchmark_section(
            "train",
            "Training bisplat-aperture: the loop as first written and as it is",
            "python benchmarks/train.py runs/demo/dataset --json",
            "Where a step of eight spectra spends its milliseconds, and how long either takes to the validation SSIM "
            "that the first ends with. `networks` is what renderer, loss and optimiser leave of the step. The demo's "
            "dataset, 1500 steps.",
        ),
    ]
    for split in SPLITS:
        lines += experiment_section(
            f"compare-rfid-{split}",
            f"Every method on the measured sample, `{split}`",
            f"bisplat compare ../shared/data/rfid-s23-160 -o runs/compare-rfid-{split} --split {split} --budget 1",
            "A first look, too short for the large models: nerf2 is of a reduced size, bisplat and swiftwrf got few "
            "steps, bisplat-plus has no row yet. Validations were not yet counted in the budget of the rows that took "
            "longer than it.",
            "ssim_cdf.png",
        )
    lines += scale_section()
    lines += [
        "## The built-in places",
        "",
        "```\nfor place in lab conference bedroom office; do bisplat scene $place -o docs/$place.png; done\n```",
        "",
        *(f"![{place}]({place}.png)\n" for place in BUILT_IN),
    ]
    Path("docs/results.md").write_text("\n".join(lines))


if __name__ == "__main__":
    main()
