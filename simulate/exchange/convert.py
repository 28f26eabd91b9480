"""Convert the folder of another program into a NeRF² dataset folder of this format.

It recognises pictures that are transposed, upside down, of another size, or numbered from 0; grey levels stored in
colour or 16 bits; and index files with numbers that lack leading zeros.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int, UInt8
from scipy.ndimage import map_coordinates

from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError, ParameterError, require_within, shown
from scenes.files.input_file import MEGABYTE, read_bytes, read_text
from scenes.files.output_folder import new_folder
from scenes.files.progress import progress_bar
from simulate.dataset.dataset_folder import inspect
from simulate.dataset.dataset_reader import LARGEST_INDEX, read_gateway
from simulate.dataset.dataset_writer import encode_picture, write_index, write_metadata, write_positions
from simulate.dataset.picture_files import is_number, picture_files, read_any_picture
from simulate.exchange.conversion import Conversion
from simulate.generation.written_parts import picture_names
from simulate.positions.given_positions import read_points
from simulate.spectra.angular_grid import COLUMNS, ROWS, AngularGrid
from simulate.spectra.identification import identify, larger_array
from simulate.spectra.lags import EXAMINED
from simulate.spectra.spectrum import evenly

SIXTEEN_BITS = 257
"""16-bit grey levels in one 8-bit grey level: 65535 / 255."""


def convert(source: Path, output: Path, conversion: Conversion = Conversion()) -> list[str]:
    """Write a folder's spectra as a NeRF² dataset folder.

    Args:
        source: the folder, with spectrum/, tx_pos.csv, gateway_info.yml and perhaps index files.
        output: the new dataset folder.
        conversion: how to read the pictures.

    Returns:
        Sentences on what was changed.

    Raises:
        InputError: the folder lacks a file, a picture cannot be converted, the result is not a valid dataset, the
            output is not new, or another process writes it.
        ParameterError: a position has fewer than ``one_per_position`` pictures, or the ends of the elevations or
            azimuths are not two different angles.
    """
    for name, ends in (("elevations", conversion.elevations), ("azimuths", conversion.azimuths)):
        for end in ends or ():
            require_within(-360, 360, "angles in degrees", **{name: end})
        if ends is not None and ends[0] == ends[1]:
            raise ParameterError(name, f"expected two different angles, found {ends[0]:g} twice")
    with new_folder(output) as unfinished:
        said = _convert(source, unfinished, conversion)
        problems = inspect(unfinished).problems
        if problems:  # which are those of the source
            raise InputError(problems[0].replace(str(unfinished), str(source)))
        return said


def _gateway(path: Path) -> bytes:
    """The content of gateway_info.yml, to be copied unchanged, including the keys of other programs."""
    content = read_bytes(path, "the gateway's position and orientation", MEGABYTE)
    problems: list[str] = []
    read_gateway(path, problems)
    if problems:
        raise InputError(problems[0])
    return content


def _convert(source: Path, output: Path, conversion: Conversion) -> list[str]:
    """Convert into an empty folder."""
    if (source / "metadata.json").exists():
        raise InputError(f"{source}: expected the folder of another program, found one with metadata.json of bisplat")
    gateway = _gateway(source / "gateway_info.yml")
    positions = read_points(source / "tx_pos.csv")
    files = picture_files(source / "spectrum")
    said = ["numbered the pictures from 1 instead of 0"] if int(files[0].stem) == 0 else []
    if len(files) > len(positions):
        raise InputError(
            f"{source / 'tx_pos.csv'}: expected a row for each of the {len(files)} pictures, found "
            f"{len(positions)} rows"
        )
    positions = positions[: len(files)]
    old_names = [path.stem for path in files]
    kept = _kept(positions, conversion.one_per_position)
    if len(kept) < len(files):
        said.append(f"kept picture {conversion.one_per_position} of each position: {len(kept)} of {len(files)}")

    files = [files[index] for index in kept]
    sample = np.stack([_in_size(path, conversion) for path in evenly(np.array(files, object), EXAMINED)])
    flipped = conversion.flip_elevation
    if flipped is None:
        found = identify(sample, None)
        flipped = found.beamformer.grid.elevation_step_deg < 0
    if flipped:
        said.append("turned the pictures upside down")
    shape, mode = _shape_and_mode(files[0])
    if shape != (ROWS, COLUMNS):
        said.append(
            "transposed the pictures"
            if shape == (COLUMNS, ROWS)
            else f"sampled pictures of {shape[1]} × {shape[0]} pixels at {COLUMNS} × {ROWS} directions"
        )
    if mode != "L":
        said.append(f"turned pictures of mode {mode} into 8-bit grey")

    listed, said_of_indices = _read_indices(source, old_names)
    names = picture_names(len(files))
    with progress_bar() as progress:
        for name, path in progress.track(list(zip(names, files, strict=True)), description="pictures"):
            picture = _in_size(path, conversion)
            content = encode_picture(picture[::-1] if flipped else picture)
            write_atomically(output / "spectrum" / f"{name}.png", content)
    write_positions(output / "tx_pos.csv", positions[kept])
    write_atomically(output / "gateway_info.yml", gateway)
    new_name = {old_names[index]: name for index, name in zip(kept, names, strict=True)}
    for label, old in listed.items():
        write_index(output / f"{label}_index.txt", [new_name[name] for name in old if name in new_name])
    said += said_of_indices + _state_array(sample[:, ::-1] if flipped else sample, output)
    return said


def _kept(positions: Float[np.ndarray, "K 3"], number: int | None) -> Int[np.ndarray, " n"]:
    """Indices of the pictures to keep."""
    if number is None:
        return np.arange(len(positions))
    _, places, counts = np.unique(positions, axis=0, return_inverse=True, return_counts=True)
    kept = np.split(np.argsort(places.ravel(), kind="stable"), np.cumsum(counts)[:-1])
    fewest = min(len(group) for group in kept)
    if not 1 <= number <= fewest:
        raise ParameterError("one_per_position", f"expected a number from 1 to {fewest}, found {shown(number)}")
    return np.sort([group[number - 1] for group in kept])


def _shape_and_mode(path: Path) -> tuple[tuple[int, int], str]:
    pixels, mode = read_any_picture(path)
    return (pixels.shape[0], pixels.shape[1]), mode


def _in_size(path: Path, conversion: Conversion) -> UInt8[np.ndarray, "90 360"]:
    """One picture, as 8-bit grey of 360 × 90 pixels."""
    grey = _grey(path)
    if grey.shape == (COLUMNS, ROWS):
        return grey.T
    if grey.shape == (ROWS, COLUMNS):
        return grey
    if conversion.elevations is None or conversion.azimuths is None:
        raise InputError(
            f"{path}: expected {COLUMNS} × {ROWS} pixels, found {grey.shape[1]} × {grey.shape[0]}; give the angles of "
            "the first and last row and column by --elevations and --azimuths, in degrees"
        )
    grid = AngularGrid()
    row = _index(grid.elevations_deg, conversion.elevations, grey.shape[0])
    turns = 360 * np.floor((grid.azimuths_deg - min(conversion.azimuths)) / 360)
    column = _index(grid.azimuths_deg - turns, conversion.azimuths, grey.shape[1])
    where = np.meshgrid(row, column, indexing="ij")
    sampled = map_coordinates(grey.astype(float), where, order=1, mode="constant", cval=0.0)
    return np.round(sampled).astype(np.uint8)


def _index(angles: Float[np.ndarray, " n"], ends: tuple[float, float], count: int) -> Float[np.ndarray, " n"]:
    """Fractional indices of angles among ``count`` evenly spaced angles from the first end to the last."""
    first, last = ends
    return (angles - first) / (last - first) * (count - 1)


def _grey(path: Path) -> UInt8[np.ndarray, "H W"]:
    pixels, mode = read_any_picture(path)
    if mode == "L":
        return pixels
    if mode.startswith("I"):
        return np.round(pixels / SIXTEEN_BITS).clip(0, 255).astype(np.uint8)
    if mode in ("RGB", "RGBA") and np.ptp(pixels[..., :3], axis=-1).max() == 0:
        return pixels[..., 0]
    raise InputError(f"{path}: expected grey levels, found a picture of mode {mode} with colours that are not grey")


def _read_indices(source: Path, old_names: Sequence[str]) -> tuple[dict[str, list[str]], list[str]]:
    """The picture names in each index file, none if there are no files; and sentences on what was changed."""
    labels = ("train", "test")
    files = {label: source / f"{label}_index.txt" for label in labels}
    if not all(path.exists() for path in files.values()):
        return {}, ["wrote no index files, since the source has none: use the split random or blocked"]
    what = "one picture name per line"
    listed = {label: read_text(path, what, LARGEST_INDEX).split() for label, path in files.items()}
    everything = [*listed["train"], *listed["test"]]
    said = []
    if not set(everything) <= set(old_names):
        if not all(is_number(name) for name in everything):
            raise InputError(f"{files['train']}: expected names or numbers of pictures, found other words")
        numbers = [int(name) for name in everything]
        first = 1 if max(numbers) == len(old_names) else 0
        if not all(first <= number < len(old_names) + first for number in numbers):
            raise InputError(f"{files['train']}: expected numbers of {len(old_names)} pictures, found {max(numbers)}")
        listed = {label: [old_names[int(name) - first] for name in names] for label, names in listed.items()}
        said.append(f"read the index files as numbers from {first}")
    return listed, said


def _state_array(sample: UInt8[np.ndarray, "E 90 360"], output: Path) -> list[str]:
    """Write metadata.json if the pictures show an array that ``read_dataset`` would not find itself."""
    if identify(sample, None).source == "fitted":
        return []
    larger = larger_array(sample)
    if larger is None:
        return []
    array, grid = larger.beamformer.array, larger.beamformer.grid
    metadata = {"array": asdict(array), "grid": asdict(grid), "made_by": "bisplat convert"}
    write_metadata(output / "metadata.json", metadata)
    return [
        f"stated an array of {array.rows} × {array.columns} elements, {array.spacing} wavelengths apart, in "
        "metadata.json, since it explains the pictures"
    ]
