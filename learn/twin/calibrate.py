"""Correction of a scene by the spectra of a dataset, and the report on what was corrected by how much."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Complex, Float, Int

from learn.data.same_receiver import (
    SAME_DIRECTION,
    SAME_PLACE,
    other_array,
    other_frequency,
    pose_difference,
)
from learn.data.splits import SPLITS, SplitKind
from learn.data.splits import split as split_dataset
from learn.models.kriging.retrieved_field import retrieved_responses
from learn.twin.gauss_newton import Calibration, most_likely
from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError, ParameterError, require_instance, require_seed, require_whole, require_word
from scenes.files.plain_text import say
from scenes.scene.description import Scene
from scenes.scene.shapes import bounding_box
from scenes.scene.tolerances import Tolerances
from scenes.scene.unknowns import OF_MATERIALS, Unknown, unknowns
from scenes.storage.scene_writing import write_scene
from scenes.storage.scene_yaml import load_scene
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import given_dataset, require_fixed_array
from simulate.positions.positions import MOST_POSITIONS, reach_warning
from simulate.rays.core.propagation import Propagation
from simulate.spectra.band import Band
from simulate.spectra.element_array import array_of
from simulate.spectra.spectrum import evenly

MOST_TOLERANCES = 10.0
"""Largest difference between the gateways of a scene and of a dataset, in tolerances."""

UNEXPLAINED_MOST = 0.5
"""Share of the measured power that a corrected scene may leave unexplained. Spectra of another room leave nine tenths,
those of the right one in full wave a tenth."""

SUBCARRIERS = 4  # Largest number of subcarriers of a band that are used


def calibrate(
    scene: Scene | Path | str,
    dataset: Dataset | Path | str,
    n: int = 160,
    *,
    split: SplitKind = "files",
    seed: int = 0,
    tolerances: Tolerances = Tolerances(),
    propagation: Propagation = Propagation(),
    report: Callable[[str], None] = lambda sentence: None,
) -> Calibration:
    """Correct a scene by spectra that were measured in it.

    The function corrects the gateway's position and orientation, the properties of materials, and the places of objects
    inside the room. It finds their most likely values given the spectra, by Gauss–Newton steps; ``tolerances`` are the
    standard deviations of normal priors on their errors. The frequency is corrected too if it has a tolerance. Walls,
    floor, ceiling and columns stay where they are.

    Args:
        scene: the scene as described, the name of a built-in one, or a scene YAML.
        dataset: the measured spectra, or their folder. Recorded responses are used if there are any, otherwise those
            found behind the pictures. Of a band, four subcarriers are used together if phases can be compared between
            positions, and otherwise the carrier alone.
        n: largest number of spectra to use, evenly spread over those that the split does not hold out.
        split: which spectra are held out, as for ``train``.
        seed: seed of the split.
        tolerances: how wrong the scene may be.
        propagation: the mechanisms that rays follow.
        report: called with sentences on the progress.

    Returns:
        The corrected scene, the corrections, and their standard deviations. A warning is printed if the corrected scene
        leaves more than half of the measured power unexplained.

    Raises:
        InputError: the scene or the dataset cannot be read; the scene has several gateways, or another array, frequency
            or gateway than the dataset; all tolerances are 0; all spectra have one grey level; or no path reaches any
            of their positions.
        ParameterError: ``n`` or ``seed`` is not a whole number in its range, or diffuse reflection is to be followed.

    Example:
        >>> import bisplat
        >>> coarse = bisplat.Propagation(max_depth=1, diffraction=False, rays=20_000)
        >>> pose = bisplat.Tolerances(objects=0, materials=0)  # only the gateway may be wrong
        >>> found = bisplat.calibrate("lab", "data/lab", 10, tolerances=pose, propagation=coarse)
        >>> found.which[0].label, found.values.shape
        ('gateway x', (6,))
        >>> bool((found.deviations < 0.02).all())  # metres and radians
        True
    """
    place = described_scene(scene, n, split, seed, tolerances, propagation)
    measured = given_dataset(dataset)
    known = evenly(split_dataset(measured, split, seed).known, n)
    warn_of_other_place(place, measured.positions[known], measured.folder)
    found = calibrate_by(place, measured, known, tolerances, propagation, report)
    warning = doubt(found)
    if warning is not None:
        say(f"warning: {warning}")
    return found


def described_scene(
    scene: Scene | Path | str,
    n: int,
    split: SplitKind,
    seed: int,
    tolerances: Tolerances,
    propagation: Propagation,
) -> Scene:
    """The scene to be corrected, after a check of what ``calibrate`` and ``calibrate_powers`` have in common."""
    require_whole(1, MOST_POSITIONS, n=n)
    require_seed(seed=seed)
    require_word(SPLITS, split=split)
    require_instance(Tolerances, tolerances=tolerances)
    require_instance(Propagation, propagation=propagation)
    require_instance(Scene, str, PathLike, scene=scene)
    return scene if isinstance(scene, Scene) else load_scene(scene)


def warn_of_other_place(scene: Scene, positions: Float[np.ndarray, "n 3"], folder: Path) -> None:
    """Print a warning if positions lie so far from a scene that they were hardly measured in it."""
    box = bounding_box(np.vstack([scene.bounds, scene.transmitter.region]))
    warning = reach_warning(positions, box, "the scene", "were they measured there, in its frame?")
    if warning is not None:
        say(f"warning: {folder}: {warning}")


def calibrate_by(
    scene: Scene,
    dataset: Dataset,
    known: Int[np.ndarray, " n"],
    tolerances: Tolerances = Tolerances(),
    propagation: Propagation = Propagation(),
    report: Callable[[str], None] = lambda sentence: None,
) -> Calibration:
    """Correct a scene by some of a dataset's spectra."""
    require_fixed_array(dataset, "the correction of a scene")
    if propagation.diffuse:
        raise ParameterError("diffuse", "expected no diffuse reflection (its phases are random), found some")
    if scene.further_gateways:
        raise InputError(f"{scene.name}: expected a scene with one gateway, found {1 + len(scene.further_gateways)}")
    array = array_of(scene.gateway, scene.frequency)
    if other_frequency(dataset.wavelength, scene.wavelength):
        raise InputError(
            f"{scene.name}: expected a scene of the dataset's wavelength of {dataset.wavelength:.4g} m, "
            f"found {scene.wavelength:.4g} m"
        )
    if other_array(array, dataset.array):
        raise InputError(
            f"{dataset.folder}: expected spectra of the scene's array, {array.in_words}, found those of "
            f"{dataset.array.in_words}"
        )
    which = unknowns(scene, tolerances)
    if not which:
        raise InputError(f"{scene.name}: expected a tolerance above 0, found nothing that may be wrong")
    _require_same_gateway(scene, dataset, tolerances)
    places = dataset.positions[known]
    common = "response" in dataset.values  # otherwise each spectrum may have a clock of its own, too
    if common and dataset.band is not None and dataset.band is not None:
        measured, ratios = over_subcarriers(dataset.band, dataset.band_responses[known], scene.frequency)
        return most_likely(scene, which, propagation, places, measured, True, report, ratios)
    measured, phases_known = measured_responses(dataset, known)
    return most_likely(scene, which, propagation, places, measured, phases_known, report)


def _require_same_gateway(scene: Scene, dataset: Dataset, tolerances: Tolerances) -> None:
    """Refuse a dataset whose gateway is too far from the scene's for the tolerances."""
    gateway = scene.gateway
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


def doubt(calibration: Calibration) -> str | None:
    """A sentence on a corrected scene that does not explain the spectra; None if it does."""
    left, before = calibration.misfit
    if left <= UNEXPLAINED_MOST:
        return None
    return (
        f"{left:.0%} of the measured power is unexplained by the corrected scene ({before:.0%} before), so that its "
        "corrections mean nothing: were the spectra measured in this room, in its frame, and at its frequency?"
    )


def measured_responses(dataset: Dataset, known: Int[np.ndarray, " n"]) -> tuple[Complex[np.ndarray, "n M"], bool]:
    """Responses of some of a dataset's spectra, and whether they share phase and scale."""
    if "response" in dataset.values:
        return dataset.responses[known].astype(complex), True
    return retrieved_responses(dataset, known), False


def over_subcarriers(
    band: Band, responses: Complex[np.ndarray, "n M subcarriers"], carrier: float
) -> tuple[Complex[np.ndarray, "n M*used"], list[float]]:
    """Responses at a few subcarriers, evenly spread over the band, and their frequencies in carrier frequencies.

    A room's responses change little between neighbouring subcarriers, and each that is used costs as much as a carrier.

    >>> responses, ratios = over_subcarriers(Band(20e6, 64), np.ones((5, 16, 64)), 1e9)
    >>> responses.shape, ratios
    ((5, 64), [0.99, 0.9965625, 1.003125, 1.0096875])
    """
    used = evenly(np.arange(band.subcarriers), SUBCARRIERS)
    ratios = (band.frequencies(carrier)[used] / carrier).tolist()
    return np.concatenate(np.moveaxis(responses[..., used].astype(complex), 2, 0), axis=1), ratios


def write_calibration(calibration: Calibration, folder: Path) -> None:
    """Write the corrected scene and calibration.json to a folder."""
    write_scene(calibration.scene, folder)
    content: dict[str, Any] = {
        "changes": changes_of(calibration.which, calibration.values, calibration.deviations),
        "unit": UNIT,
        "unexplained_power": {"described": calibration.misfit[1], "corrected": calibration.misfit[0]},
        "gain": [calibration.gain.real, calibration.gain.imag],
    }
    write_atomically(folder / RECORD, (json.dumps(content, indent=2) + "\n").encode())


RECORD = "calibration.json"

UNIT = "metres, radians, or the logarithm of a ratio"


def in_units(unknown: Unknown, value: float, deviation: float) -> tuple[str, str]:
    """A change and its standard deviation in millimetres, degrees or per cent, for a reader."""
    if unknown.kind in ("position", "object"):
        return f"{1e3 * value:+.1f} mm", f"{1e3 * deviation:.1f} mm"
    if unknown.kind == "rotation":
        return f"{np.degrees(value):+.2f}°", f"{np.degrees(deviation):.2f}°"
    digits = 1 if unknown.kind in OF_MATERIALS else 4
    return f"{100 * np.expm1(value):+.{digits}f} %", f"{100 * deviation:.{digits}f} %"


def rows_of(
    which: Sequence[Unknown], values: Float[np.ndarray, " n"], deviations: Float[np.ndarray, " n"]
) -> list[dict[str, str]]:
    """A table of what was changed and by how much, with standard deviations before and after."""
    rows = []
    for unknown, value, deviation in zip(which, values, deviations, strict=True):
        changed, sure = in_units(unknown, float(value), float(deviation))
        before = in_units(unknown, 0.0, unknown.tolerance)[1]
        rows.append({"what": unknown.label, "changed by": changed, "±": sure, "± before": before})
    return rows


def changes_of(
    which: Sequence[Unknown], values: Float[np.ndarray, " n"], deviations: Float[np.ndarray, " n"]
) -> list[dict[str, Any]]:
    """The entries ``changes`` of calibration.json. The arguments are those of ``rows_of``."""
    return [
        {
            "what": unknown.label,
            "kind": unknown.kind,
            "change": float(value),
            "deviation": float(deviation),
            "tolerance": unknown.tolerance,
        }
        for unknown, value, deviation in zip(which, values, deviations, strict=True)
    ]
