"""The report of ``bisplat evaluate --locate``: metrics as JSON, places as CSV, and a figure of the errors."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from learn.evaluation.locations import Locations
from learn.localisation.located_places import write_places
from learn.reports.method_styles import THIS_RUN, line_styles
from learn.reports.paper import COLUMN, at_paper_size, save
from learn.reports.plots import label_log_axis
from learn.reports.provenance import Provenance
from scenes.files.atomic import write_atomically


@at_paper_size()
def write_locations(locations: Locations, folder: Path, made: Provenance | None = None) -> None:
    """Write locations.json, locations.csv and location_errors.png (and .pdf)."""
    folder.mkdir(parents=True, exist_ok=True)
    facts = locations.metrics() | ({"further_runs": locations.further_runs} if locations.further_runs else {})
    write_atomically(folder / "locations.json", (json.dumps(facts, indent=2) + "\n").encode())
    write_places(folder / "locations.csv", locations.names, locations.places, ["test"] * len(locations.names))
    figure = Figure(figsize=(COLUMN, 2.7), layout="constrained")
    axis = figure.subplots()
    model = "model" if made is None else f"{made.model}{THIS_RUN}"
    named = {model if name == "model" else name: errors for name, errors in locations.errors.items()}
    styles = line_styles(named)
    for name, errors in named.items():
        share = np.arange(1, len(errors) + 1) / len(errors)
        label = f"{name}: median {100 * np.median(errors):.1f} cm"
        axis.step(np.sort(100 * errors), share, where="post", label=label, **{**styles[name], "marker": None})
    axis.set(xlabel="error of the position (cm)", ylabel="share of located positions", xscale="log", ylim=(0, 1))
    label_log_axis(axis.xaxis)
    axis.grid(alpha=0.3)
    figure.legend(loc="outside upper left", handlelength=3.2)
    save(figure, folder / "location_errors.png", made and replace(made, spectra=f"{made.spectra}, {_of(locations)}"))


def _of(locations: Locations) -> str:
    """How many test spectra were located, and with which further runs, in words."""
    with_others = f" with the runs of further gateways {', '.join(locations.further_runs)}"
    return f"{len(locations.names)} of them located{with_others if locations.further_runs else ''}"
