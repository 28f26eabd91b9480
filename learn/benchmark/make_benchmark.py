"""Make a named benchmark dataset, and check that it is the frozen one."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from learn.benchmark.benchmark_sets import SEED, SETS, STRIDE, BenchmarkSet, Kind
from learn.benchmark.folder_files import PARTS, is_finished, record_set, set_of, task_file
from learn.benchmark.frozen import require_frozen
from learn.data.splits import split
from scenes.files.errors import InputError, require_path, require_word
from scenes.files.plain_text import say
from scenes.scene.description import Scene
from scenes.storage.scene_yaml import load_scene
from simulate.csi.csi_dataset import CsiDataset, read_csi
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_writer import write_index
from simulate.dataset.folder_kinds import CHANNELS, POWERS
from simulate.exchange.csi_export import export_csi
from simulate.generation.dataset_parts import picture_names
from simulate.generation.reciprocity import element_offsets
from simulate.generation.simulation import simulate
from simulate.positions.placement import AT_IT, place
from simulate.rays.core.propagation import Propagation
from simulate.rssi.rssi_dataset import RssiDataset, read_rssi
from simulate.rssi.rssi_simulation import simulate_rssi
from simulate.spectra.measurement import Measurement

Made = Dataset | RssiDataset | CsiDataset
"""The dataset of a folder, by its kind."""

OVER_BAND = "band"
"""The folder of the simulated responses that channels are exported from."""


def make_benchmark(name: str, folder: Path | str) -> Made:
    """Make a named benchmark dataset, whose test parts and values are the same wherever it is made.

    The folder is a dataset of spectra, of powers (RSSI) or of channels (CSI). ``tasks/TASK/train_index.txt`` and
    ``test_index.txt`` are the known and the predicted rows of each task, as ``bisplat benchmark NAME`` lists them. If
    the call is interrupted, the same call continues. On a finished folder it only checks. Positions and index files
    must equal the frozen ones byte for byte; values may differ from them as much as machines do.

    Args:
        name: name of the set: "rssi-office", "csi-lab", "lab", "closet", "moving-receiver-bedroom",
            "ten-frequencies-closet", or "practice", which takes seconds.
        folder: the new folder.

    Returns:
        The dataset, read from the folder; of several frequencies, the spectra of the lowest one.

    Raises:
        InputError: the folder holds something else, or what was made differs from the frozen set.
        ParameterError: no set has this name.

    Example:
        >>> import bisplat
        >>> dataset = bisplat.make_benchmark("practice", "data/practice")
        >>> len(dataset), len((dataset.folder / "tasks/blocked/test_index.txt").read_text().split())
        (60, 20)
    """
    require_word(SETS, name=name)
    require_path(folder=folder)
    folder, wanted = Path(folder), SETS[name]
    _require_own(name, folder)
    scene = load_scene(wanted.scene)
    if "frequency" in wanted.changes:
        scene = scene.at_frequency(wanted.changes["frequency"])
    if "rows" in wanted.changes:
        scene = scene.with_array(wanted.changes["rows"], wanted.changes["columns"])
    positions = walk(scene, wanted)
    dataset = _MAKERS[wanted.kind](wanted, scene, positions, folder)
    if dataset.positions is None or not np.array_equal(dataset.positions, positions):
        raise InputError(f"{folder}: expected a new folder or one of the set {name}, found other positions in it")
    if not is_finished(folder):
        _write_tasks(wanted, dataset, folder)
    say(f"{folder}: {require_frozen(name, folder)}")
    record_set(folder, name)
    return dataset


def _write_tasks(wanted: BenchmarkSet, dataset: Made, folder: Path) -> None:
    names = _names(dataset, wanted)
    for task, (known, test) in parts_of_tasks(wanted, dataset).items():
        for part, rows in zip(PARTS, (known, test), strict=True):
            path = task_file(folder, task, part)
            path.parent.mkdir(parents=True, exist_ok=True)
            write_index(path, [names[row] for row in rows])


def walk(scene: Scene, wanted: BenchmarkSet) -> Float[np.ndarray, "count 3"]:
    """The positions of a set, metres, world frame, in whole millimetres so that no rounding changes them."""
    moving = wanted.options.get("moving", "transmitter")
    offsets = AT_IT if moving == "transmitter" else element_offsets(scene.gateway, scene.wavelength)
    return place(scene, "path", STRIDE * wanted.count, SEED, offsets)[::STRIDE].round(3)


def parts_of_tasks(
    wanted: BenchmarkSet, dataset: Made
) -> dict[str, tuple[Int[np.ndarray, " n"], Int[np.ndarray, " t"]]]:
    """The known and the tested rows of each task, in rising order. Fewer known rows are among the more."""
    parts = {}
    for name, task in wanted.tasks.items():
        chosen = split(dataset, task.split, SEED)
        drawn = np.random.default_rng(SEED).permutation(chosen.known)
        rows = np.sort(drawn[: task.known]), chosen.test
        further = len(dataset) * np.arange(max(1, len(wanted.frequencies)))[:, None]
        parts[name] = ((rows[0] + further).ravel(), (rows[1] + further).ravel())
    return parts


def _names(dataset: Made, wanted: BenchmarkSet) -> list[str]:
    """What index files call the rows: names of pictures, or numbers from 0."""
    if not isinstance(dataset, Dataset):
        return [str(number) for number in range(len(dataset))]
    return picture_names(wanted.count * max(1, len(wanted.frequencies)))


def _require_own(name: str, folder: Path) -> None:
    """Refuse a finished folder of another set. An unfinished one is known by what simulated it."""
    if is_finished(folder) and (found := set_of(folder)) != name:
        raise InputError(f"{folder}: expected a new folder or one of the set {name}, found one of the set {found}")


def _make_spectra(wanted: BenchmarkSet, scene: Scene, positions: Float[np.ndarray, "K 3"], folder: Path) -> Dataset:
    options = {**wanted.options}
    for key, kind in (("measurement", Measurement), ("propagation", Propagation)):
        if key in options:
            options[key] = kind(**options[key])
    return simulate(scene, folder, positions=positions, seed=SEED, **options)


def _make_powers(wanted: BenchmarkSet, scene: Scene, positions: Float[np.ndarray, "K 3"], folder: Path) -> RssiDataset:
    if not (folder / POWERS).exists():
        simulate_rssi(scene, folder, wanted.gateways, positions=positions, seed=SEED, **wanted.options)
    return read_rssi(folder)


def _make_channels(wanted: BenchmarkSet, scene: Scene, positions: Float[np.ndarray, "K 3"], folder: Path) -> CsiDataset:
    if not (folder / CHANNELS).exists():
        if folder.is_dir() and any(path.name != OVER_BAND for path in folder.iterdir()):
            raise InputError(f"{folder}: expected a new folder or one that this command began, found other files in it")
        export_csi(_make_spectra(wanted, scene, positions, folder / OVER_BAND), folder, force=True)
    return read_csi(folder)


_MAKERS: dict[Kind, Callable[[BenchmarkSet, Scene, Float[np.ndarray, "K 3"], Path], Made]] = {
    "spectra": _make_spectra,
    "powers": _make_powers,
    "channels": _make_channels,
}
