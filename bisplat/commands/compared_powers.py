"""What ``bisplat compare`` does with a folder of received powers (RSSI)."""

from __future__ import annotations

import json as json_format
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from bisplat.commands.given_options import refuse_given
from learn.data.splits import SplitKind
from scenes.files.errors import printable
from scenes.files.output_folder import new_folder
from scenes.files.plain_text import say
from scenes.files.text_tables import print_rows

if TYPE_CHECKING:
    from learn.powers.power_comparison import PowerComparison

OF_SPECTRA = ("--budget", "--seeds", "--test-spectra")
"""Options that mean nothing here: no method trains by steps or depends much on chance, and scores take no time."""


def compare_received_powers(
    folder: Path,
    output: Path | None,
    methods: Sequence[str],
    split: SplitKind,
    guard: float,
    force: bool,
    json: bool,
) -> None:
    """Compare methods on received powers, and print the table.

    Args:
        folder: the dataset.
        output: folder for results.json, table.tex, table.csv and the figure. None: nothing is written.
        methods: their names; none: all.
        split: choice of test positions.
        guard: as for ``compare_powers``.
        force: existing files may be replaced.
        json: print all scores as JSON.
    """
    refuse_given(OF_SPECTRA, "spectra, found received powers, which are compared without it")
    from learn.powers.compare_powers import compare_powers

    if output is None:
        refuse_given(["--force", "--no-force"], "--output beside it, found none")
        _print(compare_powers(folder, methods or None, split=split, guard=guard), json)
        return
    from learn.reports.power_report import write_power_comparison

    with new_folder(output, force) as unfinished:
        comparison = compare_powers(folder, methods or None, split=split, guard=guard)
        write_power_comparison(comparison, unfinished)
    _print(comparison, json)
    say(printable(f"results: {output / 'results.json'}"))


def _print(comparison: PowerComparison, json: bool) -> None:
    from learn.powers.power_comparison import power_cells

    if json:
        print(json_format.dumps(comparison.facts(), indent=2))
        return
    headings, *lines = power_cells(comparison.table())
    print_rows("comparison of received powers", [dict(zip(headings, line, strict=True)) for line in lines])
    silent = comparison.rows[0]["not_received"]
    if silent:
        print(f"{silent} powers of the test part were not received; they count in the share alone, not in the errors")
