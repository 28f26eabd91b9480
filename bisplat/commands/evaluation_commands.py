"""The commands that measure the accuracy of predictions and of ray tracing: evaluate, crossvalidate, engines."""

from __future__ import annotations

import json as json_format
from pathlib import Path
from typing import Annotated

from tyro.conf import OmitArgPrefixes, Positional, arg

from bisplat.commands.output_file import Force, require_new
from bisplat.commands.simulate_command import EngineName, Output
from scenes.files.errors import ParameterError
from scenes.files.options import checked, unchecked
from scenes.files.text_tables import print_table
from simulate.rays.core.propagation import Propagation


def evaluate(
    run: Positional[Path],
    dataset: Path | None = None,
    index: Path | None = None,
    locate: bool = False,
    further_gateways: tuple[Path, ...] = (),
    json: bool = False,
) -> None:
    """Score a trained model and the baselines on held-out spectra.

    The table also has the array's ceiling, an upper bound. The report is written to RUN/evaluation.

    Args:
        run: the run folder.
        dataset: dataset folder to test on (default: the run's own, which is also recognised where it has moved to).
        index: file with the names of the test spectra, one per line (default: the test part of the split).
        locate: instead locate the test transmitters from their spectra, and measure the errors.
        further_gateways: with --locate: runs of other gateways that received the same transmitters.
        json: print the scores as JSON.
    """
    if locate or further_gateways:
        _evaluate_locations(run, dataset or index, locate, further_gateways, json)
        return
    from learn.baselines.array_ceiling import shown_name
    from learn.evaluation.evaluate import evaluate as score_run
    from learn.reports.evaluation_report import write_evaluation

    evaluation = score_run(run, dataset, index)
    write_evaluation(evaluation, run / "evaluation")
    if json:
        print(json_format.dumps(evaluation.metrics(), indent=2))
    else:
        columns = {shown_name(name): scores.summary() for name, scores in evaluation.scores.items()}
        known = len(evaluation.known_positions)
        print_table(f"{len(evaluation.test)} test spectra, predicted from {known} known ones", columns)
        print(f"report: {run / 'evaluation' / 'report.html'}")


def _evaluate_locations(
    run: Path, other: Path | None, locate: bool, further_gateways: tuple[Path, ...], json: bool
) -> None:
    from learn.evaluation.locations import evaluate_locations
    from learn.reports.locations_report import write_locations
    from learn.training.fit_progress import FitProgress

    if not locate:
        raise ParameterError("further_gateways", "expected --locate with runs of further gateways, found none")
    if other is not None:
        raise ParameterError("locate", f"expected the test part of the run's own split, found {other}")
    with FitProgress("location") as report:
        found = evaluate_locations([run, *further_gateways], report)
    write_locations(found, run / "evaluation")
    if json:
        print(json_format.dumps(found.metrics(), indent=2))
    else:
        print_table(f"{len(found.truth)} located transmitters", {"": found.metrics()})


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
    from learn.evaluation.crossvalidate import crossvalidate as compare_with_truth
    from learn.reports.crossvalidation_report import write_crossvalidation

    fresh = compare_with_truth(run, scene, positions, seed, engine=engine, field=field)
    write_crossvalidation(fresh, run)
    if json:
        print(json_format.dumps(fresh.metrics(), indent=2))
    else:
        print_table(f"against {fresh.truth_by}", {"model": fresh.metrics()})


def engines(
    dataset: Positional[Path],
    output: Output,
    positions: Annotated[int, arg(aliases=["-n"])] = 200,
    propagation: OmitArgPrefixes[unchecked(Propagation)] = unchecked(Propagation)(),  # type: ignore[valid-type]
    json: bool = False,
    force: Force = False,
) -> None:
    """Compare ray tracing with a full-wave dataset.

    Args:
        dataset: dataset folder made by bisplat simulate --engine fullwave.
        output: folder for engines.json and the maps.
        positions: largest number of positions to trace.
        propagation: what the ray tracer follows.
        json: print the figures as JSON.
    """
    from learn.evaluation.engines import compare_engines
    from learn.evaluation.engines_plane import compare_on_plane
    from learn.reports.engines_report import FILES, draw_plane, write_engines

    require_new(*(output / name for name in FILES), force=force)
    mechanisms = checked(Propagation, propagation)
    compared = compare_engines(dataset, mechanisms, positions)
    write_engines(compared, output)
    draw_plane(compare_on_plane(dataset, mechanisms), output)
    if json:
        print(json_format.dumps(compared.metrics(), indent=2))
    else:
        print_table("rays against full wave", {"rays": compared.metrics()})
