"""Convert the folder of another program into a NeRF² dataset folder of this format.

It recognises pictures that are transposed, upside down, of another size or numbered from 0; pictures of power or in
decibels; grey levels stored in colour or 16 bits; and index files with numbers that lack leading zeros.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError, ParameterError, shown
from scenes.files.input_file import MEGABYTE, read_bytes, read_text
from scenes.files.output_folder import new_folder
from scenes.files.progress import progress_bar
from scenes.scene.antennas import Gateway
from simulate.dataset.bearings import bearing_of, turns_of
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import assumptions_of, inspect, read_dataset, require_written
from simulate.dataset.dataset_frequency import Frequency, named, several_frequencies
from simulate.dataset.dataset_kinds import require_spectra
from simulate.dataset.index_files import LARGEST_INDEX, write_index
from simulate.dataset.metadata import read_metadata, write_metadata
from simulate.dataset.picture_files import encode_picture, is_number, picture_files
from simulate.dataset.spectra_folder import read_gateway, read_receivers
from simulate.dataset.written_dataset import fill_dataset
from simulate.exchange.foreign_pictures import Survey, grid_of, kept_pictures, read_in_size, survey
from simulate.exchange.grey_levels import reading_of
from simulate.exchange.reading_options import Conversion, require_valid
from simulate.generation.dataset_parts import picture_names
from simulate.positions.positions import read_points, write_positions
from simulate.spectra.angular_grid import COLUMNS, ROWS, AngularGrid
from simulate.spectra.array import Array, PlanarArray
from simulate.spectra.identification import DOUBTFUL, stated_array, stated_grid
from simulate.spectra.lags import EXAMINED
from simulate.spectra.spectrum import LARGEST_GREY, evenly

READ = {"spectrum", "tx_pos.csv", "gateway_info.yml", "train_index.txt", "test_index.txt", "metadata.json", "freq.txt"}
"""What is read of a folder."""

LISTED = 5  # Most names that a sentence lists


def convert(source: Path, output: Path, conversion: Conversion = Conversion()) -> list[str]:
    require_valid(conversion)
    simulated = "scene_file" in read_metadata(source / "metadata.json")
    if conversion.frequency is not None and len(several := several_frequencies(source)) and simulated:
        for name, value in asdict(conversion).items():
            if name != "frequency" and value != getattr(Conversion(), name):
                wrong = f"expected none for a simulated folder, which states it, found {shown(value)}"
                raise ParameterError(name, wrong)
        return _one_frequency(source, output, conversion.frequency, several)
    with new_folder(output) as unfinished:
        said = _convert(source, unfinished, conversion)
        inspection = inspect(unfinished)
        if inspection.dataset is None:  # for reasons that lie in the source
            raise InputError(inspection.problems[0].replace(str(unfinished), str(source)))
        return said + _of_result(inspection.dataset, conversion)


def _one_frequency(source: Path, output: Path, frequency: float | str, several: Sequence[float]) -> list[str]:
    """Write the spectra of one frequency of a simulated folder, with their responses."""
    dataset = read_dataset(source, frequency)
    if "response" not in dataset.values:
        raise InputError(f"{source / 'channels.npz'}: expected the folder's responses, found no such file")
    position, orientation = dataset.gateway_position.tolist(), dataset.gateway_orientation.tolist()
    gateway = Gateway(position, orientation, **dataset.array.of_gateway())  # type: ignore[arg-type]
    hertz = dataset.frequency.hertz
    with new_folder(output) as unfinished:
        fill_dataset(
            *(unfinished, output, dataset.positions, dataset.responses, gateway, hertz, dataset.grid, dataset.moving),
            dataset.receivers if dataset.moving == "both" else None,
        )
        require_written(unfinished, output)
        names = picture_names(len(dataset))
        for label, part in (("train", dataset.train), ("test", dataset.test)):
            write_index(unfinished / f"{label}_index.txt", [names[index] for index in part])
    return [f"kept the spectra of {dataset.frequency}: {len(dataset)} (freq.txt lists {named(np.array(several))})"]


def _convert(source: Path, output: Path, conversion: Conversion) -> list[str]:
    require_spectra(source)
    metadata = read_metadata(source / "metadata.json")
    if "scene_file" in metadata:
        raise InputError(f"{source}: expected the folder of another program, found one that bisplat simulated")
    if conversion.moving is not None:
        metadata["moving"] = conversion.moving
    # Copied unchanged, with the keys of other programs.
    gateway = read_bytes(source / "gateway_info.yml", "the gateway's position and orientation", MEGABYTE)
    read_gateway(source / "gateway_info.yml")
    positions, receivers = read_points(source / "tx_pos.csv"), None
    if metadata.get("moving") == "both":
        receivers = read_receivers(source / "rx_pos.csv", len(positions))
    files = picture_files(source / "spectrum")
    numbers = np.array([int(path.stem) for path in files])
    rows = numbers - min(numbers[0], 1)
    said = ["numbered the pictures from 1 instead of 0"] if numbers[0] == 0 else []
    if rows[-1] >= len(positions):
        raise InputError(
            f"{source / 'tx_pos.csv'}: expected a row for each of the {len(files)} pictures, found {len(positions)} "
            f"rows; {files[-1].name} has none"
        )
    places = positions if receivers is None else np.hstack([positions, receivers])
    kept = kept_pictures(source, places[rows], rows, conversion, metadata)
    listed, said_of_indices = read_indices(source, [path.stem for path in files])
    read = READ if receivers is None else READ | {"rx_pos.csv"}
    left_out = sorted(path.name for path in source.iterdir() if path.name not in read)
    if left_out:
        more = ", …" if len(left_out) > LISTED else ""
        said.append(f"left out what is no part of the pictures' format: {', '.join(left_out[:LISTED])}{more}")

    chosen = [files[index] for index in kept.indices]
    found = survey(chosen)
    grid = grid_of(found, conversion) or stated_grid(metadata)
    if grid is not None and conversion.azimuths is not None:
        grid = replace(grid, azimuth_step_deg=1.0)
    examined = evenly(np.array(chosen, object), EXAMINED)
    sample = np.stack([read_in_size(path, found, conversion, grid or AngularGrid()) for path in examined])
    array = stated_array(metadata)
    array = None if array is None else array.at((kept.frequency or Frequency()).hertz)
    reading = reading_of(sample, conversion, array, grid)
    said += kept.said + _of_pictures(found, conversion) + reading.said
    names = picture_names(len(chosen))
    with progress_bar() as progress:
        for name, path in progress.track(list(zip(names, chosen, strict=True)), description="pictures"):
            picture = reading.picture(read_in_size(path, found, conversion, grid or AngularGrid()))
            write_atomically(output / "spectrum" / f"{name}.png", encode_picture(picture))
    write_positions(output / "tx_pos.csv", positions[rows[kept.indices]])
    if receivers is not None:
        write_positions(output / "rx_pos.csv", receivers[rows[kept.indices]])
    write_atomically(output / "gateway_info.yml", gateway)
    new_name = {files[index].stem: name for index, name in zip(kept.indices, names, strict=True)}
    for label, old in listed.items():
        write_index(output / f"{label}_index.txt", [new_name[name] for name in old if name in new_name])
    stated = metadata | reading.stated
    if kept.frequency is not None:
        stated["frequency_hz"] = kept.frequency.hertz
    if stated:
        write_metadata(output / "metadata.json", {"made_by": "bisplat convert"} | stated)
    return said + said_of_indices


def _of_pictures(found: Survey, conversion: Conversion) -> list[str]:
    """Sentences on what is changed since the files are not 8-bit grey of 360 × 90 pixels."""
    said = []
    others = [f"{width} × {height}" for height, width in found.shapes if (height, width) != (ROWS, COLUMNS)]
    if (COLUMNS, ROWS) in found.shapes:
        said.append("transposed the pictures")
        others.remove(f"{ROWS} × {COLUMNS}")
    if others:
        said.append(f"sampled pictures of {', '.join(others[:LISTED])} pixels at {COLUMNS} × {ROWS} directions")
    elif conversion.azimuths is not None:
        said.append("sampled the pictures at the azimuths 0° to 359°")
    modes = ", ".join(mode for mode in found.modes if mode != "L")
    if modes:
        said.append(f"turned pictures of mode {modes} into 8-bit grey")
    if found.white != LARGEST_GREY:
        said.append(f"took the folder's largest level, {found.white}, for white")
    return said


def _likewise(array: Array) -> str:
    """A sentence on the turns and mirrorings of the pictures that the array explains as well, and what to do."""
    if isinstance(array, PlanarArray):
        step = "any multiple of 90°" if array.rows == array.columns else "180°"
        turns = f"turned by {step} or mirrored"
    else:
        turns = " or ".join(str(turn) for turn in turns_of(array)[1:])
    if not turns:
        return ""
    return f". The array explains pictures that are {turns} as well; if yours are, state --azimuths"


def _of_result(dataset: Dataset, conversion: Conversion) -> list[str]:
    """Sentences on what is known and what is assumed of the new dataset."""
    known, array = dataset.identification, dataset.array
    said = []
    if known.residual is not None and known.residual >= DOUBTFUL:
        said.append(
            f"no array that was tried explains the pictures: {array.in_words} leave "
            f"{known.residual:.1f} of 255 grey levels (rounding alone: 0.3)"
        )
    doubt = bearing_of(dataset).doubt(dataset.grid)
    if doubt is not None:
        said.append(f"warning: {doubt}")
    elif conversion.azimuths is None:
        said.append(f"took column 0 for azimuth 0° and azimuths for rising{_likewise(array)}")
    if "moving" not in dataset.metadata:
        said.append(
            "took tx_pos.csv for the places of transmitters; if it holds those of an array that moved, as SwiftWRF's "
            "data do, state --moving receiver"
        )
    return said + assumptions_of(dataset)


def read_indices(source: Path, old_names: Sequence[str]) -> tuple[dict[str, list[str]], list[str]]:
    """The picture names in each index file, none if there are no files; and sentences on what was changed."""
    labels = ("train", "test")
    files = {label: source / f"{label}_index.txt" for label in labels}
    if not all(path.exists() for path in files.values()):
        return {}, [
            "wrote no index files, since the source has none: use the split random (or blocked, from 21 spectra on)"
        ]
    what = "one picture name per line"
    listed = {label: read_text(path, what, LARGEST_INDEX).split() for label, path in files.items()}
    everything = [*listed["train"], *listed["test"]]
    if set(everything) <= set(old_names):
        return listed, []
    if not all(is_number(name) for name in everything):
        raise InputError(f"{files['train']}: expected names or numbers of pictures, found other words")
    numbers = {int(name) for name in everything}
    named = {int(name): name for name in old_names}
    said = "added the leading zeros of the names in the index files"
    if 0 in numbers - named.keys():  # then they count the pictures
        named = dict(enumerate(old_names))
        said = "read the index files as numbers from 0"
    if not numbers <= named.keys():
        raise InputError(f"{files['train']}: expected numbers of {len(old_names)} pictures, found {max(numbers)}")
    return {label: [named[int(name)] for name in names] for label, names in listed.items()}, [said]
