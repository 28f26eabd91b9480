"""``bisplat locate``."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from tyro.conf import Positional

from bisplat.commands.common_options import Force, require_new
from bisplat.commands.simulate_command import Output
from learn.data.splits import SplitKind
from scenes.files.errors import InputError, ParameterError, printable
from scenes.files.plain_text import print_rows

Region = tuple[float, float, float, float, float, float]
Direction = tuple[float, float, float]


def locate(
    folders: Positional[tuple[Path, ...]],
    output: Output,
    split: SplitKind | None = None,
    level: float | None = None,
    region: Region | None = None,
    boresight: Direction | None = None,
    force: Force = False,
) -> None:
    """Locate transmitters or tags from what was heard of them.

    The .csv file has a row for each place where a transmitter may be: probability, position (m) and covariance (m²).

    Args:
        folders: what is known, and what was heard. A run, and a folder of its gateway's pictures; with several gateways
            RUN HEARD RUN HEARD. Or received powers (RSSI) or channels (CSI) with positions, and a folder of these or a
            CSV such as gateway_rssi.csv. One folder alone: its own test part. Or one dataset whose antenna moved; its
            tags are then located from their responses.
        output: the .csv file to write.
        split: choice of the test part of powers or channels, as for bisplat compare (default: files).
        level: how much stronger the heard transmitter is than that of the known powers, dB (default: estimated).
        region: tags along a track only: the box in which they are, x y z of both corners, metres.
        boresight: tags along a track only: the direction in which the antenna looks, if it has a broad main lobe.
    """
    if output.suffix.lower() != ".csv":
        raise InputError(f"{output}: expected a name that ends in .csv")
    require_new(output, force=force)
    if not folders or (len(folders) > 1 and len(folders) % 2):
        raise ParameterError("folders", f"expected a folder, or pairs RUN HEARD, found {len(folders)} folders")
    from learn.localisation.locate import locate as locate_heard
    from learn.training.fit_progress import FitProgress

    known, heard = folders[::2], folders[1::2]
    several = len(known) > 1
    box = None if region is None else np.array(region).reshape(2, 3)
    with FitProgress("location") as report:
        found = locate_heard(
            known if several else known[0],
            heard if several else heard[0] if heard else None,
            split=split,
            level=level,
            region=box,
            boresight=boresight,
            report=report,
        )
    found.write(output)
    if rows := found.rows():
        print_rows("errors of the positions", rows)
    ambiguous, empty = sum(len(each) > 1 for each in found), sum(not each for each in found)
    silent = f", and {empty} of which nothing was heard, which the file leaves out" if empty else ""
    what = f"{len(found)} transmitters, {ambiguous} of them with several possible places{silent}"
    print(printable(f"{what}: {output}"))
