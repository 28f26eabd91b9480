"""Correction of a scene, and of the places of gateways with one antenna, by received powers (RSSI)."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from jaxtyping import Float, Int

from learn.data.splits import SplitKind
from learn.data.splits import split as split_positions
from learn.twin.calibrate import RECORD, UNIT, changes_of, described_scene, warn_of_other_place
from learn.twin.described_gateways import alone, scenes_with_gateways
from learn.twin.power_likelihood import PowerFit, PowerLikelihood
from learn.twin.power_search import PowerMinimum, PowerSearch, independence
from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError, ParameterError, require_instance
from scenes.files.json_yaml_xml import PlainDumper
from scenes.files.long_work import doing
from scenes.files.plain_text import say
from scenes.scene.antennas import Gateway
from scenes.scene.description import Scene
from scenes.scene.shapes import bounding_box
from scenes.scene.tolerances import Tolerances
from scenes.scene.unknowns import Unknown, unknowns, vary
from scenes.storage.scene_writing import write_scene
from simulate.positions.positions import check_points
from simulate.rays.core.propagation import Propagation
from simulate.rays.tracer import Tracer
from simulate.rssi.rssi_dataset import RssiDataset, read_rssi
from simulate.spectra.spectrum import evenly

GATEWAYS = "gateways.yml"

NO_PATHS = 1e-30  # Smallest sum of the powers of paths; less stands for no path


@dataclass(frozen=True)
class PowerCalibration:
    """A scene and gateways that were corrected by received powers, and how certain the n corrections are.

    Attributes:
        scene: the corrected scene. Its own gateways are those of the description.
        gateways: the G gateways that received the powers, at their corrected places, by name.
        which: what may have been wrong: n numbers, each with a ``label`` for a reader and its ``tolerance``.
        values: [n] the corrections: metres, or the logarithm of a ratio.
        deviations: [n] their standard deviations after the powers were seen, in the same units.
        error: median absolute error of the powers in the corrected scene, dB, and the same as described.
        fit: the powers beside those of the corrected scene.
        propagation: the mechanisms that rays followed.
    """

    scene: Scene
    gateways: dict[str, Gateway]
    which: list[Unknown]
    values: Float[np.ndarray, " n"]
    deviations: Float[np.ndarray, " n"]
    error: tuple[float, float]
    fit: PowerFit = field(repr=False)
    propagation: Propagation = Propagation()

    @property
    def levels(self) -> Float[np.ndarray, " G"]:
        """What is added to traced path gains, dBm: transmit power and gains that the scene does not state, [G]."""
        return self.fit.levels

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, "K G"]:
        """Predict received powers by rays in the corrected scene.

        A deep fade of the traced field is not as deep here, since what the scene lacks fills it.

        Args:
            positions: transmitter positions, metres, world frame, [K, 3].

        Returns:
            Expected powers, dBm, [K, G].

        Raises:
            ParameterError: the positions are not finite points.
        """
        return self.fit.predicted(*traced_powers(self.scene, self.gateways, check_points(positions), self.propagation))


def calibrate_powers(
    scene: Scene | Path | str,
    dataset: RssiDataset | Path | str,
    n: int = 160,
    *,
    split: SplitKind = "files",
    seed: int = 0,
    tolerances: Tolerances = Tolerances(),
    propagation: Propagation = Propagation(),
    report: Callable[[str], None] = lambda sentence: None,
) -> PowerCalibration:
    """Correct a scene by received powers (RSSI) that were measured in it.

    The function corrects the places of the gateways, the properties of materials, and the places of objects inside the
    room, as ``calibrate`` does by spectra. The level of each gateway is unknown and found, too. What was not received
    is a bound. The powers of a described scene are taken to follow a Rice distribution about the traced ones, whose
    random part stands for all that the description lacks.

    Args:
        scene: the scene as described, the name of a built-in one, or a scene YAML. Its own gateways are left out.
        dataset: received powers, or their folder, with the gateways' places as described.
        n: largest number of positions to use, evenly spread over those that the split does not hold out.
        split: which positions are held out, as for ``compare_powers``.
        seed: seed of the split.
        tolerances: how wrong the description may be. ``rotation`` is not used, since one antenna has no orientation to
            be found by powers.
        propagation: the mechanisms that rays follow.
        report: called with sentences on the progress.

    Returns:
        The corrected scene and gateways, the corrections, and their standard deviations.

    Raises:
        InputError: the scene or the dataset cannot be read; they have other frequencies; all tolerances are 0; a
            gateway is inside an object; nothing was received; or no path reaches any of the positions.
        ParameterError: ``n`` or ``seed`` is not a whole number in its range, diffuse reflection is to be followed, or
            the carrier has a tolerance.

    Example:
        >>> import bisplat
        >>> gateways = {"door": (2.0, 0.5, 1.8), "window": (2.5, 0.5, 1.8)}
        >>> coarse = bisplat.Propagation(max_depth=1, diffraction=False, rays=20_000)
        >>> heard = bisplat.simulate_rssi("closet", "heard", gateways, n=30, propagation=coarse)
        >>> moved = {"door": (2.03, 0.5, 1.8), "window": (2.5, 0.47, 1.8)}
        >>> described = bisplat.write_rssi("described", heard.positions, heard.rssi_dbm, moved, heard.frequency.hertz)
        >>> only = bisplat.Tolerances(objects=0, materials=0)
        >>> found = bisplat.calibrate_powers("closet", described, tolerances=only, split="random", propagation=coarse)
        >>> found.error[0] < found.error[1]
        True
        >>> found.which[0].label, found.values.shape
        ('gateway door x', (6,))
    """
    require_instance(RssiDataset, str, PathLike, dataset=dataset)
    place = described_scene(scene, n, split, seed, tolerances, propagation)
    heard = dataset if isinstance(dataset, RssiDataset) else read_rssi(dataset)
    known = evenly(split_positions(heard, split, seed).known, n)
    warn_of_other_place(place, heard.positions[known], heard.folder)
    return calibrate_powers_by(place, heard, known, tolerances, propagation, report)


def calibrate_powers_by(
    scene: Scene,
    dataset: RssiDataset,
    known: Int[np.ndarray, " n"],
    tolerances: Tolerances = Tolerances(),
    propagation: Propagation = Propagation(),
    report: Callable[[str], None] = lambda sentence: None,
) -> PowerCalibration:
    """Correct a scene by the powers at some of a dataset's positions; ``calibrate_powers`` explains the arguments."""
    if propagation.diffuse:
        raise ParameterError("diffuse", "expected no diffuse reflection (its phases are random), found some")
    if tolerances.carrier:
        raise ParameterError("carrier", f"expected 0, since powers do not tell it, found {tolerances.carrier:g}")
    if dataset.frequency is None:
        say(f"{dataset.folder}: no frequency is stated, so the scene's, {scene.frequency / 1e6:g} MHz, is assumed")
    scenes = scenes_with_gateways(scene, dataset)
    which = of_gateways(scene, list(scenes), tolerances)
    if not which:
        raise InputError(f"{scene.name}: expected a tolerance above 0, found nothing that may be wrong")
    positions, powers = dataset.positions[known], dataset.rssi_dbm[known]
    if np.isnan(powers).all():
        raise InputError(f"{dataset.folder}: expected received powers at the known positions, found none")
    doing(f"{scene.name}: correcting {len(which)} values by the powers at {len(positions):,} positions")
    region = bounding_box(positions)
    tracers = [Tracer(each, propagation, region, report=report) for each in scenes.values()]
    scales = np.stack([power_of_chains(each, positions) for each in tracers], axis=1)
    if not (scales > NO_PATHS).any():
        raise InputError(f"{scene.name}: expected paths from the gateways to the positions of the powers, found none")
    likelihood = PowerLikelihood(powers, dataset.floor_dbm, scales, independence(positions, scene.wavelength))
    search = PowerSearch(scenes, which, positions, likelihood, report)
    before = search.error(likelihood.best(np.abs(search.responses(tracers)) ** 2))
    found = _likelier(search, tracers)
    return _calibration(scene, search, found, before)


def _likelier(search: PowerSearch, tracers: list[Tracer]) -> PowerMinimum:
    """The more likely end of two searches: one from the description, one from the most likely drawn places."""
    found = search.minimum(tracers, np.zeros(len(search.which)))
    guess = search.start_nearby(tracers)
    if guess.any():
        found = min(found, search.minimum(tracers, guess), key=lambda end: end.unlikely)
    return found


def _calibration(scene: Scene, search: PowerSearch, found: PowerMinimum, before: float) -> PowerCalibration:
    of_place = [number for number, each in enumerate(search.which) if each.kind != "position"]
    corrected = vary(scene, [search.which[each] for each in of_place], found.values[of_place])
    gateways = dict(zip(search.scenes, (each.gateway for each in search.varied(found.values)), strict=True))
    error = search.error(found.fit), before
    propagation = found.tracers[0].ray_scene.propagation
    which, values, deviations = list(search.which), found.values, found.deviations
    return PowerCalibration(corrected, gateways, which, values, deviations, error, found.fit, propagation)


def of_gateways(scene: Scene, names: list[str], tolerances: Tolerances) -> list[Unknown]:
    """The unknowns of a scene whose powers several gateways receive: the places of the gateways, and of the scene."""
    found = [Unknown("position", name, axis, tolerances.position) for name in names for axis in range(3)]
    found += unknowns(scene, replace(tolerances, position=0.0, rotation=0.0, carrier=0.0))
    return [each for each in found if each.tolerance > 0]


def traced_powers(
    scene: Scene, gateways: Mapping[str, Gateway], positions: Float[np.ndarray, "K 3"], propagation: Propagation
) -> tuple[Float[np.ndarray, "K G"], Float[np.ndarray, "K G"]]:
    """Path gains ``|y|²`` of gateways with one antenna, and the sums of the powers of their paths, both linear."""
    region = bounding_box(positions)
    return powers_by([Tracer(each, propagation, region) for each in alone(scene, gateways).values()], positions)


def powers_by(
    tracers: Sequence[Tracer], positions: Float[np.ndarray, "K 3"]
) -> tuple[Float[np.ndarray, "K G"], Float[np.ndarray, "K G"]]:
    """The same as ``traced_powers`` by the tracer of each gateway."""
    gains = np.stack([np.abs(each.responses(positions)[:, 0].astype(complex)) ** 2 for each in tracers], axis=1)
    return gains, np.stack([power_of_chains(each, positions) for each in tracers], axis=1)


def power_of_chains(tracer: Tracer, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, " K"]:
    """Sum of the powers of all chains at each position: the mean power if their phases were random, linear."""
    return (np.abs(tracer.responses_by_chain(positions)[:, 0].astype(complex)) ** 2).sum(axis=1)


def write_power_calibration(calibration: PowerCalibration, folder: Path) -> None:
    """Write the corrected scene, gateways.yml and calibration.json to a folder."""
    write_scene(calibration.scene, folder)
    keys = ("position", "orientation", "pattern", "polarization")
    gateways = {
        name: {key: _plain(asdict(gateway)[key]) for key in keys} for name, gateway in calibration.gateways.items()
    }
    text = yaml.dump(gateways, Dumper=PlainDumper, allow_unicode=True, sort_keys=False)
    write_atomically(folder / GATEWAYS, text.encode())
    content: dict[str, Any] = {
        "changes": changes_of(calibration.which, calibration.values, calibration.deviations),
        "unit": UNIT,
        "median_error_db": {"described": calibration.error[1], "corrected": calibration.error[0]},
        "levels_dbm": dict(zip(calibration.gateways, calibration.levels.tolist(), strict=True)),
    }
    write_atomically(folder / RECORD, (json.dumps(content, indent=2) + "\n").encode())


def _plain(value: Any) -> Any:
    return [float(each) for each in value] if isinstance(value, tuple | list | np.ndarray) else value
