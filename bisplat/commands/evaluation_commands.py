"""The commands that measure the accuracy of predictions: evaluate, crossvalidate."""

from __future__ import annotations

import json as json_format
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from bisplat.commands.common_options import Force, require_new
from bisplat.commands.comparison_commands import IN_WORDS, is_trained, kind_of, print_comparison
from bisplat.commands.idle_options import given_options, refuse_idle
from bisplat.commands.simulate_command import EngineName
from learn.data.splits import SplitKind
from scenes.files.errors import InputError, ParameterError, printable
from scenes.files.output_folder import new_folder
from scenes.files.plain_text import print_table, say

OF_RUNS = ("dataset", "index", "locate", "further_gateways", "ceiling")
OF_QUANTITIES = ("output", "model", "split", "guard", "budget", "scene", "force")
"""Options of ``evaluate`` that only act on a run, and on a dataset of powers or channels."""


def evaluate(
    run: Positional[Path],
    dataset: Path | None = None,
    index: Path | None = None,
    locate: bool = False,
    further_gateways: tuple[Path, ...] = (),
    ceiling: bool = True,
    output: Annotated[Path | None, arg(aliases=["-o"])] = None,
    model: str = "helmholtz",
    split: SplitKind = "files",
    guard: float = 0.0,
    budget: float = 5.0,
    scene: str | None = None,
    force: Force = False,
    json: bool = False,
) -> None:
    """Score a model and the baselines on held-out data.

    Of a run, the table also has the array's ceiling, an upper bound, and the report is written to RUN/evaluation. Of
    powers and channels, no run is needed: the model is fitted here.

    Args:
        run: the run folder. Or a dataset of powers (RSSI) or channels (CSI).
        dataset: dataset folder to test on (default: the run's own, which is also recognised where it has moved to).
        index: file with the names of the test spectra, one per line (default: the test part of the split).
        locate: also locate the test transmitters from their spectra, and measure the errors.
        further_gateways: with --locate: runs of other gateways that received the same transmitters.
        ceiling: score the array's ceiling, too, which takes half a minute for 16 × 16 elements without responses.
        output: of powers or channels: new folder for the report.
        model: of powers or channels: name of the method, as for bisplat compare, or module:Class for your own.
        split: of powers or channels: choice of the test part.
        guard: of powers or channels: known positions nearer than this to a test position are left out, wavelengths.
        budget: of powers or channels: training time of a method that is trained in steps, minutes.
        scene: of powers: the scene that the method twin corrects and traces, a built-in name or a scene YAML.
        force: of powers or channels: replace existing output files.
        json: print the scores as JSON.
    """
    options = given_options(evaluate, locals())
    if (kind := kind_of(run)) in ("power", "channel"):
        words = IN_WORDS[kind]
        refuse_idle(options, OF_RUNS, f"for {words} without a run")
        if kind == "channel":
            refuse_idle(options, ["scene"], f"for {words}")
        if not is_trained(kind, [model], None):
            refuse_idle(options, ["budget"], f"for a method that is not trained ({model})")
        if output is None:
            raise InputError(f"{run}: expected -o FOLDER for the report of {words}, found none")
        _evaluate_method(run, model, split, guard, budget, scene, output, force, json)
        return
    refuse_idle(options, OF_QUANTITIES, f"for the run {run}")
    if further_gateways and not locate:
        raise ParameterError("further_gateways", "expected --locate with runs of further gateways, found none")
    if locate and (dataset or index) is not None:
        raise ParameterError("locate", f"expected the test part of the run's own split, found {dataset or index}")
    from learn.data.split_distances import say_distances
    from learn.evaluation.evaluate import evaluate as score_run
    from learn.quantities.array_ceiling import shown_name
    from learn.reports.evaluation_report import (
        add_locations,
        metrics_file,
        named_scores,
        write_evaluation,
        write_locations,
    )
    from learn.reports.provenance import Provenance
    from learn.training.fit_progress import FitProgress

    require_new(run / "evaluation" / "report.html", force=True)
    if locate:
        from learn.evaluation.locations import evaluate_locations, heard_by

        require_new(run / "evaluation" / "locations.csv", force=True)
        heard = heard_by([run, *further_gateways])  # other runs are checked before the scores, which take long
    with FitProgress("evaluation") as progress:
        evaluation = score_run(run, dataset, index, ceiling, progress)
    write_evaluation(evaluation, run / "evaluation")
    say_distances(evaluation.distances)
    located = None
    if locate:
        with FitProgress("location") as report:
            located = evaluate_locations(heard, report)
        write_locations(located, run / "evaluation", Provenance.of_evaluation(evaluation))
        add_locations(evaluation, located, run / "evaluation")
    metrics = metrics_file(evaluation, located)
    if json:
        print(json_format.dumps(metrics, indent=2))
    else:
        columns = {shown_name(name): scores.summary() for name, scores in named_scores(evaluation).items()}
        known = len(evaluation.known_positions)
        print_table(f"{len(evaluation.test)} test spectra, predicted from {known} known ones", columns)
        if "within_90_percent_interval" in metrics:
            share, width = metrics["within_90_percent_interval"], metrics["interval_width_mean"]
            print(
                f"{share:.1%} of the true values are within the stated 90 % intervals; their mean width is {width:.3f}"
            )
            print_table("by the distance to the nearest known position", metrics["interval_bands"])
        if located is not None:
            print_table(f"{len(located.found)} located transmitters", {"": located.metrics()})
        print(f"report: {run / 'evaluation' / 'report.html'}")


def _evaluate_method(
    folder: Path,
    model: str,
    split: SplitKind,
    guard: float,
    budget: float,
    scene: str | None,
    output: Path,
    force: bool,
    json: bool,
) -> None:
    """Score one method beside the baselines, and write a report into a new folder."""
    from learn.comparison.compare import compare
    from learn.reports.method_report import write_method_report
    from learn.reports.method_styles import method_name

    try:
        with new_folder(output, force) as unfinished:
            comparison = compare(folder, [model], split=split, guard=guard, budget=budget, scene=scene)
            label = next(row["label"] for row in comparison if method_name(row["label"]) == model)
            write_method_report(comparison, label, unfinished)
    except ParameterError as error:
        if error.parameter == "methods":
            raise ParameterError("model", error.message) from error
        raise
    print_comparison(f"evaluation for {comparison.quantity.in_words}", comparison, json)
    say(printable(f"report: {output / 'report.html'}"))


def crossvalidate(
    run: Positional[Path],
    scene: str,
    positions: Annotated[int, arg(aliases=["-n"])] = 100,
    seed: int = 1,
    engine: EngineName | None = None,
    field: Path | None = None,
    json: bool = False,
) -> None:
    """Compare predictions with a fresh simulation at new positions.

    The report is written to the run folder.

    Args:
        run: the run folder.
        scene: scene of the run's dataset: a built-in name or a scene YAML.
        positions: number of new positions, drawn in the bounding box of the training positions.
        seed: seed of the new positions.
        engine: what simulates the truth (default: the engine of the dataset). fullwave may solve a new field first.
        field: folder of a full-wave dataset of the same scene. Its stored field is then the truth.
        json: print the scores as JSON.
    """
    if field is not None and engine not in (None, "fullwave"):
        refuse_idle(["engine"], ["engine"], f"beside --field {field}, which full wave solved")
    from learn.evaluation.crossvalidate import crossvalidate as compare_with_truth
    from learn.reports.evaluation_report import write_crossvalidation

    require_new(run / "crossvalidation.html", force=True)
    fresh = compare_with_truth(run, scene, positions, seed, engine=engine, field=field)
    write_crossvalidation(fresh, run)
    if json:
        print(json_format.dumps(fresh.metrics(), indent=2))
    else:
        print_table(f"against {fresh.truth_by}", {fresh.origin.model: fresh.metrics()})
