"""How well are tags located from responses along a moving antenna, and the responses predicted?

python -m benchmarks.uses.moving_antenna data/adarf-d1 --json > runs/moving_antenna.json

The data are measured: an RFID reader's antenna moves along a metre and reads five tags at 50 stops (data set D1 of
AdaRF, at 920.625 MHz). Tags are located by the hologram of free space and by ``bisplat.locate``, which know
nothing else, and from places of the same tag that are known. Responses are predicted at stops that are held out, and
of places of the tag that are held out with all their runs. A split is "random" (a fifth) or "blocked" (ten stops, 20
cm; or ten places, about 10 cm of the distance from the track). Each stop and each place is held out once.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import tyro
from jaxtyping import Complex, Float, Int
from tyro.conf import Positional

from benchmarks.ledger.printing import print_figures
from benchmarks.ledger.response_methods import METHODS, Known, Predict
from learn.localisation.locate import locate
from learn.quantities.complex_scores import correlation, snr_db
from scenes.scene.description import SPEED_OF_LIGHT
from simulate.exchange.recorded_responses import one_way

FREQUENCY = 920.625e6
WAVELENGTH = SPEED_OF_LIGHT / FREQUENCY
REGION = np.array([[-0.1, 0.2, 0.0], [1.1, 1.3, 0.0]])
"""Box in which tags are searched, metres: they stand at 0.08 to 0.92 m along the track, 0.45 to 0.9 m away from it."""

AHEAD = (0.0, 1.0, 0.0)
FOLDS, BLOCK = 5, 10
LOCATES = ("nearest", "helmholtz", "kriged gain of free space")
"""Methods by whose predictions tags are located among known places."""


class Reads(NamedTuple):
    """Rows of a tag that was read at all stops: two-way responses, places and numbers of the tags, and the stops."""

    responses: Complex[np.ndarray, "K 50"]
    places: Float[np.ndarray, "K 3"]
    tags: Int[np.ndarray, " K"]
    stops: Float[np.ndarray, "50 3"]

    def some(self, rows: np.ndarray) -> Reads:
        """Some of the rows."""
        return Reads(self.responses[rows], self.places[rows], self.tags[rows], self.stops)


def read_measured(folder: Path) -> Reads:
    """The reads of one frequency. The reader's phase rises with the distance, so that it is conjugated."""
    arrays = np.load(folder / "measured.npz")
    kept = (arrays["frequency"] == FREQUENCY) & np.isfinite(arrays["phasor"]).all(axis=1)
    phases = np.angle(arrays["phasor"][kept].astype(complex))
    level = 10 ** (arrays["rssi"][kept].astype(float) / 20)
    stops = np.nanmean(arrays["antenna_x"][kept].astype(float), axis=0)
    flat = np.pad(arrays["position"][kept].round(3), [(0, 0), (0, 1)])
    return Reads(level * np.exp(-1j * phases), flat, arrays["tag"][kept], np.pad(stops[:, None], [(0, 0), (0, 2)]))


def made_up() -> Reads:
    """Reads in free space, to test the benchmark."""
    stops = np.pad(np.linspace(0, 1, 50)[:, None], [(0, 0), (0, 2)])
    places = np.array([[x, y, 0.0] for y in np.linspace(0.45, 0.9, 10) for x in (0.4, 0.5)])
    distance = np.linalg.norm(places[:, None] - stops, axis=-1)
    responses = np.exp(-4j * np.pi * distance / WAVELENGTH) / distance**2
    return Reads(responses, places, np.zeros(len(places), int), stops)


def hologram(reads: Reads) -> Float[np.ndarray, "K 3"]:
    """Places at which the phases of free space agree best with the measured ones, over a grid of 1 cm."""
    axes = [np.arange(low, high, 0.01) for low, high in REGION.T[:2]]
    grid = np.pad(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2), [(0, 0), (0, 1)])
    distance = np.linalg.norm(grid[:, None] - reads.stops, axis=-1)
    phases = np.exp(4j * np.pi * distance / WAVELENGTH)
    return grid[np.abs(reads.responses / np.abs(reads.responses) @ phases.T).argmax(axis=1)]


def errors(found: Float[np.ndarray, "K 3"], truth: Float[np.ndarray, "K 3"]) -> dict[str, Any]:
    """Errors of places, centimetres."""
    off = 100 * (found - truth)
    distance = np.linalg.norm(off, axis=1)
    return {
        "median, cm": round(float(np.median(distance)), 1),
        "90 %, cm": round(float(np.quantile(distance, 0.9)), 1),
        "along, cm": round(float(np.median(np.abs(off[:, 0]))), 1),
        "away, cm": round(float(np.median(np.abs(off[:, 1]))), 1),
    }


def located(reads: Reads) -> Iterator[tuple[str, dict[str, Any]]]:
    """Errors of tags that are located without known ones."""
    yield "located by the hologram of free space", errors(hologram(reads), reads.places)
    for name, boresight in (("", None), (", looking ahead", AHEAD)):
        begun = time.perf_counter()
        told = {"region": REGION, "frequency": FREQUENCY, "boresight": boresight, "round_trip": True}
        found = replace(locate(reads.stops, reads.responses, **told), truth=reads.places)  # type: ignore[arg-type]
        each = (time.perf_counter() - begun) / len(found)
        row = errors(np.array([places[0].position for places in found]), reads.places)
        within, seconds = found.share_in_region or 0.0, float(f"{each:.2g}")
        yield f"located by locate{name}", row | {"in 90 % region": round(within, 3), "seconds a tag": seconds}


def folds(count: int, split: str) -> list[Int[np.ndarray, " n"]]:
    """Test parts that together are all of so many numbers: blocks of ten, or random fifths."""
    order = np.arange(count) if split == "blocked" else np.random.default_rng(0).permutation(count)
    return [np.sort(each) for each in np.array_split(order, max(2, count // BLOCK) if split == "blocked" else FOLDS)]


class Part(NamedTuple):
    """A test part: what is known, and the positions and responses that are held out.

    ``by_antenna``: a score refers to one of the E antennas at all held-out positions, instead of to one position.
    """

    known: Known
    positions: Float[np.ndarray, "K 3"]
    truth: Complex[np.ndarray, "K E"]
    by_antenna: bool


def scored(parts: list[Part], fitted: list[Predict]) -> dict[str, Any]:
    """Scores of a method that was fitted to what is known in each part."""
    ratios, alike = [], []
    for (_, positions, truth, of_antenna), predict in zip(parts, fitted, strict=True):
        found = predict(positions)
        rows = (found.T, truth.T) if of_antenna else (found, truth)
        ratios.append(snr_db(*(each[:, None] for each in rows)))
        alike.append(correlation(*(each[:, None] for each in rows)))
    return {
        "SNR, median, dB": round(float(np.median(np.concatenate(ratios))), 2),
        "SNR, 10 %, dB": round(float(np.quantile(np.concatenate(ratios), 0.1)), 2),
        "correlation, median": round(float(np.median(np.concatenate(alike))), 4),
    }


def first_runs(reads: Reads) -> Int[np.ndarray, " n"]:
    """The first row of each tag at each place."""
    return np.unique(np.column_stack([reads.places, reads.tags]), axis=0, return_index=True)[1]


def at_stops(reads: Reads, split: str) -> list[Part]:
    """Held-out stops: the antenna moves, and tags stand still. The responses are one-way, roots of those measured."""
    first = first_runs(reads)
    responses, tags = one_way(reads.responses[first], []).T, reads.places[first]
    parts = []
    for test in folds(len(reads.stops), split):
        known = np.setdiff1d(np.arange(len(reads.stops)), test)
        task = Known(reads.stops[known], responses[known], tags, WAVELENGTH, 1)
        parts.append(Part(task, reads.stops[test], responses[test], True))
    return parts


def of_places(reads: Reads, split: str) -> list[Part]:
    """Held-out places of each tag: the tag moves, and the stops stand still. The responses are two-way.

    The runs of a known place are averaged.
    """
    parts = []
    for tag in np.unique(reads.tags):
        of_tag = reads.some(reads.tags == tag)
        places, of_row = np.unique(of_tag.places[:, [1, 0, 2]], axis=0, return_inverse=True)  # by the distance first
        for test in folds(len(places), split):
            held = np.isin(of_row.ravel(), test)
            known, new = of_tag.some(~held), of_tag.some(held)
            where, of_place = np.unique(known.places, axis=0, return_inverse=True)
            means = [known.responses[of_place.ravel() == each].mean(axis=0) for each in range(len(where))]
            task = Known(where, np.array(means), reads.stops, WAVELENGTH, 2)
            parts.append(Part(task, new.places, new.responses, False))
    return parts


def among_known(parts: list[Part], fitted: list[Predict]) -> dict[str, Any]:
    """Errors of tags that are located where a method predicts their responses best, from known places of the tag."""
    found, truth = [], []
    for (known, positions, responses, _), predict in zip(parts, fitted, strict=True):
        both = np.concatenate([known.positions, positions])
        axes = [np.arange(low, high + 1e-9, 0.005) for low, high in zip(both.min(0)[:2], both.max(0)[:2], strict=True)]
        grid = np.pad(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2), [(0, 0), (0, 1)])
        there = predict(grid)
        off = np.square(np.abs(there)).sum(axis=1) - 2 * (responses.conj() @ there.T).real
        found.append(grid[off.argmin(axis=1)])
        truth.append(positions)
    return errors(np.concatenate(found), np.concatenate(truth))


def repeats(reads: Reads) -> dict[str, Any]:
    """How alike the responses are of two runs in which the same tag stands at the same place: drift and noise."""
    ratios, alike, turned = [], [], []
    for row, (place, tag) in enumerate(zip(reads.places, reads.tags, strict=True)):
        same = np.flatnonzero((reads.places == place).all(axis=1) & (reads.tags == tag))
        for other in same[same > row]:
            pair = [reads.responses[[each]][:, None] for each in (row, other)]
            ratios.append(snr_db(*pair)[0])
            alike.append(correlation(*pair)[0])
            turned.append(abs(np.angle((pair[0].conj() * pair[1]).sum())))
    return {
        "SNR, median, dB": round(float(np.median(ratios)), 2),
        "SNR, 10 %, dB": round(float(np.quantile(ratios, 0.1)), 2),
        "correlation, median": round(float(np.median(alike)), 4),
        "phase turned, median, degrees": round(float(np.degrees(np.median(turned))), 1),
        "phase turned, 90 %, degrees": round(float(np.degrees(np.quantile(turned, 0.9))), 1),
    }


def main(
    measured: Positional[Path | None] = None,
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Locate tags and predict responses."""
    if not smallest and (measured is None or not (measured / "measured.npz").is_file()):
        sys.exit(f"{measured}: expected a folder with measured.npz, found none")
    reads = made_up() if smallest or measured is None else read_measured(measured)
    result: dict[str, Any] = dict(located(reads.some(first_runs(reads))))
    if not smallest:
        result["two runs at the same place"] = repeats(reads)
    methods = {name: METHODS[name] for name in list(METHODS)[: 2 if smallest else None]}
    for split in ("random", "blocked"):
        for kind, parts in (("stops", at_stops(reads, split)), ("places", of_places(reads, split))):
            for name, method in methods.items():
                fitted = [method(part.known) for part in parts]
                result[f"{kind}, {split}, {name}"] = scored(parts, fitted)
                if kind == "places" and name in LOCATES:
                    result[f"located among known places, {split}, {name}"] = among_known(parts, fitted)
    print_figures(result, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
