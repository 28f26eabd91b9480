"""The commands that compare methods: compare, ablate, sweep."""

from __future__ import annotations

import json as json_format
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tyro.conf import Positional, arg

from bisplat.commands.compared_quantities import Fitted, compare_quantity, some_are_trained, sweep_quantity
from bisplat.commands.idle_options import given_options, refuse_idle
from bisplat.commands.rooms_command import compare_in_rooms
from bisplat.commands.simulate_command import Output
from learn.data.splits import SplitKind
from learn.training.registry import MODELS
from scenes.files.errors import InputError, printable
from scenes.files.input_file import what_is_at
from scenes.files.plain_text import print_rows, say
from simulate.dataset.dataset_kinds import is_rooms, quantity_of

if TYPE_CHECKING:
    ModelName = str
else:
    ModelName = Literal[tuple(MODELS)]  # the choices of the command line

DatasetFolder = Annotated[Positional[Path], arg(help="NeRF² dataset folder.")]
Folder = Annotated[Positional[Path], arg(help="NeRF² dataset folder, or one of powers (RSSI) or channels (CSI).")]
Split = Annotated[
    SplitKind,
    arg(help="choice of test spectra, as for bisplat train. All methods have the same test spectra."),
]
Guard = Annotated[float, arg(help="known positions nearer than this to a test position are left out, wavelengths.")]
Budget = Annotated[float, arg(help="training time of each model that is trained in steps, minutes.")]
TrainingSteps = Annotated[
    int | None,
    arg(
        help="of spectra: number of training steps of each model that is trained in steps, instead of --budget. Unlike "
        "with a budget, the training is then equally long on every machine."
    ),
]
Seeds = Annotated[int, arg(help="number of fits of each method, with seeds 0, 1, …")]
Models = Annotated[
    tuple[str, ...],
    arg(
        aliases=["--methods"],
        help="names (documentation: Train and compare models), module:Class for your own, or LABEL=FOLDER of predicted "
        "test spectra. Default: all; in a sweep, some.",
    ),
]
DescribedScene = Annotated[
    str | None,
    arg(
        help="of received powers: the scene that the method twin corrects and traces, a built-in name or a scene YAML."
    ),
]
TestSpectra = Annotated[int | None, arg(help="largest number of test spectra to score (default: all).")]
Json = Annotated[bool, arg(help="print the table as JSON.")]

IDLE = {
    "spectra": ("given", "test_rooms", "scene"),
    "rooms": ("steps", "over_band", "scene", "split", "guard"),
    "received powers": ("steps", "given", "test_rooms", "test_spectra", "init"),
    "channels (CSI)": ("steps", "given", "test_rooms", "test_spectra", "init", "scene"),
    "responses over a band": ("steps", "given", "test_rooms", "test_spectra", "scene"),
}
"""Options of ``compare`` and ``sweep`` that do nothing, by the kind of data."""

ComparedFolder = Annotated[
    Positional[Path], arg(help="NeRF² dataset folder, one of powers (RSSI) or channels (CSI), or one of bisplat rooms.")
]


def compare(
    dataset: ComparedFolder,
    output: Annotated[Path | None, arg(aliases=["-o"])] = None,
    models: Models = (),
    split: Split = "files",
    guard: Guard = 0.0,
    budget: Budget = 5.0,
    steps: TrainingSteps = None,
    seeds: Seeds = 1,
    test_spectra: TestSpectra = None,
    over_band: bool = False,
    given: tuple[int, ...] = (),
    test_rooms: int | None = None,
    scene: DescribedScene = None,
    json: Json = False,
) -> None:
    """Compare models and baselines on one dataset or in new rooms.

    The same command again adds missing rows and redraws the figures.

    Args:
        output: folder for the table, its figure, the scores and the runs. RSSI, CSI and rooms do without one.
        over_band: score responses over the band of a dataset, instead of spectra.
        given: of rooms, numbers of known spectra in a test room (default: 5 10 25 50 100).
        test_rooms: of rooms, number of test rooms, the last ones (default: a quarter).
    """
    options = given_options(compare, locals())
    kind = "responses over a band" if over_band else kind_of(dataset)
    _refuse_idle(options, dataset, kind, models, output)
    if kind == "rooms":
        compare_in_rooms(dataset, models, given, test_rooms, test_spectra, seeds, budget, output, json)
        return
    if kind != "spectra":
        compare_quantity(Fitted(dataset, models, split, guard, budget, seeds, None, over_band, scene), output, json)
        return
    if output is None and not dataset.is_dir():
        raise InputError(f"{dataset}: expected a dataset folder, found {what_is_at(dataset)}")
    if output is None:
        raise InputError("-o: expected a folder for the results beside spectra, found none")
    from learn.comparison.compare import compare as compare_methods
    from learn.reports.comparison_report import write_comparison

    comparison = compare_methods(dataset, models or None, split, budget, seeds, test_spectra, output, guard, steps)
    write_comparison(comparison, output)
    print_averages("comparison", comparison.table(), json, comparison.remark())
    say(f"fingerprint of the dataset: {comparison.settings.dataset_sha256}")
    print(printable(f"table: {output / 'table.html'}"), file=sys.stderr)


def ablate(
    dataset: DatasetFolder,
    output: Output,
    models: tuple[ModelName, ...] = ("bisplat", "bisplat-aperture"),
    split: Split = "files",
    guard: Guard = 0.0,
    steps: int = 1000,
    seeds: Seeds = 3,
    test_spectra: TestSpectra = None,
    primitives: int | None = None,
    json: Json = False,
) -> None:
    """Compare a model with variants that lack one part each.

    If the command is interrupted, the same command continues.

    Args:
        output: folder for the figures, the scores and the runs.
        models: models whose parts are switched off.
        steps: number of training steps of each variant and seed.
        primitives: number of primitives of every variant (default: the models' own).
    """
    from learn.comparison.ablate import ablate as ablate_models
    from learn.reports.comparison_report import write_ablation

    comparison = ablate_models(dataset, models, split, steps, seeds, test_spectra, primitives, output, guard)
    write_ablation(comparison, output)
    print_averages("ablation", comparison.averages(), json, comparison.remark())


def sweep(
    dataset: Folder,
    output: Output,
    sizes: tuple[int, ...],
    models: Models = (),
    split: Split = "files",
    guard: Guard = 0.0,
    budget: Budget = 5.0,
    steps: TrainingSteps = None,
    seeds: Seeds = 1,
    test_spectra: TestSpectra = None,
    init: Path | None = None,
    scene: DescribedScene = None,
    json: Json = False,
) -> None:
    """Compare methods for several numbers of training samples.

    If the command is interrupted, the same command continues.

    Args:
        output: folder for the figure, the scores and the runs.
        sizes: numbers of training spectra, positions or rows.
        init: finished run, such as one on simulated spectra. Its model is also trained from its weights.
    """
    options, kind = given_options(sweep, locals()), kind_of(dataset)
    _refuse_idle(options, dataset, kind, models, output)
    if kind != "spectra":
        sweep_quantity(Fitted(dataset, models, split, guard, budget, seeds, sizes, scene=scene), output, json)
        return
    from learn.comparison.compare import SWEPT
    from learn.comparison.compare import sweep as sweep_sizes
    from learn.reports.comparison_report import write_sweep

    models = models or SWEPT
    comparison = sweep_sizes(dataset, sizes, models, split, budget, seeds, test_spectra, init, output, guard, steps)
    write_sweep(comparison, output)
    print_averages("sweep", comparison.averages(), json, comparison.remark())


def kind_of(folder: Path) -> str:
    """What a folder holds: rooms, received powers, channels or, if nothing tells otherwise, spectra."""
    kinds = {"power": "received powers", "channel": "channels (CSI)"}
    return "rooms" if is_rooms(folder) else kinds.get(quantity_of(folder) or "", "spectra")


def _refuse_idle(options: list[str], dataset: Path, kind: str, models: Sequence[str], output: Path | None) -> None:
    """Refuse options that do nothing for a kind of data, or for methods that are not trained."""
    refuse_idle(options, IDLE[kind], f"for the {kind} of {dataset}")
    if kind_of(dataset) != "spectra":
        refuse_idle(options, ["over_band"], f"for the {kind_of(dataset)} of {dataset}")
    if "steps" in options:
        refuse_idle(options, ["budget"], "beside --steps")
    usual_are_trained = not models and kind in ("spectra", "rooms")
    trained = usual_are_trained or "init" in options or some_are_trained(kind, models, output)
    if not trained:
        refuse_idle(options, ["budget", "steps"], f"for untrained methods ({', '.join(models) or 'the usual ones'})")


def print_averages(title: str, averages: Sequence[dict[str, Any]], json: bool, remark: str | None = None) -> None:
    """Print averages over the seeds."""
    from learn.comparison.averaged_table import average_name
    from learn.comparison.table import table_cells

    if json:
        figures = [{key: row[key] for key in row if key != "label" and row[key] is not None} for row in averages]
        named = {average_name(row): each for row, each in zip(averages, figures, strict=True)}
        print(json_format.dumps(named, indent=2))
    else:
        headings, *lines = table_cells(averages)
        print_rows(title, [dict(zip(headings, line, strict=True)) for line in lines])
    if remark is not None:
        print(printable(f"bisplat: {remark}"), file=sys.stderr if json else sys.stdout)
