"""Plan measurements: the positions in a scene, or beside those of a run, that say most about the field."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from learn.models.base import Report, SpectrumModel
from learn.planning.candidates import CANDIDATES, candidates_among, free_candidates
from learn.planning.greedy import choose
from learn.planning.planned_fields import fields_of_run, fields_of_scene
from learn.planning.tour import Tour, short_tour
from learn.training.run_folder import Run, load_run
from scenes.files.errors import InputError, named, require_seed, require_whole
from scenes.scene.description import Scene
from scenes.storage.scene_yaml import BUILT_IN, load_scene
from simulate.dataset.dataset_folder import Dataset
from simulate.dataset.picture_files import what_is_at
from simulate.rays.core.propagation import Propagation

PLANNED_MOST = CANDIDATES // 2
"""Largest number of positions to plan; among more of the candidates there would be little to choose."""


@dataclass(frozen=True)
class Plan:
    """Positions to measure.

    Attributes:
        positions: metres, world frame: the most useful first, or in the order of the tour.
        open_variance: share of the field's variance that is open before, and after each of the positions in the order
            of their usefulness: the mean kriging variance at the candidates, 1 where nothing is known.
        tour: the walk; None: none was asked for.
    """

    positions: Float[np.ndarray, "n 3"]
    open_variance: Float[np.ndarray, " n+1"]
    tour: Tour | None


def plan(
    run_or_scene: Run | Scene | Path | str,
    n: int = 50,
    *,
    tour: bool = False,
    seed: int = 0,
    propagation: Propagation = Propagation(),
    report: Report = SpectrumModel.report,
) -> Plan:
    """Where to measure next: the positions that lower the open variance of the field most.

    Each position is the one of ``CANDIDATES`` whose measurement lowers the kriging variance, summed over all of them,
    most. The covariance of a run is the fitted one, and what the run knows is known. A scene is traced at some
    positions to fit the covariance of each gateway's field; nothing is known there.

    Args:
        run_or_scene: a finished run or its folder; or a scene, a built-in one's name, or a scene YAML. A run on
            simulated spectra has candidates in the free places of its scene's transmitter region, and one on measured
            spectra in the convex hull of the known positions.
        n: number of positions, at most ``PLANNED_MOST``.
        tour: order the positions as a short walk instead of by their usefulness.
        seed: of the candidates, and of the traced positions.
        propagation: the mechanisms that rays follow in a scene.
        report: called with what is being done, and how many of how many steps of it are done.

    Raises:
        ParameterError: a number or a seed that is none, or is out of range.
        InputError: no such run or scene, the run's dataset or scene is not there, or there is no room for candidates.

    >>> planned = plan("runs/lab", 5, tour=True)
    >>> planned.positions.shape, bool(planned.open_variance[-1] < planned.open_variance[0])
    ((5, 3), True)
    """
    require_whole(1, PLANNED_MOST, n=n)
    require_seed(seed=seed)
    subject = run_or_scene if isinstance(run_or_scene, Run | Scene) else _read(run_or_scene)
    scene: Scene | None
    if isinstance(subject, Scene):
        scene, known = subject, np.zeros((0, 3))
        of_gateways = [fields_of_scene(each, propagation, seed, report) for each in scene.by_gateway().values()]
        fields = [field for of_one in of_gateways for field in of_one]
        candidates = free_candidates(scene, seed)
    else:
        dataset = subject.dataset()
        scene, known = _scene_of(dataset), dataset.positions[subject.split(dataset).known]
        if scene is not None:
            candidates = free_candidates(scene, seed)
        else:
            candidates = candidates_among(known, seed, str(subject.folder))
        fields = fields_of_run(subject, dataset, report)
    if n > len(candidates):
        raise InputError(f"expected room for {n} positions, found {len(candidates)} places")
    open_fields = []
    for number, field in enumerate(fields):
        report("covariances", number, len(fields))
        open_fields.append(field.open_at(candidates, known))
    chosen, left = choose(open_fields, n, lambda done, total: report("positions", done, total))
    positions = candidates[chosen].round(6)  # as a CSV has them
    left = left / sum(field.weight for field in fields)
    if not tour:
        return Plan(positions, left, None)
    walk = short_tour(positions, scene, lambda done, total: report("tour", done, total))
    return Plan(positions[walk.order], left, walk)


def _read(run_or_scene: Path | str) -> Run | Scene:
    """The run of a folder, or the scene of a name or a file."""
    path = Path(run_or_scene)
    if path.is_dir():
        return load_run(path)
    if str(run_or_scene) not in BUILT_IN and not path.is_file():
        places = ", ".join(BUILT_IN)
        raise InputError(
            f"{named(run_or_scene)}: expected a run folder, a scene YAML or one of {places}, found {what_is_at(path)}"
        )
    return load_scene(run_or_scene)


def _scene_of(dataset: Dataset) -> Scene | None:
    """The scene that a dataset was simulated in; None: it was measured."""
    if "scene_file" not in dataset.metadata:
        return None
    return load_scene(dataset.folder / dataset.metadata["scene_file"])
