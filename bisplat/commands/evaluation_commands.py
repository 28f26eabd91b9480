"""The commands that measure the accuracy of predictions: evaluate, crossvalidate."""

from __future__ import annotations

import json as json_format
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from bisplat.commands.common_options import require_new
from bisplat.commands.comparison_commands import print_comparison
from bisplat.commands.idle_options import given_options, refuse_idle
from bisplat.commands.simulate_command import EngineName
from scenes.files.errors import ParameterError, printable
from scenes.files.plain_text import print_table, say

OF_SPECTRA = ("dataset", "index", "locate", "further_gateways", "ceiling")  # Options for runs of spectra


def evaluate(
    run: Positional[Path],
    dataset: Path | None = None,
    index: Path | None = None,
    locate: bool = False,
    further_gateways: tuple[Path, ...] = (),
    ceiling: bool = True,
    json: bool = False,
) -> None:
    """Score a model and the baselines on held-out data.

    The report is written to RUN/evaluation. Of spectra, the table also has the array's ceiling, an upper bound; the
    options below but --json are for them.

    Args:
        run: the run folder.
        dataset: dataset folder to test on (default: the run's own, which is also recognised where it has moved to).
        index: file with the names of the test spectra, one per line (default: the test part of the split).
        locate: also locate the test transmitters from their spectra, and measure the errors.
        further_gateways: with --locate: runs of other gateways that received the same transmitters.
        ceiling: score the array's ceiling, too, which takes half a minute for 16 × 16 elements without responses.
        json: print the scores as JSON.
    """
    from learn.training.config import learned_quantity

    if (quantity := learned_quantity(run)) not in (None, "spectrum"):
        refuse_idle(given_options(evaluate, locals()), OF_SPECTRA, f"for the quantity {quantity}")
        _evaluate_method(run, json)
        return
    if further_gateways and not locate:
        raise ParameterError("further_gateways", "expected --locate with runs of further gateways, found none")
    if locate and (dataset or index) is not None:
        raise ParameterError("locate", f"expected the test part of the run's own split, found {dataset or index}")
    from learn.data.split_distances import say_distances
    from learn.evaluation.evaluate import evaluate_spectra
    from learn.quantities.array_ceiling import shown_name
    from learn.reports.evaluation_report import (
        named_scores,
        write_evaluation,
        write_locations,
        write_scores,
    )
    from learn.reports.provenance import Provenance
    from learn.training.fit_progress import FitProgress

    require_new(run / "evaluation" / "report.html", force=True)
    if locate:
        from learn.localisation.heard_pictures import LOCATED, of_test_part
        from learn.training.run_folder import load_spectra

        require_new(run / "evaluation" / "locations.csv", force=True)
        runs = [load_spectra(each) for each in (run, *further_gateways)]
        heard = of_test_part(runs, LOCATED)  # other runs are checked before the scores, which take long
    with FitProgress("evaluation") as progress:
        evaluation = evaluate_spectra(run, dataset, index, ceiling, progress)
    metrics = write_evaluation(evaluation, run / "evaluation")
    say_distances(evaluation.distances)
    located = None
    if locate:
        with FitProgress("location") as report:
            located = heard.answered(report)
        others = [each.name for each in runs[1:]]
        write_locations(located, run / "evaluation", Provenance.of_evaluation(evaluation), others)
        metrics = write_scores(evaluation, run / "evaluation", located, others)
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
            print_table(f"{len(located)} located transmitters", {"": located.metrics()})
        print(f"report: {run / 'evaluation' / 'report.html'}")


def _evaluate_method(run: Path, json: bool) -> None:
    """Score a run of another quantity beside the baselines."""
    from learn.fitted.method_run import evaluate_method, load_method
    from learn.reports.method_report import write_method_report

    require_new(run / "evaluation" / "report.html", force=True)
    loaded = load_method(run)
    comparison = evaluate_method(loaded)
    write_method_report(comparison, loaded.config.model, run / "evaluation")
    print_comparison(f"evaluation for {comparison.quantity.in_words}", comparison, json)
    say(printable(f"report: {run / 'evaluation' / 'report.html'}"))


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
