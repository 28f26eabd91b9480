"""The commands that compare methods: compare, ablate, sweep."""

from __future__ import annotations

import json as json_format
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tyro.conf import Positional, arg

from bisplat.commands.compared_quantities import Fitted, compare_quantity, sweep_quantity
from bisplat.commands.given_options import refuse_given
from bisplat.commands.rooms_command import compare_in_rooms
from bisplat.commands.simulate_command import Output
from learn.comparison.results_folder import PROTOCOL
from learn.data.splits import SplitKind
from learn.training.registry import MODELS
from scenes.files.errors import InputError, printable
from scenes.files.input_file import what_is_at
from scenes.files.plain_text import print_rows, say
from simulate.dataset.dataset_kinds import is_csi, is_rooms, is_rssi

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
    if is_rooms(dataset):
        refuse_given(["--steps"], f"spectra of one place, found the rooms of {dataset}")
        refuse_given(["--over-band"], f"a dataset of spectra with a band, found the rooms of {dataset}")
        refuse_given(["--scene"], f"received powers (RSSI), found the rooms of {dataset}")
        compare_in_rooms(dataset, models, given, test_rooms, test_spectra, seeds, budget, output, json)
        return
    refuse_given(["--given", "--test-rooms"], f"a folder of bisplat rooms, found {dataset}")
    if over_band:
        refuse_given(["--steps"], "spectra, found responses over a band")
        if is_rssi(dataset) or is_csi(dataset):
            refuse_given(["--over-band"], "a dataset of spectra with a band, found powers or channels")
        compare_quantity(Fitted(dataset, models, split, guard, budget, seeds, over_band=True), output, json)
        return
    if is_rssi(dataset) or is_csi(dataset):
        refuse_given(["--steps"], "spectra, found powers or channels")
        compare_quantity(Fitted(dataset, models, split, guard, budget, seeds, scene=scene), output, json)
        return
    refuse_given(["--scene"], "received powers (RSSI), found spectra, whose twin bisplat train fits")
    if output is None and not dataset.is_dir():
        raise InputError(f"{dataset}: expected a dataset folder, found {what_is_at(dataset)}")
    if output is None:
        raise InputError("-o: expected a folder for the results beside spectra, found none")
    if steps is not None:
        refuse_given(["--budget"], "none beside --steps")
    if models:
        _refuse_idle_training(models, output)
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
    if is_rssi(dataset) or is_csi(dataset):
        refuse_given(["--steps"], "spectra, found powers or channels")
        sweep_quantity(Fitted(dataset, models, split, guard, budget, seeds, sizes, scene=scene), output, json)
        return
    refuse_given(["--scene"], "received powers (RSSI), found spectra, whose twin bisplat train fits")
    from learn.comparison.compare import SWEPT
    from learn.comparison.compare import sweep as sweep_sizes
    from learn.reports.comparison_report import write_sweep

    models = models or SWEPT
    if steps is not None:
        refuse_given(["--budget"], "none beside --steps")
    if init is None:
        _refuse_idle_training(models, output)
    comparison = sweep_sizes(dataset, sizes, models, split, budget, seeds, test_spectra, init, output, guard, steps)
    write_sweep(comparison, output)
    print_averages("sweep", comparison.averages(), json, comparison.remark())


def _refuse_idle_training(models: Sequence[str], output: Path) -> None:
    """Refuse a training time or a number of steps if no model is trained by steps. Classes of the user may be.

    Who adds such a model to an experiment has to state the experiment's own ones, however.
    """
    if (output / PROTOCOL).is_file():
        return
    own = [name for name in models if ":" in name and "=" not in name]
    by_steps = own or [name for name in models if name in MODELS and MODELS[name].by_steps is not None]
    if not by_steps:
        refuse_given(["--budget", "--steps"], f"a model trained by steps, found {', '.join(models) or 'none'}")


def print_averages(title: str, averages: Sequence[dict[str, Any]], json: bool, remark: str | None = None) -> None:
    """Print averages over the seeds as a table, or as a JSON object with the rows by their names."""
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
