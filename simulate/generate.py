"""Simulate a dataset: positions -> traced responses -> spectra -> a NeRF² folder, interruptible at any moment.

A run first writes ``metadata.json``, which records the request, then works through the positions in parts. Each
finished part leaves its pictures and, as ``parts/NNNNN.npy``, its responses. The same request again finds the metadata
equal, skips the finished parts and ends with the same bytes. The index files are written last, so that no loader takes
an unfinished folder for a dataset.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from io import BytesIO
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TextColumn,
    TimeRemainingColumn,
)
from rich.text import Text

from scenes.atomic import write_atomically
from scenes.errors import InputError, ParameterError
from scenes.plain_text import plain_console
from scenes.scene_yaml import write_scene
from simulate.dataset_part import Part, make_part
from simulate.dataset_writer import (
    write_gateway,
    write_index,
    write_metadata,
    write_positions,
    write_responses,
)
from simulate.fullwave.dataset_field import field_of
from simulate.fullwave.stored_field import StoredField
from simulate.ray_cluster import require_ray
from simulate.request import Request
from simulate.workers import parts_of_workers

if TYPE_CHECKING:  # needs the ray tracer
    from simulate.trace import Tracer

PART = 100
"""Positions per part. A run that is killed loses one part at most."""

TEST_FRACTION = 0.2


def generate(
    request: Request, folder: Path, workers: int | None = None, ray: str | None = None, gpu: bool = False
) -> None:
    """Simulate a dataset into a folder, or finish one that the same request began.

    Args:
        request: the dataset to make.
        folder: the dataset folder: a new one, an empty one, or one that the same request began.
        workers: number of Ray workers that trace at a time; this process traces if neither this nor ``ray`` is given.
            In full wave, the number of the solver's runs at a time; one per core if None.
        ray: address of a running Ray cluster.
        gpu: in full wave, run gprMax on an NVIDIA GPU.

    Raises:
        InputError: the folder holds something else, or a dataset of another request.
        ParameterError: less than one worker, no Ray cluster at the address, or a GPU for rays.
    """
    if workers is not None and workers < 1:
        raise ParameterError("workers", f"expected at least 1, found {workers}")
    if gpu and request.fullwave is None:
        raise ParameterError("gpu", "expected none, or the engine fullwave, found it for rays")
    metadata = request.metadata()
    begun = _begun(folder, metadata)
    if begun and (folder / "test_index.txt").exists():
        shutil.rmtree(folder / "parts", ignore_errors=True)  # left by a run that was killed while it removed them
        return
    if request.fullwave is None:
        import simulate.ray_tracer  # noqa: F401  a ray tracer that cannot be used is refused before anything is written
    if ray is not None or (request.fullwave is None and workers is not None):
        require_ray(ray)

    if not begun:
        folder.mkdir(parents=True, exist_ok=True)
        write_metadata(folder / "metadata.json", metadata)
    (folder / "spectrum").mkdir(exist_ok=True)
    (folder / "parts").mkdir(exist_ok=True)
    if not (folder / "scene").exists():
        shutil.rmtree(folder / "scene.tmp", ignore_errors=True)
        write_scene(request.scene, folder / "scene.tmp")
        (folder / "scene.tmp").rename(folder / "scene")
    names = picture_names(len(request.positions))
    _trace_parts(request, names, folder, workers, ray, gpu)

    responses = np.concatenate([np.load(_part_file(folder, start)) for start in range(0, len(names), PART)])
    scene = request.scene
    write_responses(folder / "channels.npz", responses)
    write_positions(folder / "tx_pos.csv", request.positions)
    write_gateway(folder / "gateway_info.yml", scene.name, scene.gateway.position, scene.gateway.orientation)
    order = np.random.default_rng(request.seed).permutation(len(names))
    held_out = max(1, round(TEST_FRACTION * len(names)))
    write_index(folder / "train_index.txt", [names[i] for i in sorted(order[held_out:])])
    write_index(folder / "test_index.txt", [names[i] for i in sorted(order[:held_out])])
    shutil.rmtree(folder / "parts")


def picture_names(count: int) -> list[str]:
    """Zero-padded names from 1 on, of five digits, or of more if needed."""
    digits = max(5, len(str(count)))
    return [f"{number:0{digits}d}" for number in range(1, count + 1)]


def _begun(folder: Path, metadata: dict[str, Any]) -> bool:
    """Whether the folder was begun by a request of the same metadata; False if it is new or empty."""
    # A run killed in its first moment leaves no more than the unfinished metadata.
    if not folder.exists() or (folder.is_dir() and {p.name for p in folder.iterdir()} <= {"metadata.json.tmp"}):
        return False
    path = folder / "metadata.json"
    if not path.is_file():
        raise InputError(f"{folder}: expected a new folder or one this command began, found other files in it")
    try:
        found = json.loads(path.read_text())
    except ValueError as error:
        raise InputError(f"{path}: expected JSON, found {error}") from error
    if not isinstance(found, dict):
        raise InputError(f"{path}: expected a JSON object, found {type(found).__name__}")
    found.setdefault("engine", "rays")  # of version 0.1, which had no other
    # As JSON, so that numbers compare as they were written.
    wanted = json.loads(json.dumps(metadata))
    for key in ("seed", *wanted):  # the seed first, since propagation and measurement hold seeds too
        if found.get(key) != wanted[key]:
            raise InputError(
                f"{folder}: expected a new folder or one this command began, found a dataset whose {key} is "
                f"{found.get(key)}, not {wanted[key]}"
            )
    return True


def _part_file(folder: Path, start: int) -> Path:
    return folder / "parts" / f"{start:010d}.npy"


def _trace_parts(
    request: Request, names: list[str], folder: Path, workers: int | None, ray: str | None, gpu: bool
) -> None:
    count = len(names)
    todo = [start for start in range(0, count, PART) if not _part_file(folder, start).exists()]
    if not todo:
        return
    with progress_bar() as progress:
        source = _source(request, folder, workers, ray, gpu, progress)
        done = count - sum(min(PART, count - start) for start in todo)
        bar = progress.add_task("spectra", total=count, completed=done)
        if isinstance(source, StoredField) or (workers is None and ray is None):
            parts: Iterator[tuple[int, Part]] = ((start, make_part(request, source, start, PART)) for start in todo)
        else:
            parts = parts_of_workers(request, source.found, todo, PART, workers, ray)
        for start, part in parts:
            for name, picture, power in zip_longest(names[start : start + PART], part.pictures, part.power):
                write_atomically(folder / "spectrum" / f"{name}.png", picture)
                if power is not None:
                    write_atomically(folder / "power_db" / f"{name}.tif", power)
            # Written last, since this file marks the part as finished.
            buffer = BytesIO()
            np.save(buffer, part.responses)
            write_atomically(_part_file(folder, start), buffer.getvalue())
            progress.advance(bar, len(part.responses))


def _source(
    request: Request, folder: Path, workers: int | None, ray: str | None, gpu: bool, progress: Progress
) -> Tracer | StoredField:
    """What tells the responses to any position: a tracer of rays, or the stored field of a full-wave simulation."""
    if request.fullwave is not None:
        return field_of(request, folder, workers, ray, gpu, progress)
    from simulate.trace import Tracer  # needs the ray tracer

    search = progress.add_task("finding paths", total=None)
    tracer = Tracer(
        request.scene,
        request.propagation,
        request.region,
        request.seed,
        lambda sentence: progress.update(search, description=f"finding paths, {sentence}"),
    )
    progress.update(search, total=1, completed=1)
    return tracer


class RateColumn(ProgressColumn):
    """Spectra per second."""

    def render(self, task: Task) -> Text:
        return Text(f"{task.speed:.1f}/s" if task.speed else "")


def progress_bar() -> Progress:
    """Progress on stderr: description, bar, count, spectra per second, time remaining."""
    return Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        RateColumn(),
        TimeRemainingColumn(),
        console=plain_console(stderr=True),
    )
