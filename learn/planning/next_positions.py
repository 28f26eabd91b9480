"""Planning of measurements: the positions, in a scene or next to those of a run, that say most about the field."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial
from os import PathLike
from pathlib import Path

import numpy as np
from jaxtyping import Float

from learn.data.expected_score import Expected, Spacing, is_measured, score_curve
from learn.models.base import Report, SpectrumModel
from learn.planning.candidates import CANDIDATES, candidates_among, free_candidates
from learn.planning.greedy import choose
from learn.planning.planned_fields import fields_of_powers, fields_of_run, fields_of_scene
from learn.training.run_folder import Run, load_spectra
from scenes.files.errors import (
    InputError,
    ParameterError,
    named,
    require_instance,
    require_seed,
    require_whole,
    require_within,
)
from scenes.files.input_file import what_is_at
from scenes.places.built_in import BUILT_IN
from scenes.scene.description import Scene
from scenes.storage.scene_yaml import load_scene
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import read_dataset
from simulate.dataset.dataset_kinds import quantity_of
from simulate.dataset.rooms_folder import recorded_scene
from simulate.rays.core.propagation import Propagation
from simulate.spectra.array import Array
from simulate.spectra.element_array import array_of


@dataclass(frozen=True)
class Needed:
    """Spectra that a score needs."""

    more: int  # number of spectra beside the known ones
    spacing: Spacing  # of the known and the further positions together
    expected: Expected  # the score to expect from all of them

    def sentence(self) -> str:
        """The number and what it promises, in words."""
        low, middle, high = self.expected
        return (
            f"{self.more} more spectra, {self.spacing.known} in all, promise a median SSIM of about {middle:.2f} "
            f"({low:.2f} to {high:.2f}) from helmholtz: {self.spacing.sentence()}"
        )


def spectra_needed(
    target: float,
    region: Float[np.ndarray, "N 3"],
    known: Float[np.ndarray, "n 3"],
    wavelength: float,
    arrays: Iterable[Array],
) -> Needed:
    """How many more spectra the median SSIM of ``helmholtz`` needs to reach a target."""
    for array in arrays:
        if not is_measured(array):
            raise ParameterError(
                "target",
                "expected an array of 4 × 4 elements half a wavelength apart, as the curve has it, found "
                f"{array.in_words}",
            )
    whole, before = Spacing.between(region, wavelength), Spacing.between(known, wavelength)
    if whole is None:
        raise ParameterError("target", "expected ten positions or more that are half a wavelength apart, found fewer")
    if "path" in (whole.shape, before and before.shape):
        raise ParameterError("target", "expected positions that fill a region, as the curve has them, found a path")
    curve = score_curve(whole.shape)
    least, most = (float(each) for each in np.round(curve.middle[[0, -1]], 2))
    require_within(least, most, "a median SSIM that the curve of measured rooms has,", target=target)
    total = math.ceil(curve.density_for(target) * whole.size)
    if total <= len(known):
        already = f"{curve.at(len(known) / whole.size).middle:.2f}, which {len(known)} known spectra promise already"
        raise ParameterError("target", f"expected a score above {already}, found {target:g}")
    spacing = Spacing(total, whole.shape, whole.size)
    return Needed(total - len(known), spacing, curve.at(spacing.density))


PLANNED = 50  # Number of positions to plan where nothing else is asked for

PLANNED_MOST = CANDIDATES // 2
"""Largest number of positions to plan: half of the candidates. With more there would be little to choose."""


@dataclass(frozen=True)
class Plan:
    """Positions to measure.

    Attributes:
        positions: [n, 3] metres, world frame. The most useful is first.
        open_variance: [n + 1] mean kriging variance at the candidates, as a share of the field's variance, 0…1: before
            the first position and after each of them, in the order of usefulness. It is 1 where nothing is known.
        needed: how many more spectra the target needs. None: there was no target.

    Example:
        >>> import bisplat
        >>> planned = bisplat.plan("runs/lab", 3)
        >>> planned.positions.shape, planned.open_variance.shape, planned.needed is None
        ((3, 3), (4,), True)
    """

    positions: Float[np.ndarray, "n 3"]
    open_variance: Float[np.ndarray, " n+1"]
    needed: Needed | None = None


def plan(
    run_or_scene: Run | Dataset | Scene | Path | str,
    n: int | None = None,
    *,
    target: float | None = None,
    seed: int = 0,
    propagation: Propagation = Propagation(),
    report: Report = SpectrumModel.report,
) -> Plan:
    """Plan where to measure next: the positions that lower the kriging variance of the field most.

    There are 2000 candidates. One position is chosen after another: always the candidate whose measurement lowers the
    kriging variance, summed over all candidates, most.

    - For a run, the covariance of the field is the fitted one, and the spectra that the run learned from are known. The
      candidates are the free places of the scene's transmitter region, or, for measured spectra, the convex hull of the
      known positions.
    - For received powers (RSSI), the covariance is that of ``helmholtz`` in ``fit_powers``: slow change and fading in
      dB about the law of distance, the same for all gateways up to a factor. All positions of the folder are known, and
      the candidates are as for a run.
    - For a scene, nothing is known. The responses are traced at 300 positions, and the covariance is fitted to them.
      Each gateway of the scene has a separate field, and the variances add up.

    Args:
        run_or_scene: a finished run or its folder; received powers or their folder; or a scene, the name of a built-in
            one, or a scene YAML.
        n: number of positions, 1…1000. None: as many as the target needs, but at most 1000; 50 without a target.
        target: a median SSIM of ``helmholtz`` between the known positions. The plan then tells how many more spectra it
            needs, by the curve of measured rooms, for an array of 4 × 4 elements half a wavelength apart.
        seed: seed of the candidates, and of the traced positions.
        propagation: the mechanisms that the rays follow in a scene.
        report: called with the phase, the number of steps done, and the number of all steps of the phase.

    Returns:
        The positions, and the kriging variance that remains after each of them.

    Raises:
        ParameterError: ``n`` or ``seed`` is not a whole number in its range; the curve does not have the target, or
            does not apply, as to received powers; or the known spectra promise the target already.
        InputError: there is no such run or scene, the run's dataset or scene is missing, or there is no room for the
            candidates.

    Example:
        >>> planned = plan("runs/lab", 5)
        >>> planned.positions.shape, bool(planned.open_variance[-1] < planned.open_variance[0])
        ((5, 3), True)
    """
    if n is not None:
        require_whole(1, PLANNED_MOST, n=n)
    if target is not None:
        require_within(0, 1, "a median SSIM", target=target)
    require_seed(seed=seed)
    require_instance(Propagation, propagation=propagation)
    require_instance(Run, Dataset, Scene, str, PathLike, run_or_scene=run_or_scene)
    subject = run_or_scene if isinstance(run_or_scene, Run | Dataset | Scene) else _read(run_or_scene)
    scene: Scene | None
    arrays: list[Array] = []
    if isinstance(subject, Scene):
        scene, known, wavelength, source = subject, np.zeros((0, 3)), subject.wavelength, subject.name
        arrays = [array_of(each.gateway, each.frequency) for each in scene.by_gateway().values()]
        fields_of = partial(fields_of_scene, subject, propagation, seed, report)
    elif isinstance(subject, Dataset):
        subject.require("power")
        if target is not None:
            raise ParameterError("target", f"expected none for received powers, which have no SSIM, found {target:g}")
        scene, known = recorded_scene(subject.folder, subject.metadata), subject.positions
        wavelength, source = subject.wavelength, str(subject.folder)
        fields_of = partial(fields_of_powers, subject, seed)
    else:
        subject = load_spectra(subject)
        dataset = subject.dataset()
        scene, known = recorded_scene(dataset.folder, dataset.metadata), dataset.positions[subject.split(dataset).known]
        wavelength, source, arrays = dataset.wavelength, str(subject.folder), [dataset.array]
        fields_of = partial(fields_of_run, subject, dataset, report)
    # Without a scene, the places in the hull of the known positions are the region.
    candidates = candidates_among(known, seed, source) if scene is None else free_candidates(scene, seed)
    needed = None
    if target is not None:
        needed = spectra_needed(target, known if scene is None else candidates, known, wavelength, arrays)
    fields = fields_of()
    if n is None:
        n = PLANNED if needed is None else min(needed.more, PLANNED_MOST)
    if n > len(candidates):
        raise InputError(f"expected at least {n} places to choose from, found {len(candidates)}")
    open_fields = []
    for number, field in enumerate(fields):
        report("covariances", number, len(fields))
        open_fields.append(field.open_at(candidates, known))
    chosen, left = choose(open_fields, n, lambda done, total: report("positions", done, total))
    positions = candidates[chosen].round(6)  # as a CSV has them
    return Plan(positions, left / sum(field.weight for field in fields), needed)


def _read(run_or_scene: Path | str) -> Run | Dataset | Scene:
    """The run or the received powers of a folder, or the scene of a name or a file."""
    path = Path(run_or_scene)
    if path.is_dir():
        return read_dataset(path) if quantity_of(path) == "power" else load_spectra(path)
    if str(run_or_scene) not in BUILT_IN and not path.is_file():
        places = ", ".join(BUILT_IN)
        raise InputError(
            f"{named(run_or_scene)}: expected a run folder, a scene YAML or one of {places}, found {what_is_at(path)}"
        )
    return load_scene(run_or_scene)
