"""Does a description of the place help where powers or a band are measured, not one frequency's responses?

python -m benchmarks.uses.twin_quantities --json > runs/twin-quantities.json

Powers: two elements of the closet's gateway in full wave (the field in tests/data) are gateways of one antenna. They
report steps of 1 dB with 1 dB of shadowing. In the description every gateway is off by 5 cm along each axis, and the
properties of materials by 20 % (standard deviations). The scores are median absolute errors at other positions: of rays
in the described, the corrected and the true scene, of the method ``twin``, and of methods that know no scene.

Band: the closet by rays, with diffraction and a third reflection that the twin does not follow, and an SNR of 20 dB.
Only the gateway's pose is wrong: its position by a given distance in a random direction within the room, and its
orientation by 2° about each axis (standard deviation). The pose is corrected by responses at the carrier or at four
subcarriers over 20 MHz, from the same number of spectra or of complex numbers, or over 20 kHz, in which all delays look
alike. A search has converged if it ends within 5 cm.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro
from jaxtyping import Float

from benchmarks.ledger.printing import print_figures
from learn.methods.method_table import methods_of
from learn.powers.twin_powers import FOLLOWED, TwinPowers
from learn.quantities.known import Known
from learn.quantities.powers import Powers, score_powers
from learn.twin.calibrate import correct, of_gateways
from learn.twin.described_gateways import alone, described_gateways
from learn.twin.power_residual import PowerResidual, path_powers
from scenes.checks.validation import is_valid
from scenes.scene.antennas import Gateway
from scenes.scene.description import Scene
from scenes.scene.shapes import bounding_box
from scenes.scene.tolerances import Tolerances
from scenes.scene.unknowns import Unknown, unknowns, vary
from scenes.storage.scene_yaml import load_scene
from simulate.dataset.dataset import Dataset
from simulate.dataset.written_dataset import write_dataset
from simulate.generation.simulation import simulate
from simulate.rays.core.propagation import Propagation
from simulate.rays.core.sionna_scene import gateway_antennas
from simulate.rays.tracer import Tracer
from simulate.spectra.band import Band
from simulate.spectra.measurement import Measurement

CORNERS = (0, 15)
"""Elements of the closet's array that are gateways: opposite corners."""

WRONG = Tolerances(position=0.05, objects=0, materials=0.2)

NEAR = 0.05
"""Metres; a search that ends nearer to the true position has converged."""

OF_TWINS = {
    "median error, dB": "error_median_db",
    "90th percentile, dB": "error_p90_db",
    "in 90 % interval": "coverage_90",
}
"""Scores of the method twin, by their columns."""

Figures = dict[str, float]


@dataclass(frozen=True)
class Study:
    """Numbers of known and tested powers, and of wrong descriptions.

    ``poses``: for each row of the band the error of the position (m), the numbers of spectra and of subcarriers, 1 for
    the carrier alone, and the number of draws. ``narrow``: the same over 20 kHz instead of 20 MHz, without delays.
    ``propagation``: what rays follow, except those of the method ``twin``, which follow ``by_twin``.
    """

    known: int = 80
    tested: int = 150
    wrong: int = 2
    poses: tuple[tuple[float, int, int, int], ...] = (
        *((far, *use, 3) for far in (0.3, 1.0) for use in ((5, 1), (20, 1), (5, 4))),
        *((1.0, *use, 8) for use in ((2, 1), (8, 1), (2, 4))),
    )
    narrow: tuple[tuple[float, int, int, int], ...] = ((1.0, 2, 4, 8),)
    propagation: Propagation = Propagation(max_depth=2, rays=100_000, diffraction=False)
    by_twin: Propagation = FOLLOWED


LEAST = Propagation(max_depth=0, rays=1000, diffraction=False)
SMALLEST = Study(5, 4, 1, ((0.1, 2, 1, 1), (0.1, 2, 4, 1)), ((0.1, 2, 4, 1),), LEAST, LEAST)


def measured_powers(work: Path, study: Study) -> tuple[Dataset, Float[np.ndarray, "G 3"]]:
    """Powers of the corner elements in full wave, with the true places of these."""
    count = study.known + study.tested
    field: Any = {"engine": "fullwave", "field": Path("tests/data/closet")}
    data = simulate("closet", work / "fullwave", count, seed=1, **field)
    places = gateway_antennas(load_scene("closet")).positions[list(CORNERS)]
    gains = 20 * np.log10(np.abs(data.responses[:, CORNERS]))
    powers = np.round(gains + np.random.default_rng(7).normal(size=gains.shape))
    return described(work / "true", data.positions, powers, places), places


def described(
    folder: Path,
    positions: Float[np.ndarray, "K 3"],
    powers: Float[np.ndarray, "K G"],
    places: Float[np.ndarray, "G 3"],
) -> Dataset:
    """A folder of powers whose gateways are described to be at some places."""
    gateways = {f"corner{number}": tuple(place) for number, place in enumerate(places.tolist())}
    return write_dataset(folder, positions, powers=powers, gateways=gateways, frequency=load_scene("closet").frequency)


def errors(
    scene: Scene, gateways: dict[str, Gateway], data: Dataset, known: int, tested: int, propagation: Propagation
) -> Figures:
    """Absolute errors of rays' powers at tested positions, with the levels and the fading that fit the known ones."""
    box = bounding_box(data.positions)
    tracers = [Tracer(each, propagation, box) for each in alone(scene, gateways).values()]
    gains, scales = path_powers(tracers, data.positions[:known])
    judged = PowerResidual(data.powers[:known], data.floor_dbm, scales, np.ones(known))
    predicted = judged.best(gains).predicted(tracers, data.positions[-tested:])
    return scores(predicted - data.powers[-tested:])


def scores(off: Float[np.ndarray, "K G"]) -> Figures:
    """Median and 90th percentile of absolute errors, dB."""
    return {
        "median error, dB": float(np.nanmedian(np.abs(off))),
        "90th percentile, dB": float(np.nanquantile(np.abs(off), 0.9)),
    }


def of_powers(work: Path, study: Study) -> Iterator[tuple[str, list[Figures]]]:
    """Rows of the part on powers: figures of each draw."""
    scene = load_scene("closet")
    data, places = measured_powers(work, study)
    known, tested, followed = study.known, study.tested, study.propagation
    yield "powers, true description", [errors(scene, described_gateways(data), data, known, tested, followed)]
    wrongs: list[tuple[Scene, Dataset, Float[np.ndarray, " n"]]] = []
    which = of_gateways(scene, data.gateway_names, WRONG)
    count = places.size
    for draw in range(study.wrong):
        off = np.random.default_rng(draw).normal(size=len(which)) * [each.tolerance for each in which]
        wrong = described(work / f"wrong{draw}", data.positions, data.powers, places + off[:count].reshape(-1, 3))
        wrongs.append((vary(scene, which[count:], off[count:]), wrong, off))
    before = [errors(place, described_gateways(wrong), wrong, known, tested, followed) for place, wrong, _ in wrongs]
    away = [{"gateways off, mm": 1e3 * distance(off[:count])} for _, _, off in wrongs]
    yield "powers, described", [each | far for each, far in zip(before, away, strict=True)]
    found_of = []
    for place, wrong, off in wrongs:
        begun = time.perf_counter()
        found = correct(place, wrong, np.arange(known), WRONG, followed)
        seconds = time.perf_counter() - begun
        left = found.values + off
        figures = errors(found.scene, found.gateways, wrong, known, tested, followed)
        figures |= {"gateways off, mm": 1e3 * distance(left[:count])}
        figures["off, stated deviations"] = rms(left[:count] / found.deviations[:count])
        found_of.append(figures | {"seconds": seconds})
    yield f"powers, corrected, {known}", found_of
    of_twins = []
    for place, wrong, _ in wrongs:
        begun = time.perf_counter()
        twin = TwinPowers(place, wrong, WRONG, study.by_twin)
        twin.fit(Known.of(wrong, Powers(), np.arange(known)))
        found_by = score_powers(twin.predict(data.positions[-tested:]), data.powers[-tested:], data.floor_dbm)
        of_twins.append(
            {key: found_by[name] for key, name in OF_TWINS.items()} | {"seconds": time.perf_counter() - begun}
        )
    yield f"powers, twin, {known}", of_twins
    for name in ("inverse-distance", "helmholtz"):
        method = methods_of("power")[name]()
        method.fit(Known.of(data, Powers(), np.arange(known)))
        predicted = method.predict(data.positions[-tested:]).value
        yield f"powers, {name}, {known}", [scores(predicted - data.powers[-tested:])]


def distance(off: Float[np.ndarray, " 3*G"]) -> float:
    """Mean distance of places from the true ones."""
    return float(np.linalg.norm(off.reshape(-1, 3), axis=1).mean())


def rms(values: Float[np.ndarray, " n"]) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def of_band(work: Path, study: Study) -> Iterator[tuple[str, list[Figures]]]:
    """Rows of the part on a band: figures of each draw."""
    scene = load_scene("closet")
    most = max(spectra for _, spectra, _, _ in study.poses)
    richer = replace(
        study.propagation, max_depth=study.propagation.max_depth + 1, diffraction=study.propagation.max_depth > 0
    )
    for band, poses, over in ((Band(20e6, 16), study.poses, ""), (Band(20e3, 16), study.narrow, " over 20 kHz")):
        data = simulate(
            "closet", work / f"band{over}", max(most, 4), seed=1, bandwidth=band.bandwidth,
            subcarriers=band.subcarriers, measurement=Measurement(snr_db=20), propagation=richer,
        )  # fmt: skip
        for far, spectra, subcarriers, draws in poses:
            row = f"band, {100 * far:.0f} cm off, {spectra} spectra × {subcarriers}{over}"
            use = (spectra, subcarriers, study.propagation)
            yield row, [of_pose(scene, data, far, draw, *use) for draw in range(draws)]


def of_pose(
    scene: Scene, data: Dataset, far: float, draw: int, spectra: int, subcarriers: int, followed: Propagation
) -> Figures:
    """Error of the pose after its correction."""
    tolerances = Tolerances(position=far / 3**0.5, rotation=2, objects=0, materials=0)
    which = unknowns(scene, tolerances)
    off = wrong_poses(scene, which, far, draw + 1)[draw]
    if subcarriers == 1:
        data = data.with_values(response=data.responses)
    begun = time.perf_counter()
    found = correct(vary(scene, which, off), data, np.arange(spectra), tolerances, followed)
    left = np.linalg.norm(np.subtract(found.scene.gateway.position, scene.gateway.position))
    turned = np.linalg.norm(found.values[3:] + off[3:])
    return {
        "converged": float(left < NEAR),
        "position off, mm": 1e3 * float(left),
        "orientation off, °": float(np.degrees(turned)),
        "seconds": time.perf_counter() - begun,
    }


def wrong_poses(scene: Scene, which: list[Unknown], far: float, count: int) -> list[Float[np.ndarray, " n"]]:
    """The first few drawn errors of the pose that leave the gateway in the open, within the room."""
    (low, high), found, seed = scene.bounds, [], 0
    while len(found) < count:
        off = np.random.default_rng(seed).normal(size=len(which))
        off[:3] *= far / np.linalg.norm(off[:3])
        off[3:] *= which[-1].tolerance
        wrong = vary(scene, which, off)
        if is_valid(wrong) and np.all((low < wrong.gateway.position) & (wrong.gateway.position < high)):
            found.append(off)
        seed += 1
    return found


def main(smallest: bool = False, json_output: Annotated[bool, tyro.conf.arg(name="json")] = False) -> None:
    """Correct a described place by received powers, and by responses over a band."""
    study, found = SMALLEST if smallest else Study(), {}
    with tempfile.TemporaryDirectory() as work:
        for part in (of_powers, of_band):
            for name, draws in part(Path(work), study):
                middle = {key: np.median([each[key] for each in draws]) for key in draws[0]}
                if "converged" in middle:
                    middle["converged"] = np.mean([each["converged"] for each in draws])
                found[name] = {key: round(float(value), 3) for key, value in middle.items()}
    print_figures(found, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
