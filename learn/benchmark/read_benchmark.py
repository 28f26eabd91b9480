"""A benchmark in memory: its dataset, whose own parts are the known and the tested rows of the task."""

from __future__ import annotations

from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path

import numpy as np
from jaxtyping import Int

from learn.benchmark.benchmark_sets import SETS, benchmarks
from learn.benchmark.folder_files import PARTS, set_of, task_file
from learn.benchmark.frozen import require_frozen
from scenes.files.errors import InputError, ParameterError, did_you_mean, require_path, shown
from scenes.scene.frequency import read_frequency
from simulate.csi.csi_dataset import CsiDataset, read_csi
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import read_dataset
from simulate.dataset.index_files import read_index
from simulate.rssi.rssi_dataset import RssiDataset, read_rssi


def read_benchmark(
    benchmark: str, folder: Path | str, frequency: float | str | None = None
) -> Dataset | RssiDataset | CsiDataset:
    """Read a benchmark: the dataset of its set, whose ``train`` and ``test`` are the known and the tested rows.

    So ``compare``, ``compare_powers`` and ``compare_channels`` with the split "files" score methods on it.

    Args:
        benchmark: its name, such as "lab-blocked" or "rssi-office-random-200": a set and one of its tasks.
        folder: the folder that ``make_benchmark`` made.
        frequency: of a set of several frequencies, the one to read: hertz, or a text such as "902 MHz". None: the
            lowest one.

    Returns:
        The dataset.

    Raises:
        InputError: the folder is of another set, or differs from the frozen one.
        ParameterError: no benchmark has this name, or the set has one frequency and one is given.

    Example:
        >>> import bisplat
        >>> dataset = bisplat.make_benchmark("practice", "data/practice")
        >>> task = bisplat.read_benchmark("practice-blocked", "data/practice")
        >>> len(task.train), len(task.test)
        (40, 20)
    """
    of, task = named_benchmark(benchmark)
    require_path(folder=folder)
    folder, several = Path(folder), SETS[of].frequencies
    if frequency is not None:
        read_frequency(frequency)
        if not several:
            raise ParameterError("frequency", f"expected none for {benchmark}, which has one, found {shown(frequency)}")
    require_set(of, folder)
    require_frozen(of, folder)
    kind = SETS[of].kind
    dataset: Dataset | RssiDataset | CsiDataset
    if kind == "spectra":
        dataset = read_dataset(folder, several[0] if several and frequency is None else frequency)
        names = dataset.names
    else:
        dataset = read_rssi(folder) if kind == "powers" else read_csi(folder)
        names = [str(number) for number in range(len(dataset))]
    known, test = (_rows(task_file(folder, task, part), names, bool(several)) for part in PARTS)
    return replace(dataset, train=known, test=test)


def named_benchmark(name: str) -> tuple[str, str]:
    """The set and the task of a benchmark."""
    if not isinstance(name, str) or name not in benchmarks():
        hint = f"; {did_you_mean(name, benchmarks())}" if get_close_matches(str(name), benchmarks()) else ""
        raise ParameterError(
            "benchmark",
            "expected a dataset and a task, such as lab-blocked (bisplat benchmark lists them), found "
            f"{shown(name)}{hint}",
        )
    return benchmarks()[name]


def require_set(name: str, folder: Path) -> None:
    """Raise an InputError if a folder is not a finished one of the set."""
    found = set_of(folder)
    if found != name:
        raise InputError(f"{folder}: expected the benchmark dataset {name}, found {found}")


def _rows(path: Path, names: list[str], some: bool) -> Int[np.ndarray, " n"]:
    """The rows that an index file lists; with ``some``, those of them that are in the dataset."""
    if not some:
        return read_index(path, names)
    listed = set(path.read_text().split())
    return np.array([row for row, name in enumerate(names) if name in listed], dtype=int)
