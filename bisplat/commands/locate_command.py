"""``bisplat locate``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from tyro.conf import Positional

from bisplat.commands.common_options import Force, require_new
from bisplat.commands.idle_options import given_options, refuse_idle
from bisplat.commands.simulate_command import Output
from learn.data.splits import SplitKind
from scenes.files.errors import InputError, ParameterError, printable
from scenes.files.plain_text import print_rows, say
from simulate.dataset.dataset_kinds import quantity_of

if TYPE_CHECKING:
    from learn.localisation.located_places import Place

Region = tuple[float, float, float, float, float, float]
Direction = tuple[float, float, float]


def locate(
    runs: Positional[tuple[Path, ...]],
    output: Output,
    pictures: tuple[Path, ...] = (),
    heard: Path | None = None,
    split: SplitKind = "files",
    level: float | None = None,
    region: Region | None = None,
    boresight: Direction | None = None,
    force: Force = False,
) -> None:
    """Locate transmitters or tags from what was heard of them.

    The .csv file has a row for each place where a transmitter may be: probability, position (m) and covariance (m²).

    Args:
        runs: the run folder. With several gateways: a run for each, in the same frame. Or one folder of received powers
            (RSSI) or channels (CSI) with positions. Or a dataset folder whose antenna moved; its tags are then located
            from their responses.
        output: the .csv file to write.
        pictures: for each run, a dataset folder or a folder of PNG spectra (00001.png, ...). Of the dataset that the
            first run was trained on, the test part is located; its folder spectrum stands for all pictures.
        heard: what was heard at unknown places: a CSV such as gateway_rssi.csv or a folder of received powers; or a
            folder of channels (default: the test part of the folder).
        split: choice of that test part, as for bisplat compare.
        level: how much stronger the heard transmitter is than that of the known powers, dB (default: estimated).
        region: tags along a track only: the box in which they are, x y z of both corners, metres.
        boresight: tags along a track only: the direction in which the antenna looks, if it has a broad main lobe.
    """
    options = given_options(locate, locals())
    rows = len(runs) == 1 and quantity_of(runs[0]) in ("power", "channel")
    tags = len(runs) == 1 and not pictures and _is_dataset(runs[0])
    if rows:
        refuse_idle(options, ["pictures"], f"for the powers or channels of {runs[0]}, which are located from --heard")
        if heard is None or quantity_of(runs[0]) == "channel":
            refuse_idle(options, ["level"], "without received powers as --heard")
        if heard is not None:
            refuse_idle(options, ["split"], "beside --heard, as all positions are then known")
    else:
        refuse_idle(options, ["heard", "split", "level"], "without received powers (RSSI) or channels (CSI)")
    if not tags:
        refuse_idle(options, ["region", "boresight"], "without a dataset whose antenna moved")
    if output.suffix.lower() != ".csv":
        raise InputError(f"{output}: expected a name that ends in .csv")
    require_new(output, force=force)
    if rows:
        locate_rows(runs[0], output, heard, split, level)
    elif tags:
        locate_tags_of(runs[0], output, region, boresight)
    else:
        locate_by_runs(runs, output, pictures)


def locate_by_runs(runs: tuple[Path, ...], output: Path, pictures: tuple[Path, ...]) -> None:
    """Locate the transmitters of pictures by a run for each gateway."""
    from learn.localisation.locate import grid_warning
    from learn.localisation.locate import locate as locate_pictures
    from learn.localisation.located_places import write_places
    from learn.localisation.observations import observed_pictures, parts_of, require_unseen
    from learn.training.config import read_config
    from learn.training.fit_progress import FitProgress
    from learn.training.run_folder import load_run

    for folder in runs:
        read_config(folder)  # a folder that is no run needs no pictures
    if len(runs) != len(pictures) or not runs:
        raise ParameterError("pictures", f"expected a folder for each of the {len(runs)} runs, found {len(pictures)}")
    loaded = [load_run(run) for run in runs]
    seen = [observed_pictures(folder, run) for folder, run in zip(pictures, loaded, strict=True)]
    names = seen[0][0]
    for folder, (other, _) in zip(pictures, seen, strict=True):
        if other != names:
            raise InputError(f"{folder}: expected pictures of the same names as in {pictures[0]}, found other ones")
    parts = parts_of(names, pictures[0], loaded[0])
    for folder, run in zip(pictures[1:], loaded[1:], strict=True):
        of_run = zip(names, parts, parts_of(names, folder, run), strict=True)
        learned = [name for name, first, other in of_run if first == "test" and other in ("train", "validation")]
        require_unseen(run, loaded[0], learned)
    chosen = list(range(len(names)))
    if "test" in parts and pictures[0].resolve().name != "spectrum":
        chosen = [number for number, part in enumerate(parts) if part == "test"]
        say(f"{pictures[0]}: located the {len(chosen)} pictures of the test part; {pictures[0]}/spectrum has all")
        names, parts = ([each[number] for number in chosen] for each in (names, parts))
    for run in loaded:
        unseen_side = run.beamformer.array.cannot_tell
        if unseen_side is not None:
            say(f"warning: {run.folder}: of the array, {unseen_side}; places on both sides may be given")
    warning = grid_warning(loaded)
    if warning is not None:
        say(f"warning: {warning}")
    with FitProgress("location") as report:
        places = locate_pictures(loaded, [each[chosen] for _, each in seen], report)
    write_places(output, names, places, parts)
    several, empty = sum(len(each) > 1 for each in places), sum(not each for each in places)
    told = "with pictures that tell nothing, such as those of one grey level, which the file leaves out"
    unseen = f", and {empty} {told}" if empty else ""
    print(printable(f"{len(names)} pictures, {several} of them with several possible places{unseen}: {output}"))


def locate_rows(folder: Path, output: Path, heard: Path | None, split: SplitKind, level: float | None) -> None:
    """Locate transmitters by powers or channels with positions, and print the errors where true positions are known."""
    from learn.data.splits import split as split_rows
    from learn.localisation.baseline_positions import by_channels, by_powers, error_rows
    from learn.localisation.locate_channels import locate_channels
    from learn.localisation.locate_powers import located_by_powers
    from learn.localisation.located_places import NEW, write_places
    from learn.localisation.observations import ObservedRows, observed_channels, observed_powers
    from simulate.dataset.dataset_folder import read_dataset

    dataset = read_dataset(folder)
    by_power = "power" in dataset.values
    known, part = None, NEW
    if heard is None:
        parts = split_rows(dataset, split, 0)
        known, part, numbers = parts.known, "test", parts.test.tolist()
        rows = dataset.powers if by_power else dataset.uplink
        seen = ObservedRows(rows[parts.test], dataset.positions[parts.test])
    else:
        read = observed_powers(heard, dataset) if by_power else observed_channels(heard, dataset)
        seen, numbers = read, list(range(len(read.rows)))
    places: list[list[Place]]
    if by_power:
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


def locate_tags_of(folder: Path, output: Path, region: Region | None, boresight: Direction | None) -> None:
    """Locate the tags of a dataset from their responses along the track of an antenna, without a run."""
    from learn.localisation.locate_tags import locate_tags
    from learn.localisation.located_places import write_places
    from learn.localisation.observations import track_of
    from simulate.dataset.dataset_folder import read_dataset

    dataset = read_dataset(folder)
    track = track_of(dataset)
    if region is not None:
        box = np.array(region).reshape(2, 3)
    elif track.region is not None:
        box = track.region
        corners = " to ".join(str(tuple(corner.round(2).tolist())) for corner in box)
        say(f"{folder}: tags are searched around its positions, in {corners} m (--region states another box)")
    else:
        raise ParameterError(
            "region", f"expected the box in which the transmitter is, since the receiver of {folder} moved"
        )
    pattern = "in all directions alike" if boresight is None else "ahead, with the cosine of the angle"
    say(f"{folder}: the antenna is taken to look {pattern}; each tag has an unknown phase and magnitude")
    places = locate_tags(track.responses, track.antennas, dataset.frequency.hertz, box, boresight=boresight)
    write_places(output, track.names, places)
    several, unread = sum(len(each) > 1 for each in places), sum(not each for each in places)
    left_out = f", and {unread} read at too few antenna positions, which the file leaves out" if unread else ""
    print(printable(f"{len(places)} tags, {several} of them with several possible places{left_out}: {output}"))
    if track.stated is not None and any(places):
        both = zip(places, track.stated, strict=True)
        off = [100 * np.linalg.norm(some[0].position - at) for some, at in both if some]
        print(f"from the dataset's positions: {np.median(off):.1f} cm (median), {np.quantile(off, 0.9):.1f} cm (90 %)")


def _is_dataset(folder: Path) -> bool:
    """Whether a folder is a dataset of spectra, and no run."""
    return (folder / "spectrum").is_dir() and not (folder / "config.json").exists()
