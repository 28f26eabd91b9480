"""The figures that the commands of the page left in runs/; each function returns None where its command was not run."""

from __future__ import annotations

import datetime
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from benchmarks.ledger.entry import Measured
from benchmarks.ledger.experiments import experiment
from scenes.files.errors import InputError


def _read(path: Path) -> dict[str, Any] | None:
    """A JSON object; None where there is no such file."""
    if not path.is_file():
        return None
    try:
        return json.loads(path.read_text())
    except ValueError as error:
        raise InputError(f"{path}: expected the JSON object that a command writes, found {error}") from error


def _benchmark_figures(runs: Path, name: str) -> tuple[dict[str, Any], str, str] | None:
    """Figures, date and machine of what a benchmark printed into runs/NAME.json."""
    figures = _read(runs / f"{name}.json")
    if figures is None:
        return None
    if not {"date", "machine", "smallest"} <= figures.keys():
        raise InputError(
            f"{runs / name}.json: expected the entries date, machine and smallest that a benchmark prints with --json, "
            f"found {', '.join(figures)}"
        )
    if figures.pop("smallest"):
        raise InputError(f"{runs / name}.json: expected the figures of a whole run, found those of one with --smallest")
    return figures, figures.pop("date"), figures.pop("machine")


def demo(runs: Path, name: str) -> Measured | None:
    """The metrics.json of ``bisplat demo``."""
    metrics = _read(runs / name / "metrics.json")
    training = _read(runs / name / "run" / "training.json")
    if metrics is None or training is None:
        return None
    return Measured(
        date=training["date"],
        conditions=f"{training['device']}; fitting the default model took {training['seconds']:.0f} s of it",
        columns=["metrics.json", ""],
        rows=[[key, f"{value:.4g}" if isinstance(value, float) else str(value)] for key, value in metrics.items()],
    )


def benchmark(runs: Path, name: str) -> Measured | None:
    """The JSON object that a benchmark printed: a row for each figure, and one for each object of figures."""
    found = _benchmark_figures(runs, name)
    if found is None:
        return None
    figures, date, machine = found
    rows = [[key, "–" if value is None else str(value)] for key, value in _flat(figures)]
    return Measured(date, machine, columns=["", ""], rows=rows)


def _flat(figures: dict[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Figures of an object, and of the objects in it, whose names are put before; an innermost one is one entry."""
    for key, value in figures.items():
        if isinstance(value, dict) and any(isinstance(each, dict) for each in value.values()):
            yield from _flat(value, f"{before}{key}, ")
        elif isinstance(value, dict):
            yield f"{before}{key}", ", ".join(f"{name} {each}" for name, each in value.items())
        else:
            yield f"{before}{key}", value


def ladder(runs: Path, name: str) -> Measured | None:
    """The tables of benchmarks/learn/ladder.py, a column for each table and a row for each method."""
    found = _benchmark_figures(runs, name)
    if found is None:
        return None
    figures, date, machine = found
    methods = max(figures.values(), key=len)
    rows = [
        [method, *(f"{table[method]:.3f}" if method in table else "–" for table in figures.values())]
        for method in methods
    ]
    return Measured(date, machine, columns=["", *figures], rows=rows)


def table(runs: Path, name: str) -> Measured | None:
    """The table that a benchmark printed: a row for each of its objects, and a column for each of their figures.

    Its texts and single figures become conditions.
    """
    found = _benchmark_figures(runs, name)
    if found is None:
        return None
    figures, date, machine = found
    lines = {label: row for label, row in figures.items() if isinstance(row, dict)}
    conditions = "; ".join(f"{key} {value}" for key, value in figures.items() if key not in lines)
    columns = dict.fromkeys(column for row in lines.values() for column in row)
    rows = [[label, *(str(row.get(column, "–")) for column in columns)] for label, row in lines.items()]
    return Measured(date, machine, conditions, columns=["", *columns], rows=rows)


def crossvalidation(runs: Path, name: str) -> Measured | None:
    """What ``bisplat crossvalidate`` left in two runs of the lab's ``blocked`` table, a column for each model."""
    paths = {
        model: runs / "compare-lab-blocked" / "runs" / f"{model}-0" / "crossvalidation.json"
        for model in ("helmholtz", "bisplat-aperture")
    }
    figures = {model: _read(path) for model, path in paths.items()}
    found = {model: each for model, each in figures.items() if each is not None}
    if len(found) < len(paths):
        return None
    latest = max(path.stat().st_mtime for path in paths.values())
    return Measured(
        date=datetime.date.fromtimestamp(latest).isoformat(),
        columns=["", *found],
        rows=[[key, *(f"{each[key]:.4g}" for each in found.values())] for key in found["helmholtz"]],
    )


def scale(runs: Path, name: str) -> Measured | None:
    """Time and bytes of 10⁸ spectra, from the time per spectrum of a benchmark, with the default rays, and the files of
    the demo's dataset.
    """
    timed, dataset = _benchmark_figures(runs, "simulation"), runs / "demo" / "dataset"
    per_spectrum = "milliseconds_per_further_spectrum_with_diffraction"
    if timed is None or per_spectrum not in timed[0] or not dataset.is_dir():
        return None
    figures, date, machine = timed
    milliseconds = figures[per_spectrum]
    pictures = [path.stat().st_size for path in (dataset / "spectrum").iterdir()]
    bytes_of_responses = (dataset / "channels.npz").stat().st_size / len(pictures)
    bytes_of_picture = sum(pictures) / len(pictures)
    count = 10**8
    days = milliseconds / 1e3 * count / 86400
    rows = {
        "one such machine": f"{days:.0f} days",
        "200 such machines": f"{24 * days / 200:.1f} hours, and the search for chains once",
        "pictures": f"{bytes_of_picture / 1e3:.1f} kB each, {bytes_of_picture * count / 1e12:.2f} TB in 10⁸ files",
        "the same as uint8 arrays": f"{90 * 360 * count / 1e12:.2f} TB",
        "channels alone (spectra follow from them)": (
            f"{bytes_of_responses:.0f} bytes each, {bytes_of_responses * count / 1e9:.0f} GB"
        ),
        "parts of 100 positions": f"{count // 100:,} tasks of {milliseconds / 10:.1f} s",
    }
    return Measured(date, machine, columns=["", ""], rows=[list(row) for row in rows.items()])


def no_figures(runs: Path, name: str) -> Measured:
    """Of a section that has pictures alone."""
    return Measured()


READERS: dict[str, Callable[[Path, str], Measured | None]] = {
    "demo": demo,
    "benchmark": benchmark,
    "experiment": experiment,
    "ladder": ladder,
    "table": table,
    "crossvalidation": crossvalidation,
    "scale": scale,
    "pictures": no_figures,
}
"""By the kind that sections.toml gives: (runs, the section's name) -> figures, None where there are none."""
