"""Where figures and tables come from: what was trained and tested, when, by which version and which command."""

from __future__ import annotations

import datetime
import shlex
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # loads torch
    from learn.comparison.comparison import Comparison
    from learn.evaluation.crossvalidate import CrossValidation
    from learn.evaluation.evaluate import Evaluation
    from simulate.spectra.array import Array

PACKAGE = "bisplat-wrf"


def command(given: Sequence[str]) -> str:
    """The command of this process as one can type it again, with ~ for the home folder."""
    program = Path(given[0]) if given else Path()
    if not (program.name == "bisplat" or program.parts[-2:] == ("bisplat", "__main__.py")):
        return "Python"
    home = f"{Path.home()}/"
    short = [
        f"~/{shlex.quote(text.removeprefix(home))}" if text.startswith(home) else shlex.quote(text)
        for text in given[1:]
    ]
    return " ".join(["bisplat", *short])


@dataclass(frozen=True)
class Provenance:
    """Where the scores of a report come from."""

    title: str  # what the report is about
    model: str  # names of the models, or of what else predicts
    dataset: str  # name of the dataset's folder
    split: str = ""  # the split, or what else was tested on, in words; empty if nothing was trained, like the next four
    spectra: str = ""  # numbers of known and tested spectra, in words
    distances: str = ""  # distances from tested to known positions, in words
    seed: str = ""  # seeds of the trainings, in words
    command: str = field(default_factory=lambda: command(sys.argv))  # the command, or "Python"
    date: str = field(default_factory=lambda: datetime.date.today().isoformat())  # day of the report, ISO 8601
    version: str = field(default_factory=lambda: version(PACKAGE))  # version of bisplat-wrf
    fingerprint: str = ""  # that of the dataset
    array: str = ""  # what the array cannot tell, a clause; empty if it tells all directions of its grid apart

    @classmethod
    def of_evaluation(cls, evaluation: Evaluation) -> Provenance:
        """The provenance of an evaluation of a run."""
        origin, tested = evaluation.origin, f"{len(evaluation)} test spectra"
        made = cls._of_run(f"{evaluation.run_name} on held-out spectra", evaluation, tested, evaluation.dataset.array)
        if evaluation.tested_on is not None:
            return replace(made, split=f"{origin.split}, tested on {evaluation.tested_on}")
        return replace(made, dataset=evaluation.dataset.folder.resolve().name)

    @classmethod
    def of_crossvalidation(cls, fresh: CrossValidation) -> Provenance:
        """The provenance of a comparison with a fresh simulation."""
        tested = f"{len(fresh)} fresh positions ({fresh.truth_by} of {fresh.scene_name})"
        return cls._of_run(f"{fresh.run_name} against {fresh.truth_by}", fresh, tested, fresh.array)

    @classmethod
    def _of_run(cls, title: str, found: Evaluation | CrossValidation, tested: str, array: Array) -> Provenance:
        origin = found.origin
        return cls(
            title=title,
            model=origin.model,
            dataset=origin.dataset,
            split=origin.split,
            spectra=f"{origin.train} training, {origin.validation} validation, {tested}",
            distances=found.distances.sentence(),
            array=array.cannot_tell or "",
            seed=str(origin.seed),
            fingerprint=origin.fingerprint,
        )

    @classmethod
    def of_comparison(cls, comparison: Comparison, title: str = "") -> Provenance:
        """The provenance of a comparison of methods, which may have another title."""
        from learn.training.config import split_words

        settings, rows = comparison.settings, [row for row in comparison.rows if row.get("known")]
        name, things = Path(settings.dataset).name, comparison.quantity.things
        seeds = max((row["seed"] for row in comparison.rows), default=0) + 1
        known = sorted({(row["train"], row["known"] - row["train"]) for row in rows})
        numbers = [f"{train} training, {validation} validation" for train, validation in known]
        tested = f"{max(row['test'] for row in comparison.rows)} test {things}"
        if settings.test_rooms is not None:
            tested += f" in {settings.test_rooms} test room{'s' * (settings.test_rooms > 1)}"
        values = getattr(
            comparison.dataset, "values", ()
        )  # several rooms, or a comparison read from its folder, have none
        return cls(
            title=title or f"Comparison of methods on {name}",
            model=", ".join(dict.fromkeys(row["label"] for row in rows)),
            dataset=name,
            split=split_words(settings.split, settings.guard or None, settings.seed),
            spectra=", ".join(["; ".join(numbers), tested] if numbers else [tested]),
            distances=_distances(comparison, rows),
            array=(comparison.dataset.array.cannot_tell or "") if "spectrum" in values else "",
            seed="0" if seeds == 1 else f"0 to {seeds - 1}",
            fingerprint=settings.data_sha256,
        )

    def sentence(self) -> str:
        """All of it in words, for the foot of pages and figures."""
        made = f"{PACKAGE} {self.version}, {self.date}, {self.command}."
        if not self.split:
            return f"{self.title}. {made}"
        fingerprint = f" ({self.fingerprint[:12]})" if self.fingerprint else ""
        data = f"Dataset {self.dataset}{fingerprint}, split {self.split}: {self.spectra}"
        distances = f"{self.distances[:1].upper()}{self.distances[1:]}."
        models = f"Model {self.model}, seed {self.seed}." if "," not in self.model else f"Seed {self.seed}."
        array = f"Of the array: {self.array}."
        further = [*([distances] if self.distances else []), *([array] if self.array else [])]
        return " ".join([models, f"{data}.", *further, made])

    def facts(self) -> dict[str, str]:
        """All of it as texts, for JSON."""
        return {key: value for key, value in asdict(self).items() if value or key not in ("array", "fingerprint")}

    def pdf_metadata(self) -> dict[str, str]:
        """The document properties of a PDF."""
        keywords = ", ".join(filter(None, [*self.model.split(", "), self.dataset, self.split]))
        made = f"{PACKAGE} {self.version}"
        return {"Title": self.title, "Subject": self.sentence(), "Keywords": keywords, "Creator": made}

    def png_metadata(self) -> dict[str, str]:
        """The text chunks of a PNG."""
        return {"Title": self.title, "Description": self.sentence(), "Software": f"{PACKAGE} {self.version}"}


def _distances(comparison: Comparison, rows: Sequence[Mapping[str, Any]]) -> str:
    """From tested to known positions: of each number of known spectra its own, since fewer are farther apart."""
    if comparison.distances is None:
        return ""
    medians = {row["known"]: row.get("test_to_known_median_m") for row in rows}
    stated = [median for _, median in sorted(medians.items()) if median is not None]
    if len(stated) < 2:
        return comparison.distances.sentence()
    return (
        f"from a test position to the nearest known one: median {stated[0]:.3g} m with {min(medians)} known spectra, "
        f"{stated[-1]:.3g} m with {max(medians)}"
    )
