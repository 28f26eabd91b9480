"""Errors of located test transmitters of runs, and those of copying the positions of similar known spectra."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from learn.localisation.heard_pictures import of_runs
from learn.localisation.located_places import Located
from learn.localisation.place_search import Question
from learn.models.base import Report
from learn.training.run_folder import Run, load_spectra

LOCATED = 200  # Largest number of test transmitters that are located, evenly spread over the test part


class Locations(NamedTuple):
    """Located test transmitters."""

    found: Located
    further_runs: list[str]  # names of the runs of further gateways

    def metrics(self) -> dict[str, float | int]:
        """Medians and 90th percentiles of the errors (cm), and how often stated 90 % regions hold the true position."""
        errors = self.found.errors
        metrics: dict[str, float | int] = {"located": len(errors["locate"])}
        for name, each in errors.items():
            key = {"locate": "", "fingerprint": "_fingerprint"}.get(name, f"_fingerprint_{name.split()[-1]}")
            metrics[f"location_error_median_cm{key}"] = 100 * float(np.median(each))
            metrics[f"location_error_p90_cm{key}"] = 100 * float(np.percentile(each, 90))
        if (within := self.found.share_in_region) is not None:
            metrics["within_90_percent_region"] = within
        return metrics | {"of_several_places": float(np.mean([len(each) > 1 for each in self.found if each]))}


class Heard(NamedTuple):
    """Test transmitters that one or several gateways received."""

    question: Question
    further_runs: list[str]


def heard_by(runs: Sequence[Run | Path]) -> Heard:
    """The test transmitters of a run's dataset, at most ``LOCATED``."""
    loaded = [load_spectra(run) for run in runs]
    return Heard(of_runs(loaded, None, LOCATED), [run.name for run in loaded[1:]])


def evaluate_locations(heard: Heard, report: Report = lambda phase, done, total: None) -> Locations:
    """Locate test transmitters from their pictures."""
    return Locations(heard.question.answered(report), heard.further_runs)
