"""Correction of a scene by what was measured in it: spectra, or received powers (RSSI)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Complex, Int

from learn.data.same_receiver import SAME_DIRECTION, SAME_PLACE, other_array, pose_difference
from learn.data.splits import SPLITS, SplitKind
from learn.data.splits import split as split_dataset
from learn.models.kriging.retrieved_field import retrieved_responses
from learn.twin.calibration import Calibration
from learn.twin.described_gateways import require_same_wavelength, scenes_with_gateways
from learn.twin.gauss_newton import Search
from learn.twin.linearised import CARRIER
from learn.twin.power_residual import PowerResidual, independence, path_powers
from learn.twin.response_residual import ResponseFit, ResponseResidual
from learn.twin.starting_values import is_far
from scenes.files.errors import InputError, ParameterError, require_instance, require_seed, require_whole, require_word
from scenes.files.long_work import doing
from scenes.files.options import taken, takes
from scenes.files.plain_text import say
from scenes.scene.description import Scene
from scenes.scene.shapes import bounding_box
from scenes.scene.tolerances import Tolerances
from scenes.scene.unknowns import Unknown, unknowns, vary
from scenes.storage.scene_yaml import load_scene
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import given_dataset, require_fixed_array
from simulate.positions.positions import MOST_POSITIONS, reach_warning
from simulate.rays.core.propagation import Propagation
from simulate.rays.tracer import Tracer
from simulate.spectra.band import Band
from simulate.spectra.element_array import array_of
from simulate.spectra.spectrum import evenly

CALIBRATED_BY = 160
"""Largest number of known positions that correct the scene if nothing else is asked for."""

MOST_TOLERANCES = 10.0
"""Largest difference between the gateways of a scene and of a dataset, in tolerances."""

UNEXPLAINED_MOST = 0.5
"""Share of the measured power that a corrected scene may leave unexplained. Spectra of another room leave nine tenths,
those of the right one in full wave a tenth."""

SUBCARRIERS = 4  # Largest number of subcarriers of a band that are used

NO_PATHS = 1e-30  # Smallest sum of the powers of paths; less stands for no path

Report = Callable[[str], None]


@takes(Tolerances)
def calibrate(
    scene: Scene | Path | str,
    dataset: Dataset | Path | str,
    n: int = CALIBRATED_BY,
    *,
    split: SplitKind = "files",
    seed: int = 0,
    propagation: Propagation = Propagation(),
    report: Report = lambda sentence: None,
    **tolerances: Any,
) -> Calibration:
    """Correct a scene by spectra or received powers (RSSI) that were measured in it.

    The function corrects the gateway's position and orientation, the properties of materials, and the places of objects
    inside the room. It finds their most likely values given the measurements, by Gauss–Newton steps; the tolerances are
    the standard deviations of normal priors on their errors. Walls, floor, ceiling and columns stay where they are.

    - By spectra, the frequency is corrected too if it has a tolerance.
    - By received powers, the positions of all their gateways are corrected, and the level of each is found. What was
      not received is a bound. The powers are taken to follow a Rice distribution about the traced ones, whose random
      part stands for all that the description lacks.

    Args:
        scene: the scene as described, the name of a built-in one, or a scene YAML. For received powers, its own
            gateways are left out.
        dataset: measured spectra, or received powers with the gateways' places as described, or their folder. Recorded
            responses are used if there are any, otherwise those found behind the pictures. Of a band, four subcarriers
            are used together if phases can be compared between positions, and otherwise the carrier alone.
        n: largest number of positions to use, evenly spread over those that the split does not hold out.
        split: which positions are held out, as for ``train``.
        seed: seed of the split.
        propagation: the mechanisms that rays follow.
        report: called with sentences on the progress.
        **tolerances: how wrong the description may be, as standard deviations. Received powers do not use ``rotation``,
            since one antenna has no orientation to be found by powers.

    Returns:
        The corrected scene and gateways, the corrections, and their standard deviations. A warning is printed if the
        corrected scene leaves more than half of the measured power of spectra unexplained.

    Raises:
        InputError: the scene or the dataset cannot be read; the scene has another frequency than the dataset; the
            scene has several gateways, or another array or gateway than the spectra; all tolerances are 0; a gateway is
            inside an object; all spectra have one grey level; nothing was received; or no path reaches any of the
            positions.
        ParameterError: ``n`` or ``seed`` is not a whole number in its range, diffuse reflection is to be followed, or
            the carrier has a tolerance for received powers.

    Example:
        >>> import bisplat
        >>> coarse = bisplat.Propagation(max_depth=1, diffraction=False, rays=20_000)
        >>> pose = {"objects": 0, "materials": 0}  # only the gateway may be wrong
        >>> found = bisplat.calibrate("lab", "data/lab", 10, propagation=coarse, **pose)
        >>> found.which[0].label, found.values.shape
        ('gateway x', (6,))
        >>> bool((found.deviations < 0.02).all())  # metres and radians
        True

        By the powers that two gateways receive, one of which is described to be 3 cm beside its place:

        >>> gateways = {"door": (2.0, 0.5, 1.8), "window": (2.5, 0.5, 1.8)}
        >>> heard = bisplat.simulate_rssi("closet", "heard", gateways, n=30, propagation=coarse)
        >>> moved = {"door": (2.03, 0.5, 1.8), "window": (2.5, 0.47, 1.8)}
        >>> given = {"powers": heard.powers, "gateways": moved, "frequency": heard.frequency.hertz}
        >>> described = bisplat.write_dataset("described", heard.positions, **given)
        >>> found = bisplat.calibrate("closet", described, split="random", propagation=coarse, **pose)
        >>> found.misfit[0] < found.misfit[1]
        True
        >>> found.which[0].label, found.values.shape
        ('gateway door x', (6,))
    """
    require_whole(1, MOST_POSITIONS, n=n)
    require_seed(seed=seed)
    require_word(SPLITS, split=split)
    (allowed,) = taken(tolerances, Tolerances)
    require_instance(Propagation, propagation=propagation)
    require_instance(Scene, str, PathLike, scene=scene)
    place = scene if isinstance(scene, Scene) else load_scene(scene)
    measured = given_dataset(dataset, "spectrum", "power")
    known = evenly(split_dataset(measured, split, seed).known, n)
    box = bounding_box(np.vstack([place.bounds, place.transmitter.region]))
    warning = reach_warning(measured.positions[known], box, "the scene", "were they measured there, in its frame?")
    if warning is not None:
        say(f"warning: {measured.folder}: {warning}")
    found = correct(place, measured, known, allowed, propagation, report)
    left, before = found.misfit
    if isinstance(found.fit, ResponseFit) and left > UNEXPLAINED_MOST:
        say(
            f"warning: {left:.0%} of the measured power is unexplained by the corrected scene ({before:.0%} before), "
            "so that its corrections mean nothing: were the spectra measured in this room, in its frame, and at its "
            "frequency?"
        )
    return found


def correct(
    scene: Scene,
    dataset: Dataset,
    known: Int[np.ndarray, " n"],
    tolerances: Tolerances = Tolerances(),
    propagation: Propagation = Propagation(),
    report: Report = lambda sentence: None,
) -> Calibration:
    """Correct a scene by some of a dataset's positions; ``calibrate`` explains the arguments."""
    if propagation.diffuse:
        raise ParameterError("diffuse", "expected no diffuse reflection (its phases are random), found some")
    doing(f"{scene.name}: correcting it by what was measured at {len(known):,} positions, in rounds")
    by = _by_powers if "power" in dataset.values else _by_spectra
    search = by(scene, dataset, known, tolerances, propagation, report)
    band = search.over_band(search.tracers.values())
    described = np.concatenate([each.responses(search.positions).astype(complex) for _, each in band], axis=1)
    if not (np.abs(described) ** 2 > NO_PATHS).any():
        raise InputError(f"{scene.name}: expected paths from its gateways to the measured positions, found none")
    before = search.stages[-1].fit(described).misfit
    found = search.most_likely()
    of_scene = np.where(search.own(""), found.values, 0)  # without the gateways of received powers
    return Calibration(
        scene=vary(scene, search.which, of_scene),
        gateways={name: each.scene.gateway for name, each in zip(search.tracers, found.tracers, strict=True) if name},
        which=search.which,
        values=found.values,
        deviations=found.deviations,
        misfit=(found.fit.misfit, before),
        fit=found.fit,
        propagation=propagation,
    )


def _by_powers(
    scene: Scene,
    dataset: Dataset,
    known: Int[np.ndarray, " n"],
    tolerances: Tolerances,
    propagation: Propagation,
    report: Report,
) -> Search:
    if tolerances.carrier:
        raise ParameterError("carrier", f"expected 0, since powers do not tell it, found {tolerances.carrier:g}")
    if dataset.frequency.source == "assumed":
        say(f"{dataset.folder}: no frequency is stated, so the scene's, {scene.frequency / 1e6:g} MHz, is assumed")
    scenes, which = scenes_with_gateways(scene, dataset), of_gateways(scene, dataset.gateway_names, tolerances)
    _require_some(which, scene)
    positions, powers = dataset.positions[known], dataset.powers[known]
    if np.isnan(powers).all():
        raise InputError(f"{dataset.folder}: expected received powers at the known positions, found none")
    box = bounding_box(positions)
    tracers = {name: Tracer(each, propagation, box, report=report) for name, each in scenes.items()}
    scales, weights = path_powers(tracers.values(), positions)[1], independence(positions, scene.wavelength)
    stages = [PowerResidual(powers, dataset.floor_dbm, scales, weights)]
    return Search(tracers, which, positions, stages, report)


def of_gateways(scene: Scene, names: Sequence[str], tolerances: Tolerances) -> list[Unknown]:
    """The unknowns of a scene whose powers several gateways receive: the places of the gateways, and of the scene."""
    found = [Unknown("position", name, axis, tolerances.position) for name in names for axis in range(3)]
    found += unknowns(scene, replace(tolerances, position=0.0, rotation=0.0, carrier=0.0))
    return [each for each in found if each.tolerance > 0]


def _require_some(which: list[Unknown], scene: Scene) -> None:
    if not which:
        raise InputError(f"{scene.name}: expected a tolerance above 0, found nothing that may be wrong")


def _by_spectra(
    scene: Scene,
    dataset: Dataset,
    known: Int[np.ndarray, " n"],
    tolerances: Tolerances,
    propagation: Propagation,
    report: Report,
) -> Search:
    which = unknowns(scene, tolerances)
    _require_some(which, scene)
    _require_same_receiver(scene, dataset, tolerances)
    measured, phases_known = measured_responses(dataset, known)
    positions = dataset.positions[known]
    ratios: Sequence[float] = CARRIER
    # Without recorded responses each spectrum may have a clock of its own, so that the band tells no more.
    if phases_known and dataset.band is not None:
        measured, ratios = over_subcarriers(dataset.band, dataset.band_responses[known], scene.frequency)
    if not measured.any():
        raise InputError(f"{scene.name}: expected spectra of several grey levels, found none")
    # Only responses behind pictures may be flipped, even while others are compared in phases of their own.
    flips = not phases_known and scene.gateway.elements is None  # elements at given places have no such symmetry
    stages = ResponseResidual.stages(measured, positions, scene.wavelength, phases_known, flips)
    tracers = {"": Tracer(scene, propagation, bounding_box(positions), report=report)}
    return Search(tracers, which, positions, stages, report, ratios, far=is_far(scene, which))


def _require_same_receiver(scene: Scene, dataset: Dataset, tolerances: Tolerances) -> None:
    """Refuse spectra of another array or frequency, or whose gateway is too far from the scene's for the tolerances."""
    require_fixed_array(dataset, "the correction of a scene")
    if scene.further_gateways:
        raise InputError(f"{scene.name}: expected a scene with one gateway, found {1 + len(scene.further_gateways)}")
    require_same_wavelength(scene, dataset)
    gateway, array = scene.gateway, array_of(scene.gateway, scene.frequency)
    if other_array(array, dataset.array):
        raise InputError(
            f"{dataset.folder}: expected spectra of the scene's array, {array.in_words}, found those of "
            f"{dataset.array.in_words}"
        )
    distance, angle = pose_difference(
        (gateway.position, gateway.orientation), (dataset.gateway_position, dataset.gateway_orientation)
    )
    farthest = max(MOST_TOLERANCES * tolerances.position, SAME_PLACE * scene.wavelength)
    widest = max(MOST_TOLERANCES * tolerances.rotation, SAME_DIRECTION)
    if distance > farthest or angle > widest:
        raise InputError(
            f"{dataset.folder / 'gateway_info.yml'}: expected the gateway of {scene.name}, at "
            f"{np.round(gateway.position, 3).tolist()}, within {farthest:.2g} m and {widest:.2g}° ({MOST_TOLERANCES:g} "
            f"tolerances), found one {distance:.3g} m away and turned by {angle:.3g}°"
        )


def measured_responses(dataset: Dataset, known: Int[np.ndarray, " n"]) -> tuple[Complex[np.ndarray, "n M"], bool]:
    """Responses of some of a dataset's spectra, and whether they share phase and scale."""
    if "response" in dataset.values:
        return dataset.responses[known].astype(complex), True
    return retrieved_responses(dataset, known), False


def over_subcarriers(
    band: Band, responses: Complex[np.ndarray, "n M subcarriers"], carrier: float
) -> tuple[Complex[np.ndarray, "n M*used"], Sequence[float]]:
    """Responses at a few subcarriers, evenly spread over the band, and their frequencies in carrier frequencies.

    A room's responses change little between neighbouring subcarriers, and each that is used costs as much as a carrier.

    >>> responses, ratios = over_subcarriers(Band(20e6, 64), np.ones((5, 16, 64)), 1e9)
    >>> responses.shape, ratios
    ((5, 64), [0.99, 0.9965625, 1.003125, 1.0096875])
    """
    used = evenly(np.arange(band.subcarriers), SUBCARRIERS)
    ratios = (band.frequencies(carrier)[used] / carrier).tolist()
    return np.concatenate(np.moveaxis(responses[..., used].astype(complex), 2, 0), axis=1), ratios
