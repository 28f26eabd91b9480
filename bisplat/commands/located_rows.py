"""What ``bisplat locate`` does with a folder of received powers (RSSI) or of channels over subcarriers (CSI)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from bisplat.commands.given_options import refuse_given
from learn.data.splits import SplitKind
from scenes.files.errors import InputError, printable
from scenes.files.plain_text import print_rows, say
from simulate.dataset.dataset_kinds import is_rssi

if TYPE_CHECKING:
    from learn.localisation.located_places import Place
    from simulate.csi.csi_dataset import CsiDataset
    from simulate.rssi.rssi_dataset import RssiDataset

OF_ROWS = ("--heard", "--split", "--level")
"""Options that mean nothing for spectra."""


def locate_rows(folder: Path, output: Path, heard: Path | None, split: SplitKind, level: float | None) -> None:
    """Locate transmitters, write their places and print the errors where the true positions are known.

    Args:
        folder: powers or channels with positions.
        output: the CSV file to write.
        heard: what was heard of transmitters at unknown places. None: the test part of the folder is located.
        split: choice of the test part.
        level: as for ``locate_powers``.
    """
    refuse_given(["--pictures"], f"a run, found {folder}, whose transmitters are located from --heard")
    if heard is None:
        refuse_given(["--level"], "--heard beside it, found none: the test part is of the same device")
    else:
        refuse_given(["--split"], "none beside --heard, since all positions of the folder are then known")
    if not is_rssi(folder):
        refuse_given(["--level"], "received powers, found channels, whose level does not count")
    from learn.data.splits import split as split_rows
    from learn.localisation.baseline_positions import by_channels, by_powers, error_rows
    from learn.localisation.locate_channels import locate_channels
    from learn.localisation.locate_powers import located_by_powers
    from learn.localisation.located_places import NEW, write_places
    from learn.localisation.observations import ObservedRows, observed_channels, observed_powers
    from simulate.csi.csi_dataset import read_csi
    from simulate.rssi.rssi_dataset import RssiDataset, read_rssi

    dataset: RssiDataset | CsiDataset = read_rssi(folder) if is_rssi(folder) else read_csi(folder)
    if dataset.positions is None:
        raise InputError(f"{folder}: expected positions (tx_pos.csv) of known rows, found none")
    known, part = None, NEW
    if heard is None:
        parts = split_rows(dataset, split, 0)
        known, part, numbers = parts.known, "test", parts.test.tolist()
        rows = dataset.rssi_dbm if isinstance(dataset, RssiDataset) else dataset.uplink
        seen = ObservedRows(rows[parts.test], dataset.positions[parts.test])
    else:
        read = (
            observed_powers(heard, dataset) if isinstance(dataset, RssiDataset) else observed_channels(heard, dataset)
        )
        seen, numbers = read, list(range(len(read.rows)))
    places: list[list[Place]]
    if isinstance(dataset, RssiDataset):
        level = 0.0 if heard is None else level
        places, level = located_by_powers(dataset, seen.rows, known, level)
        simpler = None if seen.truth is None else by_powers(dataset, known, seen.rows - level, 0)
    else:
        places = locate_channels(dataset, seen.rows, known=known)
        simpler = None if seen.truth is None else by_channels(dataset, known, seen.rows, 0)
    write_places(output, [str(number) for number in numbers], places, [part] * len(places))
    if seen.truth is not None and simpler is not None:
        judged = error_rows(places, seen.truth, simpler, dataset.positions[slice(None) if known is None else known])
        if judged:
            print_rows("errors of the positions", judged)
    several, empty = sum(len(each) > 1 for each in places), sum(not each for each in places)
    unheard = f", and {empty} that nobody heard, which the file leaves out" if empty else ""
    what = f"{len(places)} transmitters, {several} of them with several possible places{unheard}"
    print(printable(f"{what}: {output}"))
    if heard is None:
        say(f"{folder}: located the test part of the split {split}; --heard takes what was heard at unknown places")
