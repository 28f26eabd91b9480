"""Simulate a dataset: positions -> responses -> spectra -> a NeRF² folder, interruptible at any moment.

A run first writes ``metadata.json``, which records the request. Then it works through the positions in parts. Each
finished part leaves its pictures and its responses, the latter as ``parts/NNNNN.npy``. When the same request is given
again, its settings are those of the metadata, so the run skips the parts whose files are whole and ends with the same
bytes. This also repairs a finished dataset. The index files come last, so that no loader takes an unfinished folder for
a dataset.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Complex, Float
from msgspec import to_builtins

from scenes.files.atomic import remove_left, require_writable, sync_folder, temporary_folder
from scenes.files.errors import InputError
from scenes.files.output_folder import has_other_files, locked
from scenes.files.plain_text import say
from scenes.files.progress import progress_bar
from scenes.storage.scene_writing import write_scene
from simulate.dataset.dataset_frequency import FREQUENCIES, write_frequencies
from simulate.dataset.dataset_kinds import PARTS
from simulate.dataset.index_files import write_index
from simulate.dataset.metadata import Metadata, read_metadata_file, write_metadata
from simulate.dataset.responses_file import write_responses
from simulate.dataset.spectra_folder import write_gateway
from simulate.generation.dataset_parts import WrittenParts, make_part, part_by_worker
from simulate.generation.request import Request
from simulate.parallel.machines import Machines, by_workers
from simulate.positions.positions import read_points, write_positions


def begun(folder: Path, metadata: dict[str, Any]) -> bool:
    """Whether a simulation with the same metadata began a folder; False if it is new or empty."""
    if not folder.exists() or (folder.is_dir() and not has_other_files(folder)):
        return False
    path = folder / "metadata.json"
    if not path.is_file():
        raise InputError(f"{folder}: expected a new folder or one that this command began, found other files in it")
    found = read_metadata_file(path, "the settings of a dataset")
    # Through JSON, so that numbers compare as they were written.
    wanted, missing = json.loads(json.dumps(metadata)), to_builtins(Metadata())
    recorded = [key for key in missing if key in found]  # some settings are recorded by some simulations only
    for key in ("seed", *wanted, *recorded):  # the seed first, since propagation and measurement contain seeds, too
        there, here = (settings.get(key, missing.get(key)) for settings in (found, wanted))
        if there != here:
            raise InputError(
                f"{folder}: expected a new folder or one that this command began, found a dataset whose "
                f"{_difference(key, there, here)}"
            )
    return True


@contextmanager
def continued(folder: Path, metadata: dict[str, Any]) -> Iterator[None]:
    """Lock a folder within a block, and begin it unless the same simulation did."""
    with locked(folder):
        if not begun(folder, metadata):  # again, since another process may have begun in the meantime
            write_metadata(folder / "metadata.json", metadata)
        remove_left(folder, deep=True)
        yield


def _difference(key: str, found: Any, wanted: Any) -> str:
    """A setting that differs; of a group of settings, the first one that does."""
    if isinstance(found, dict) and isinstance(wanted, dict) and found.keys() == wanted.keys():
        inner = next(each for each in wanted if found[each] != wanted[each])
        return _difference(f"{key}.{inner}", found[inner], wanted[inner])
    return f"{key} is {found}, not {wanted}"


PART = 250  # Positions per part. A run that is killed loses at most one part.

LAST_FILE = "test_index.txt"  # The file of a dataset that is written last


def generate(request: Request, folder: Path, machines: Machines = Machines()) -> None:
    """Simulate a dataset into a folder, or finish one that the same request began."""
    if not has_work(request, folder, machines):
        return
    with continued(folder, request.metadata()):
        if not _is_finished(request, folder):
            _generate(request, folder, machines)


def has_work(request: Request, folder: Path, machines: Machines) -> bool:
    """Whether ``generate`` has anything to do. If several datasets are wanted, this is called for all of them first."""
    if begun(folder, request.metadata()) and _is_finished(request, folder):
        return False
    require_writable(folder / LAST_FILE)
    request.engine.require(request.setting, folder, machines)
    return True


def _generate(request: Request, folder: Path, machines: Machines) -> None:
    """Make what is missing in a folder with the request's metadata."""
    (folder / "spectrum").mkdir(exist_ok=True)
    (folder / PARTS).mkdir(exist_ok=True)
    if not (folder / "scene").exists():
        with temporary_folder(folder) as unfinished:
            write_scene(request.scene, unfinished)
            unfinished.rename(folder / "scene")
    parts = WrittenParts(request, folder, PART)
    kept = parts.whole()
    for sentence in parts.damage:
        say(sentence)
    _make_parts(request, parts, kept, machines)

    write_responses(folder / "channels.npz", np.concatenate([kept[start] for start in sorted(kept)]), request.band)
    scene, names = request.scene, parts.names
    for name, points in _points(request).items():
        write_positions(folder / name, points)
    if request.frequencies:
        write_frequencies(folder / FREQUENCIES, np.repeat(request.frequencies, len(request.positions)))
    place = scene.gateway.position if request.receivers is None else request.receivers[0].tolist()
    write_gateway(folder / "gateway_info.yml", scene.name, place, scene.gateway.orientation)
    for name, part in (("train_index.txt", request.known), (LAST_FILE, request.held_out)):
        if not _has_content(folder / name):  # a finished dataset keeps its split when it is repaired
            sync_folder(folder)
            write_index(folder / name, [names[i] for i in part])
    shutil.rmtree(folder / PARTS)


def _is_finished(request: Request, folder: Path) -> bool:
    """Whether a folder with the request's metadata holds the whole dataset, with no damaged file."""
    files = ["gateway_info.yml", "train_index.txt", LAST_FILE, *([FREQUENCIES] if request.frequencies else [])]
    if (folder / PARTS).exists() or not all(_has_content(folder / name) for name in files):
        return False
    if not (folder / "scene").is_dir() or not request.engine.is_whole(request.setting, folder):
        return False
    if not all(_has_points(folder / name, points) for name, points in _points(request).items()):
        return False
    parts = WrittenParts(request, folder, PART)
    return len(parts.whole()) == len(parts.starts)


def _points(request: Request) -> dict[str, Float[np.ndarray, "n 3"]]:
    """The files of positions with their content, which repeats at each frequency."""
    ends = {"tx_pos.csv": request.positions, "rx_pos.csv": request.receivers}
    return {name: np.tile(each, (len(request.scenes), 1)) for name, each in ends.items() if each is not None}


def _has_points(path: Path, points: Float[np.ndarray, "n 3"]) -> bool:
    try:
        return np.array_equal(read_points(path), points)
    except InputError:
        return False


def _has_content(path: Path) -> bool:
    """Whether there is a file and it is not empty. A crash of the machine may leave an empty one."""
    return path.is_file() and path.stat().st_size > 0


def _make_parts(
    request: Request,
    parts: WrittenParts,
    kept: dict[int, Complex[np.ndarray, "n elements *band"]],
    machines: Machines,
) -> None:
    """Make the missing parts, and what the engine stores in the folder, and add their responses to ``kept``."""
    engine = request.engine
    todo = [start for start in parts.starts if start not in kept]
    if not todo and not engine.keeps_source:
        return
    with progress_bar() as progress:
        sources = engine.sources(request.settings, parts.folder, machines, progress)
        bar = progress.add_task("spectra", total=len(parts.names), completed=sum(map(len, kept.values())))
        if not engine.keeps_source and machines != Machines():
            shared = request, [engine.sent(each) for each in sources], PART, str(request.metadata())
            made = by_workers(machines, part_by_worker, shared, todo)
        else:
            of_array = request.of_array(sources)
            made = ((start, make_part(request, of_array, start, PART)) for start in todo)
        for start, part in made:
            parts.write(start, part)
            kept[start] = part.responses
            progress.advance(bar, len(part.responses))
