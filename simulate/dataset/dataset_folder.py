"""Reading a dataset folder, whatever was measured, and every look at one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from os import PathLike
from pathlib import Path

from scenes.files.errors import InputError, require_instance, require_path
from scenes.files.input_file import what_is_at
from scenes.files.long_work import doing
from scenes.files.plain_text import say
from scenes.scene.frequency import read_frequency
from simulate.dataset.channels_folder import assumptions_of_channels, read_channels
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_kinds import QUANTITIES, content_of, is_rooms, quantity_of, unfinished
from simulate.dataset.inspection import Inspection
from simulate.dataset.powers_folder import read_powers
from simulate.dataset.spectra_folder import assumptions_of_spectra, read_spectra

READERS: dict[str, Callable[[Inspection, float | None], Dataset | None]] = {
    "spectrum": read_spectra,
    "power": read_powers,
    "channel": read_channels,
}
"""Read the folder of a quantity. ``inspect`` gives them what they add problems and warnings to, and a frequency."""

ASSUMPTIONS: dict[str, Callable[[Dataset], list[str]]] = {
    "spectrum": assumptions_of_spectra,
    "channel": assumptions_of_channels,
}


def read_dataset(folder: Path | str, frequency: float | str | None = None) -> Dataset:
    """Read and check a dataset folder, simulated or measured.

    Spectra need the pictures ``spectrum/00001.png`` and on, ``tx_pos.csv`` and ``gateway_info.yml``; element responses
    are read if they are there. If metadata.json does not state the array and the grid of the spectra, they are found by
    a fit to the pictures. Received powers need ``gateway_rssi.csv``, ``tx_pos.csv`` and ``gateway_position.yml``.
    Channels need ``csidata.npy``, complex [K, antennas, subcarriers], and ``base-station.yml``; ``tx_pos.csv`` is read
    if it is there. So are index files and metadata.json of every folder. What the folder does not state and the data do
    not show, such as the frequency, is assumed, and a line on stderr says so.

    Args:
        folder: the dataset folder.
        frequency: of a folder with pictures of several frequencies, the one to read: hertz, or a text with a unit such
            as "2.4 GHz". None: the folder has only one.

    Returns:
        The dataset.

    Raises:
        ParameterError: the frequency is none.
        InputError: a file is missing, damaged or inconsistent with another one, or the values cannot be what they are
            said to be. The message states the first problem and the number of further ones.

    Example:
        >>> import bisplat
        >>> dataset = bisplat.read_dataset("data/lab")
        >>> dataset.names[:3], dataset.spectra.shape, dataset.array.elements
        (['00001', '00002', '00003'], (40, 90, 360), 16)
        >>> bisplat.read_dataset("data/attic")
        Traceback (most recent call last):
        scenes.files.errors.InputError: data/attic: expected a dataset folder, found nothing there
    """
    require_path(folder=folder)
    dataset = inspect(Path(folder), None if frequency is None else read_frequency(frequency)).usable()
    doing("")
    place = Path(folder).resolve()
    for sentence in assumptions_of(dataset):
        if (place, sentence) not in _SAID:  # many programs read a dataset more than once
            _SAID.add((place, sentence))
            say(f"warning: {folder}: {sentence}")
    return dataset


_SAID: set[tuple[Path, str]] = set()


def inspect(folder: Path, wanted: float | None = None) -> Inspection:
    """Read a folder and collect every problem, instead of stopping at the first."""
    found = Inspection(folder)
    if not folder.is_dir():
        found.problems.append(f"{folder}: expected a dataset folder, found {what_is_at(folder)}")
    elif is_rooms(folder):
        found.problems.append(f"{folder}: expected a dataset folder, found {content_of(folder)}")
    elif sentence := unfinished(folder):
        found.problems.append(sentence)
    else:
        quantity = quantity_of(folder) or "spectrum"
        doing(f"{folder}: reading {QUANTITIES[quantity].words}")
        dataset = READERS[quantity](found, wanted)
        return replace(found, dataset=None if found.problems else dataset)
    return found


def assumptions_of(dataset: Dataset) -> list[str]:
    """A sentence for everything that the folder of a dataset does not state, its data do not show, and was assumed."""
    return ASSUMPTIONS.get(dataset.quantities[0], lambda _: [])(dataset)


def given_dataset(dataset: Dataset | Path | str, *quantities: str) -> Dataset:
    """The dataset that a caller gives, or that is in a folder. It must have one of the quantities; none: spectra."""
    require_instance(Dataset, str, PathLike, dataset=dataset)
    found = dataset if isinstance(dataset, Dataset) else read_dataset(dataset)
    if not any(quantity in found.values for quantity in quantities):
        found.require(quantities[0] if quantities else "spectrum")
    return found


def require_written(unfinished: Path, called: Path) -> None:
    """Refuse a folder that has just been written and could not be read."""
    problems = inspect(unfinished).problems
    if problems:
        raise InputError(problems[0].replace(str(unfinished), str(called)))


def require_fixed_array(dataset: Dataset, what: str) -> None:
    """Refuse a dataset whose receiver moves, for what traces the scene with a fixed array."""
    require_fixed_end(dataset)
    if dataset.moving == "receiver":
        raise InputError(
            f"{dataset.folder}: expected a dataset whose transmitter moves, for {what}, found one whose receiver moves"
        )


def require_fixed_end(dataset: Dataset) -> None:
    """Refuse a dataset of which both ends move, for what takes spectra as a function of one position."""
    if dataset.moving == "both":
        raise InputError(
            f"{dataset.folder}: expected spectra of a link with one end that stands still, found some whose "
            "transmitter and receiver both move; simulate --moving receiver makes spectra of one transmitter"
        )
