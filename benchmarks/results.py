"""Write docs/results.md from what the commands in it left behind; no figure is typed by hand.

python benchmarks/results.py
"""

from __future__ import annotations

import json
import os
import platform
import shutil
import tomllib
from pathlib import Path
from typing import Any

import numpy as np

from learn.comparison.experiment import summary
from scenes.scene_yaml import BUILT_IN

RUNS = Path("runs")


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


def experiment_section(name: str, told: dict[str, str]) -> list[str]:
    """A folder of compare, ablate or sweep; its figure is copied beside the page."""
    folder = RUNS / name
    title, command, figure = (told[key].strip() for key in ("title", "command", "figure"))
    protocol = read(folder / "protocol.json")
    if protocol is None or not (folder / figure).is_file():
        return []
    rows = [json.loads(line) for line in (folder / "results.jsonl").read_text().splitlines()]
    sweeping = any(row["train_size"] for row in rows)
    table = summary(rows, lambda row: (row["label"], row["train_size"] or 0))
    order = sorted(table, key=(lambda key: key) if sweeping else (lambda key: -table[key]["ssim_median"]))
    shutil.copy(folder / figure, Path("docs") / f"{name}.png")
    amount = f"{protocol['steps']} steps" if "steps" in protocol else f"{protocol['minutes']:g} minutes"
    lines = [
        f"## {title}",
        "",
        f"```\n{command}\n```",
        "",
        f"{protocol['device']} of the machine's two, the other busy with another of these experiments; "
        f"{amount} of training each; {rows[-1]['date']}. {told.get('remarks', '').strip()}",
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
    return [*lines, "", *bypasses(table), f"![{title}]({name}.png)", ""]


def bypasses(table: dict[tuple[str, int], dict[str, float]]) -> list[str]:
    """Which bypass of the paper's ablation costs most, against the spread over the seeds; the paper says BST."""
    lines = []
    parts = ("dynamic network", "delta decoder", "BST")
    for model, _ in table:
        if any((f"{model} without {part}", 0) not in table for part in parts):
            continue
        full = table[model, 0]
        costs = {part: (full, table[f"{model} without {part}", 0]) for part in parts}
        loss = {part: whole["ssim_median"] - less["ssim_median"] for part, (whole, less) in costs.items()}
        noise = {part: np.hypot(whole["ssim_spread"], less["ssim_spread"]) for part, (whole, less) in costs.items()}
        said = ", ".join(f"without {part} {-loss[part]:+.3f} ± {noise[part]:.3f}" for part in parts)
        ahead = [(loss["BST"] - loss[part]) / (noise["BST"] + noise[part]) for part in parts if part != "BST"]
        if min(ahead) > 1:
            verdict = "is confirmed here"
        elif min(ahead) < -1:
            verdict = "is refuted here, after so few steps at least"
        else:
            verdict = "is neither confirmed nor refuted: the spread over the seeds is wider than the differences"
        lines += [f"`{model}`: {said}. The paper's ordering, that bypassing BST costs most, {verdict}.", ""]
    return lines


def ladder_section() -> list[str]:
    """What led to the model that leads."""
    figures = read(RUNS / "ladder.json")
    if figures is None:
        return []
    rungs = max(figures.values(), key=len)
    return [
        "## From copying to Helmholtz kriging",
        "",
        "```\npython benchmarks/ladder.py ../shared/data/rfid-s23-160 runs/lab-6000 --json > runs/ladder.json\n```",
        "",
        "Median SSIM. `blocked from 1` is the split called `blocked`; the other three hold out the other blocks, and",
        "show how much one split of forty spectra says. The last law is `helmholtz`.",
        "",
        f"| | {' | '.join(figures)} |",
        "| --- " * (1 + len(figures)) + "|",
        *(
            f"| {rung} | "
            + " | ".join(f"{table[rung]:.3f}" if rung in table else "–" for table in figures.values())
            + " |"
            for rung in rungs
        ),
        "",
    ]


def crossvalidation_section() -> list[str]:
    """Two models of the lab's table against fresh ray tracing."""
    runs = RUNS / "compare-lab-blocked" / "runs"
    metrics = {model: read(runs / f"{model}-0" / "crossvalidation.json") for model in ("helmholtz", "bisplat-aperture")}
    found = {model: figures for model, figures in metrics.items() if figures is not None}
    if "helmholtz" not in found:
        return []
    for kind in ("map", "distance"):
        shutil.copy(runs / "helmholtz-0" / f"crossvalidation_{kind}.png", Path("docs") / f"crossvalidation_{kind}.png")
    return [
        "## Against fresh ray tracing",
        "",
        f"```\nbisplat crossvalidate {runs}/MODEL-0 --scene lab --positions 400\n```",
        "",
        "The models of the lab's `blocked` table at positions no dataset holds; figures of `helmholtz`.",
        "",
        f"| | {' | '.join(found)} |",
        "| --- " * (1 + len(found)) + "|",
        *(
            f"| {name} | " + " | ".join(f"{figures[name]:.4g}" for figures in found.values()) + " |"
            for name in found["helmholtz"]
        ),
        "",
        "![SSIM and error of the dominant direction over the region](crossvalidation_map.png)",
        "",
        "![the same against the distance to the nearest training position](crossvalidation_distance.png)",
        "",
    ]


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
        *benchmark_section(
            "view",
            "The viewer: from a drag to the picture",
            "python benchmarks/view.py runs/demo/run --json",
            "`sent` is from the arrival of a drag in the server to the new picture and 3D layers on their way: "
            "prediction, panels, encoding; the browser is suspended meanwhile. `seen` is from the mouse's move to the "
            "loaded picture in headless Chromium, which draws the 3D scene on the same two cores, without a GPU, and "
            "that is most of it.",
        ),
    ]
    for name, told in tomllib.loads(Path("benchmarks/experiments.toml").read_text()).items():
        lines += experiment_section(name, told)
    lines += ladder_section()
    lines += benchmark_section(
        "limits",
        "What the measured sample allows",
        "python benchmarks/limits.py ../shared/data/rfid-s23-160 runs/lab-6000 --json",
        "`oracle`: the weighted sum of the mean and the so many nearest known pictures whose weights have the least "
        "squared error, found by looking at the test picture: no method, but what to expect at best of weighting "
        "known pictures, as copying and kriging "
        "do. Below, median SSIM of pairs by their distance, of those recorded within ten spectra of one another "
        "(`soon`) and of those recorded later, when the tag came past again: at 3 to 6 cm the latter have little in "
        "common. Part of that is the direction of the displacement, which differs between passes; that part is the "
        "place changing, or the tracker's offset, is what the likeliest law says.",
    )
    lines += crossvalidation_section()
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
