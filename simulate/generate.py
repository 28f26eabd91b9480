"""Simulate a dataset: positions -> traced responses -> spectra -> a NeRF² folder, interruptible at any moment.

A run first writes ``metadata.json``, which says exactly what is being made, then works through the positions in
parts. Each finished part leaves its pictures and, as ``parts/NNNNN.npy``, its responses. The same command again finds
the metadata equal, skips the finished parts and ends with the same bytes. The index files come last: a folder without
them is not finished, and no loader takes it for a dataset.
"""

from __future__ import annotations

import hashlib
import json
import shutil
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from importlib.metadata import version
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from rich.console import Console
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
from scenes.description import Scene
from scenes.errors import InputError
from scenes.scene_yaml import write_scene
from simulate.dataset import (
    write_channels,
    write_gateway,
    write_index,
    write_metadata,
    write_picture,
    write_positions,
)
from simulate.propagation import Propagation
from simulate.spectrum import PlanarArray, picture

PART = 100
"""Positions per part: what a killed run loses at most."""

TEST_FRACTION = 0.2


@dataclass(frozen=True)
class Request:
    """What to simulate.

    Attributes:
        scene: the place.
        positions: transmitter positions, metres, world frame.
        placement: how they were chosen, for the record: a placement's name and seed, or a CSV.
        propagation: what the ray tracer follows.
        seed: draws the 80/20 split of the index files.
    """

    scene: Scene
    positions: Float[np.ndarray, "K 3"]
    placement: str
    propagation: Propagation
    seed: int

    def metadata(self) -> dict[str, Any]:
        """Everything the folder's content depends on."""
        gateway = self.scene.gateway
        return {
            "made_by": f"bisplat-wrf {version('bisplat-wrf')}",
            "scene": self.scene.name,
            "scene_file": "scene/scene.yaml",
            "scene_sha256": _scene_digest(self.scene),
            "frequency_hz": self.scene.frequency,
            "array": {"rows": gateway.rows, "columns": gateway.columns, "spacing": gateway.spacing},
            "spectra": len(self.positions),
            "placement": self.placement,
            "positions_sha256": hashlib.sha256(self.positions.round(6).tobytes()).hexdigest(),
            "propagation": asdict(self.propagation),
            "method": "chains" if self.propagation.chains_suffice else "shooting",
            "seed": self.seed,
            "picture": "magnitude, min-max normalised per spectrum, 8 bit, row 0 = 1 degree elevation",
            "versions": {name: version(name) for name in ("sionna-rt", "mitsuba", "drjit", "numpy")},
        }


def _scene_digest(scene: Scene) -> str:
    """Fingerprint of everything a scene holds, meshes included."""
    digest = hashlib.sha256()
    for item in scene.objects:
        digest.update(f"{item.name} {scene.materials[item.material]} {item.thickness}".encode())
        digest.update(np.ascontiguousarray(item.mesh.vertices).tobytes())
        digest.update(np.ascontiguousarray(item.mesh.faces).tobytes())
    digest.update(f"{scene.frequency} {scene.gateway} {scene.transmitter}".encode())
    return digest.hexdigest()


def generate(request: Request, folder: Path) -> None:
    """Simulate a dataset into a folder, or finish one that the same request began.

    Raises:
        InputError: the folder holds something else, or a dataset of another request.
    """
    metadata = request.metadata()
    begun = _begun(folder, metadata)
    if begun and (folder / "test_index.txt").exists():
        shutil.rmtree(folder / "parts", ignore_errors=True)  # of a run killed while it tidied up
        return
    import simulate.ray_tracer  # noqa: F401  one that cannot be used is refused before anything is written

    if not begun:
        folder.mkdir(parents=True, exist_ok=True)
        write_metadata(folder / "metadata.json", metadata)
    (folder / "spectrum").mkdir(exist_ok=True)
    (folder / "parts").mkdir(exist_ok=True)
    if not (folder / "scene").exists():
        shutil.rmtree(folder / "scene.tmp", ignore_errors=True)
        write_scene(request.scene, folder / "scene.tmp")
        (folder / "scene.tmp").rename(folder / "scene")
    positions = request.positions.round(6)  # what tx_pos.csv will say
    names = picture_names(len(positions))
    _trace_parts(request, positions, names, folder)

    channels = np.concatenate([np.load(path) for path in _parts(folder, len(positions))])
    scene = request.scene
    write_channels(folder / "channels.npz", channels)
    write_positions(folder / "tx_pos.csv", positions)
    write_gateway(folder / "gateway_info.yml", scene.name, scene.gateway.position, scene.gateway.orientation)
    order = np.random.default_rng(request.seed).permutation(len(names))
    held_out = max(1, round(TEST_FRACTION * len(names)))
    write_index(folder / "train_index.txt", [names[i] for i in sorted(order[held_out:])])
    write_index(folder / "test_index.txt", [names[i] for i in sorted(order[:held_out])])
    shutil.rmtree(folder / "parts")


def picture_names(count: int) -> list[str]:
    """Zero-padded names from 1: five digits, more if needed."""
    digits = max(5, len(str(count)))
    return [f"{number:0{digits}d}" for number in range(1, count + 1)]


def _begun(folder: Path, metadata: dict[str, Any]) -> bool:
    """Whether the folder holds the beginnings of this very request; False: it is new or empty."""
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
    # As JSON, so that numbers compare as they were written.
    wanted = json.loads(json.dumps(metadata))
    for key in wanted:
        if found.get(key) != wanted[key]:
            raise InputError(
                f"{folder}: expected a new folder or one this command began, found a dataset whose {key} is "
                f"{found.get(key)}, not {wanted[key]}"
            )
    return True


def _parts(folder: Path, count: int) -> list[Path]:
    return [folder / "parts" / f"{start:08d}.npy" for start in range(0, count, PART)]


def _trace_parts(request: Request, positions: Float[np.ndarray, "K 3"], names: list[str], folder: Path) -> None:
    todo = [path for path in _parts(folder, len(positions)) if not path.exists()]
    if not todo:
        return
    from simulate.trace import Tracer  # needs the ray tracer

    region = np.array([request.scene.transmitter.region_min, request.scene.transmitter.region_max])
    region = np.array([np.minimum(region[0], positions.min(0)), np.maximum(region[1], positions.max(0))])
    gateway = request.scene.gateway
    array = PlanarArray(gateway.rows, gateway.columns, gateway.spacing)
    with progress_bar() as progress, ThreadPoolExecutor() as writers:
        search = progress.add_task("finding paths", total=None)
        tracer = Tracer(
            request.scene,
            request.propagation,
            region,
            lambda sentence: progress.update(search, description=f"finding paths, {sentence}"),
        )
        progress.update(search, total=1, completed=1)
        done = len(positions) - sum(min(PART, len(positions) - int(path.stem)) for path in todo)
        bar = progress.add_task("spectra", total=len(positions), completed=done)
        for path in todo:
            start = int(path.stem)
            channels = tracer.responses(positions[start : start + PART])
            paths = [folder / "spectrum" / f"{name}.png" for name in names[start : start + PART]]
            list(writers.map(write_picture, paths, picture(array.spectrum(channels))))
            buffer = BytesIO()
            np.save(buffer, channels)
            write_atomically(path, buffer.getvalue())
            progress.advance(bar, len(channels))


class RateColumn(ProgressColumn):
    """Spectra per second."""

    def render(self, task: Task) -> Text:
        return Text(f"{task.speed:.1f}/s" if task.speed else "")


def progress_bar() -> Progress:
    """Progress on stderr: what, how far, how fast, how long still."""
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        RateColumn(),
        TimeRemainingColumn(),
        console=Console(stderr=True),
    )
