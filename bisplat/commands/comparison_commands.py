"""The command that compares methods."""

from __future__ import annotations

import json as json_format
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tyro.conf import Positional, arg

from bisplat.commands.idle_options import given_options, refuse_idle
from learn.comparison.results_folder import PROTOCOL
from learn.data.splits import SplitKind
from learn.quantities.quantity_table import QuantityName
from scenes.files.errors import printable
from scenes.files.plain_text import print_rows, say
from simulate.dataset.dataset_kinds import is_rooms, quantity_of

if TYPE_CHECKING:
    from learn.comparison.comparison import Comparison

IDLE = {
    "spectrum": ("test_rooms", "scene"),
    "room": ("steps", "scene", "split", "guard", "init", "without", "primitives"),
    "power": ("steps", "test_rooms", "init", "without", "primitives"),
    "channel": ("steps", "test_rooms", "init", "without", "primitives", "scene"),
    "response": ("steps", "test_rooms", "init", "without", "primitives", "scene"),
}
"""Options of ``compare`` that do nothing, by what is predicted."""

IN_WORDS = {
    "spectrum": "spectra",
    "room": "rooms",
    "power": "received powers",
    "channel": "channels (CSI)",
    "response": "responses over a band",
}


def compare(
    dataset: Annotated[Positional[Path], arg(help="Folder of spectra, powers (RSSI), channels (CSI), or of rooms.")],
    output: Annotated[Path | None, arg(aliases=["-o"])] = None,
    methods: Annotated[tuple[str, ...], arg(aliases=["--models"])] = (),
    quantity: QuantityName | None = None,
    split: SplitKind = "files",
    guard: float = 0.0,
    sizes: tuple[int, ...] = (),
    budget: float = 5.0,
    steps: int | None = None,
    seeds: int = 1,
    tested: int | None = None,
    test_rooms: int | None = None,
    scene: str | None = None,
    init: Path | None = None,
    without: Literal["each"] | None = None,
    primitives: int | None = None,
    json: bool = False,
) -> None:
    """Compare methods on one dataset or in new rooms.

    The same command again adds missing rows and redraws the figures.

    Args:
        output: folder for the table, the figures, the scores and the runs.
        methods: names (documentation: Train and compare models), module:Class for your own, or LABEL=FOLDER of
            predicted test rows. Default: of spectra all, otherwise those that take seconds.
        quantity: what is predicted (default: what the dataset mainly holds); response: responses over its band.
        split: choice of the test part, as for bisplat train. All methods have the same.
        guard: known positions nearer than this to a test position are left out, wavelengths.
        sizes: numbers of training rows, each with its own fits; in rooms, of known spectra (default: 5 10 25 50 100).
        budget: training time of each method that is trained in steps, minutes by the clock.
        steps: of spectra: number of training steps of each such method, instead of --budget; the same on every machine.
        seeds: number of fits of each method, with seeds 0, 1, …
        tested: largest number of test rows to score (default: all).
        test_rooms: of rooms: number of test rooms, the last ones (default: a quarter).
        scene: of powers: the scene that the method twin corrects and traces, a built-in name or a scene YAML.
        init: of spectra: finished run, such as one on simulated spectra. Its model is also trained from its weights.
        without: of spectra: an ablation. Also variants of the models, bisplat and bisplat-aperture if none are named,
            that lack one part each.
        primitives: with --without: number of primitives of every variant (default: the models' own).
        json: print the scores as JSON.
    """
    kind = quantity or kind_of(dataset)
    _refuse_idle(given_options(compare, locals()), dataset, kind, methods, output)
    from learn.comparison.compare import compare as compare_methods
    from learn.comparison.variants import variants
    from learn.reports.comparison_report import write_comparison

    chosen: Any = methods or None
    if without is not None:
        chosen = variants(methods or ("bisplat", "bisplat-aperture"), primitives)
    comparison = compare_methods(
        dataset,
        chosen,
        quantity=quantity,
        split=split,
        sizes=sizes or None,
        guard=guard,
        seeds=seeds,
        budget=budget,
        steps=steps,
        tested=tested,
        test_rooms=test_rooms,
        scene=scene,
        init=init,
        output=output,
    )
    if output is not None:
        write_comparison(comparison, output, without is not None)
    print_comparison(f"comparison of methods for {comparison.quantity.in_words}", comparison, json)
    say(f"fingerprint of the dataset: {comparison.settings.data_sha256}")
    if output is not None:
        say(printable(f"table: {output / 'table.html'}"))


def kind_of(folder: Path) -> str:
    """What a folder holds, by the name of the quantity, or rooms; spectra if nothing tells otherwise."""
    return "room" if is_rooms(folder) else quantity_of(folder) or "spectrum"


def is_trained(kind: str, methods: Sequence[str], output: Path | None) -> bool:
    """Whether a method of a comparison is trained for some time. Classes of the user may be.

    Who adds a method to a comparison that exists has to state its training time in any case.
    """
    from learn.methods.method_table import methods_of, trained_by_steps, usual_names

    if (output is not None and (output / PROTOCOL).is_file()) or any(
        ":" in name and "=" not in name for name in methods
    ):
        return True
    known = methods_of(kind)
    names = methods or usual_names(kind, known)
    return any(name in known and (trained_by_steps(known[name]) or hasattr(known[name], "learn")) for name in names)


def print_comparison(title: str, comparison: Comparison, json: bool) -> None:
    """Print a table with its remark, or all scores as JSON."""
    if json:
        print(json_format.dumps(comparison.facts(), indent=2))
        return
    headings, *lines = comparison.cells()
    print_rows(title, [dict(zip(headings, line, strict=True)) for line in lines])
    remark = comparison.remark()
    if remark is not None:
        print(printable(f"bisplat: {remark}"))


def _refuse_idle(options: list[str], dataset: Path, kind: str, methods: Sequence[str], output: Path | None) -> None:
    """Refuse options that do nothing for a kind of data, or for methods that are not trained."""
    refuse_idle(options, IDLE[kind], f"for the {IN_WORDS[kind]} of {dataset}")
    if "steps" in options:
        refuse_idle(options, ["budget"], "beside --steps")
    if "without" not in options:
        refuse_idle(options, ["primitives"], "without --without each")
    if not ({"init", "without"} & set(options) or is_trained(kind, methods, output)):
        refuse_idle(options, ["budget", "steps"], f"for untrained methods ({', '.join(methods) or 'the usual ones'})")
