"""What ``bisplat compare`` does with a folder of received powers (RSSI) or of channels over subcarriers (CSI)."""

from __future__ import annotations

import json as json_format
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from bisplat.commands.given_options import refuse_given
from learn.data.splits import SplitKind
from scenes.files.errors import printable
from scenes.files.output_folder import new_folder
from scenes.files.plain_text import say
from scenes.files.text_tables import print_rows

if TYPE_CHECKING:
    from learn.channels.channel_comparison import ChannelComparison
    from learn.comparison.score_table import ScoreTable
    from learn.powers.power_comparison import PowerComparison

Compared = TypeVar("Compared", bound="ScoreTable")

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
    from learn.reports.power_report import write_power_comparison

    def compare() -> PowerComparison:
        return compare_powers(folder, methods or None, split=split, guard=guard)

    comparison = _compared(compare, write_power_comparison, output, force)
    _print("comparison of received powers", comparison, json)
    silent = comparison.rows[0]["not_received"]
    if silent and not json:
        print(f"{silent} powers of the test part were not received; they count in the share alone, not in the errors")
    _say_where(output)


def compare_channels_of_links(
    folder: Path, output: Path | None, methods: Sequence[str], split: SplitKind, force: bool, json: bool
) -> None:
    """Compare methods that predict the downlink from the uplink, and print the table.

    Args:
        folder: the dataset.
        output: folder for results.json, table.tex, table.csv and the figure. None: nothing is written.
        methods: their names; none: all.
        split: choice of test rows.
        force: existing files may be replaced.
        json: print all scores as JSON.
    """
    refuse_given([*OF_SPECTRA, "--guard"], "spectra, found channels (CSI), which are compared without it")
    from learn.channels.compare_channels import compare_channels
    from learn.reports.channel_report import write_channel_comparison

    def compare() -> ChannelComparison:
        return compare_channels(folder, methods or None, split=split)

    comparison = _compared(compare, write_channel_comparison, output, force)
    _print("downlink predicted from the uplink", comparison, json)
    _say_where(output)


def _compared(
    compare: Callable[[], Compared], write: Callable[[Compared, Path], None], output: Path | None, force: bool
) -> Compared:
    """Compare, and write the result into a new folder if one is given."""
    if output is None:
        refuse_given(["--force", "--no-force"], "--output beside it, found none")
        return compare()
    with new_folder(output, force) as unfinished:
        comparison = compare()
        write(comparison, unfinished)
    return comparison


def _print(title: str, comparison: ScoreTable, json: bool) -> None:
    if json:
        print(json_format.dumps(comparison.facts(), indent=2))
        return
    headings, *lines = comparison.cells()
    print_rows(title, [dict(zip(headings, line, strict=True)) for line in lines])


def _say_where(output: Path | None) -> None:
    if output is not None:
        say(printable(f"results: {output / 'results.json'}"))
