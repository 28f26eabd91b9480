"""What ``bisplat locate`` does with a dataset: the tags are located from their responses, without a run."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bisplat.commands.output_file import require_new
from scenes.files.errors import InputError, ParameterError, printable
from scenes.files.plain_text import say

Region = tuple[float, float, float, float, float, float]
Direction = tuple[float, float, float]

OF_TRACKS = ("--region", "--boresight")
"""Options that mean nothing where no antenna moved along a track."""


def is_dataset(folder: Path) -> bool:
    """Whether a folder is a dataset of spectra, and no run.

    Args:
        folder: the folder, which need not exist.
    """
    return (folder / "spectrum").is_dir() and not (folder / "config.json").exists()


def locate_tags_of(folder: Path, output: Path, force: bool, region: Region | None, boresight: Direction | None) -> None:
    """Locate the tags of a dataset from their responses along the track, and write the places.

    Args:
        folder: the dataset. The elements of its array are the stops of one antenna; or its array moved.
        output: the .csv file to write.
        force: an existing file may be replaced.
        region: box in which the tags are, metres: x, y, z of both corners. None: around the dataset's positions.
        boresight: as for ``locate_tags``.
    """
    from learn.localisation.locate_tags import locate_tags
    from learn.localisation.located_places import write_places
    from learn.localisation.observations import track_of
    from simulate.dataset.dataset_folder import read_dataset

    if output.suffix.lower() != ".csv":
        raise InputError(f"{output}: expected a name that ends in .csv")
    require_new(output, force=force)
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
