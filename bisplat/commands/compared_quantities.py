"""What ``bisplat compare``, ``sweep`` and ``evaluate`` do with a folder of received powers (RSSI) or channels (CSI)."""

from __future__ import annotations

import json as json_format
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from learn.comparison.results_folder import PROTOCOL
from learn.data.splits import SplitKind
from learn.training.registry import MODELS
from scenes.files.errors import ParameterError, printable
from scenes.files.output_folder import new_folder
from scenes.files.plain_text import print_rows, say
from simulate.dataset.dataset_kinds import quantity_of

if TYPE_CHECKING:
    from learn.comparison.averaged_table import AveragedTable
    from learn.comparison.score_table import ScoreTable


@dataclass(frozen=True)
class Fitted:
    """What is fitted to the powers or channels of a folder."""

    folder: Path
    methods: Sequence[str]  # names; none: all that are not trained by steps
    split: SplitKind
    guard: float
    budget: float
    seeds: int = 1
    sizes: Sequence[int] | None = None  # numbers of training positions or rows. None: all of the training part.
    over_band: bool = False  # whether the folder holds spectra, whose responses over the band are fitted
    scene: str | None = None  # the scene that the twin of received powers corrects

    @property
    def kind(self) -> str:
        """What the methods are fitted to."""
        if self.over_band:
            return "responses over a band"
        return "received powers" if quantity_of(self.folder) == "power" else "channels (CSI)"

    def __call__(self, output: Path | None = None) -> ScoreTable:
        """Fit and score the methods."""
        from learn.comparison.method_factories import checked_sizes

        compare: Callable[..., ScoreTable]
        of_powers: dict[str, Any] = {}
        if self.over_band:
            from learn.band.compare_band import compare_band as compare
        elif quantity_of(self.folder) == "power":
            from learn.powers.compare_powers import compare_powers as compare

            of_powers = {"scene": self.scene}
        else:
            from learn.channels.compare_channels import compare_channels as compare
        return compare(
            self.folder,
            self.methods or None,
            split=self.split,
            train_size=None if self.sizes is None else checked_sizes("samples", sizes=self.sizes),
            guard=self.guard,
            seeds=self.seeds,
            budget=self.budget,
            output=output,
            **of_powers,
        )


def some_are_trained(kind: str, methods: Sequence[str], output: Path | None) -> bool:
    """Whether a method of a comparison is trained for some time. Classes of the user may be.

    Who adds a method to a comparison that exists has to state its training time in any case.
    """
    from learn.band.band_methods import BAND_METHODS
    from learn.channels.channel_methods import CHANNEL_METHODS
    from learn.comparison.method_factories import trained_by_steps
    from learn.powers.fit_powers import POWER_METHODS
    from learn.rooms.room_methods import ROOM_METHODS

    def is_trained(name: str) -> bool:
        if kind == "spectra":
            return name in MODELS and MODELS[name].by_steps is not None
        if kind == "rooms":
            return hasattr(ROOM_METHODS.get(name), "learn")
        tables: dict[str, Mapping[str, Any]] = {
            "received powers": POWER_METHODS,
            "channels (CSI)": CHANNEL_METHODS,
            "responses over a band": BAND_METHODS,
        }
        return name in tables[kind] and trained_by_steps(tables[kind][name])

    stated = output is not None and (output / PROTOCOL).is_file()
    return stated or any((":" in name and "=" not in name) or is_trained(name) for name in methods)


def compare_quantity(fitted: Fitted, output: Path | None, json: bool) -> None:
    """Compare methods, and print the table."""
    comparison = fitted(output)
    if output is not None:
        from learn.reports.score_report import write_score_comparison

        write_score_comparison(comparison, output)
    _print("comparison", fitted, comparison, json)
    if output is not None:
        say(printable(f"results: {output / 'results.json'}"))


def sweep_quantity(fitted: Fitted, output: Path, json: bool) -> None:
    """Compare methods for several sizes of the training part; arguments as for ``compare_quantity``."""
    from learn.reports.score_report import write_score_sweep

    comparison = fitted(output)
    write_score_sweep(comparison, output)
    _print("sweep", fitted, comparison, json)
    say(printable(f"figure: {output / 'sweep.png'}"))


def evaluate_quantity(fitted: Fitted, output: Path, force: bool, json: bool) -> None:
    """Score one method beside the baselines, and write a report into a new folder."""
    from learn.channels.channel_methods import BASELINES as OF_CHANNELS
    from learn.powers.fit_powers import BASELINES as OF_POWERS
    from learn.reports.method_styles import method_name
    from learn.reports.score_evaluation import write_score_evaluation

    baselines = OF_POWERS if quantity_of(fitted.folder) == "power" else OF_CHANNELS
    (model,) = fitted.methods

    among = replace(fitted, methods=tuple(dict.fromkeys([*baselines, model])))
    try:
        with new_folder(output, force) as unfinished:
            comparison = among()
            label = next(row["label"] for row in comparison if method_name(row["label"]) == model)
            write_score_evaluation(comparison, label, unfinished)
    except ParameterError as error:
        if error.parameter == "methods":
            raise ParameterError("model", error.message) from error
        raise
    _print("evaluation", fitted, comparison, json)
    say(printable(f"report: {output / 'report.html'}"))


def _print(title: str, fitted: Fitted, comparison: ScoreTable, json: bool) -> None:
    what = (
        fitted.kind
        if fitted.over_band or quantity_of(fitted.folder) == "power"
        else "the downlink, predicted from the uplink"
    )
    print_scores(f"{title} of {what}", comparison, json)


def print_scores(title: str, comparison: AveragedTable, json: bool) -> None:
    """Print a table with its remark, or all scores as JSON."""
    if json:
        print(json_format.dumps(comparison.facts(), indent=2))
        return
    headings, *lines = comparison.cells()
    print_rows(title, [dict(zip(headings, line, strict=True)) for line in lines])
    remark = comparison.remark()
    if remark is not None:
        print(printable(f"bisplat: {remark}"))
