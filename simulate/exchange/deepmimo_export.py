"""Export of a simulated dataset's paths as a scenario folder of DeepMIMO 4. The documentation describes its content."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Float

from scenes.files.errors import InputError, shown
from scenes.files.output_folder import new_folder
from scenes.files.progress import progress_bar
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_kinds import require_spectra
from simulate.dataset.metadata import read_metadata
from simulate.engines.rays_engine import Rays
from simulate.exchange.deepmimo_scenario import (
    MOST_INTERACTIONS,
    PathList,
    path_list,
    sorted_paths,
    write_matrices,
    write_params,
)
from simulate.generation.request import Request, read_request

AT_ONCE = 100  # Positions traced at a time

NOT_IN_NAMES = "/\\:*?\"'<>|\n"
"""DeepMIMO loads no scenario whose name contains one of these characters."""


def export_deepmimo(dataset: Dataset | Path | str, folder: Path, force: bool = False) -> None:
    """Trace the paths of a simulated dataset again, and write them as ``export`` explains it."""
    _check_name(folder)
    with new_folder(folder, force) as unfinished:
        request, rays = _request(dataset.folder if isinstance(dataset, Dataset) else Path(dataset))
        element, paths = _traced(request, rays)
        write_matrices(unfinished, paths, element, request.positions)
        write_params(unfinished, request, rays, len(np.unique(paths.receivers)))


def _check_name(folder: Path) -> None:
    name = folder.absolute().name
    if name != name.lower() or set(name) & set(NOT_IN_NAMES):
        raise InputError(
            f"{folder}: expected a lower-case name without : * ? \" ' < > | and \\, as DeepMIMO requires, found "
            f"{shown(name)}"
        )


def _request(source: Path) -> tuple[Request, Rays]:
    require_spectra(source)
    path = source / "metadata.json"
    if "scene_file" not in read_metadata(path):
        raise InputError(
            f"{source}: expected a simulated dataset, since its paths are traced in its scene, found one without a "
            "scene; a measured dataset has none"
        )
    request = read_request(source)
    if not isinstance(request.engine, Rays):
        raise InputError(
            f"{path}: expected a dataset simulated by rays, found one of the engine {request.engine.name}, which knows "
            "no paths"
        )
    if request.moving != "transmitter" or request.frequencies:
        ends = {"receiver": "whose receiver moves", "both": "of which both ends move"}
        found = ends.get(request.moving, "of several frequencies")
        raise InputError(f"{path}: expected a dataset of a moving transmitter at one frequency, found one {found}")
    depth = request.engine.propagation.max_depth
    if depth > MOST_INTERACTIONS:
        raise InputError(
            f"{path}: expected propagation.max_depth of at most {MOST_INTERACTIONS}, the most interactions that "
            f"DeepMIMO records for a path, found {depth}"
        )
    return request, request.engine


def _traced(request: Request, rays: Rays) -> tuple[Float[np.ndarray, " 3"], PathList]:
    """Position of the element, metres, world frame, and its paths to all positions."""
    positions, found = request.positions, []
    with progress_bar() as progress:
        tracer = rays.tracer(request.setting, progress)
        bar = progress.add_task("positions", total=len(positions))
        for start in range(0, len(positions), AT_ONCE):
            part = positions[start : start + AT_ONCE]
            for terms in tracer.middle_multipath(part):
                found.append(path_list(terms._replace(targets=terms.targets + start)))
            progress.advance(bar, len(part))
    return tracer.middle.positions[0], sorted_paths(found)
