"""How near do rays come to full wave in random rooms that nobody tuned them to, and can one tell before?

python -m benchmarks.simulate.random_rooms --weights simulate/rays/expected_correlation.json \
--json > runs/random_rooms.json

Each room of ``scenes.places.random_room`` is solved in full wave for one element, with cells of 2.5 cm, and traced at
the same positions by the default rays. A row is a room: the correlation of rays and full wave over all positions
(whole field), the level of the rays over full wave, and what the room has. Of the first 40 seeds, even ones are for
finding faults, odd ones for judging. Further rooms are only for fitting.

"expected" is the correlation that ``simulate.rays.expected_correlation`` predicts from the rays alone. Its weights are
fitted to all rooms but the judging ones, so that the logarithms of 1 − correlation² differ least. ``--weights`` writes
them to a file. The rows "expected, ..." say how well this predicts the judging rooms. Two larger built-in places, with
dipoles as antennas, show what it predicts beyond the rooms that it was fitted to.

The last rows say by how much 1 − correlation rises with each feature of a room, over the even rooms: coefficients of
a ridge regression of log(1 − correlation): the median over bootstrap draws of rooms, and the range from 10 to 90 % of
them.

A room takes about a minute of full wave. What was solved is kept in random_rooms.npz, beside this file, and is solved
again only if the room changes (ledger/solved_rooms.py).
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro
from scipy.optimize import minimize
from scipy.stats import spearmanr

from benchmarks.ledger.printing import print_figures
from benchmarks.ledger.room_features import features, regression
from benchmarks.ledger.smallest_room import smallest_room
from benchmarks.ledger.solved_rooms import CELL, LARGER, POSITIONS, correlation, of_one_element, scene_of, solved
from simulate.positions.placement import place
from simulate.rays.core.propagation import Propagation
from simulate.rays.expected_correlation import PowerShares, Weights, power_shares
from simulate.rays.tracer import Tracer

ROOMS, JUDGED = 50, 40


def part_of(seed: int | str) -> str:
    """What a room is for."""
    if isinstance(seed, str):
        return "larger"
    if seed >= JUDGED:
        return "fitting"
    return "judging" if seed % 2 else "finding"


def main(
    rooms: int = ROOMS,
    cell: float = CELL,
    weights: Path | None = None,
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Compare rays with full wave in random rooms."""
    positions, propagation = POSITIONS, Propagation()
    if smallest:
        rooms, cell, positions = 5, 0.024, 5
        propagation = Propagation(max_depth=1, rays=1000)
    rows: dict[int | str, dict[str, Any]] = {}
    has: dict[int, dict[str, float]] = {}
    near: dict[int | str, float] = {}
    shares: dict[int | str, PowerShares] = {}
    for seed in (*range(rooms), *LARGER):
        scene = of_one_element(smallest_room() if smallest else scene_of(seed))
        places = place(scene, "uniform", positions, 0)
        full = solved(scene, places, cell, keep=not smallest)
        tracer = Tracer(scene, propagation)
        rays = tracer.responses(places).ravel()
        near[seed] = correlation(rays, full)
        level = 20 * np.log10(np.linalg.norm(rays) / np.linalg.norm(full))
        shares[seed] = power_shares(tracer, places)
        rows[seed] = {"correlation": round(near[seed], 3), "expected": 0.0, "level_db": round(float(level), 2)}
        rows[seed] |= {"has": ", ".join(item.name for item in scene.objects[6:])}
        if part_of(seed) == "finding" and not smallest:
            has[seed] = {**features(scene), "1 − correlation": 1 - near[seed]}
    fitted = [seed for seed in rows if part_of(seed) in ("finding", "fitting")]
    fit = fitted_weights([shares[seed] for seed in fitted], [near[seed] for seed in fitted])
    expected = {seed: fit.expected(shares[seed]) for seed in rows}
    for seed, row in rows.items():
        row["expected"] = round(expected[seed].middle, 3)
    if weights is not None and not smallest:
        weights.write_text(json.dumps(fit._asdict(), indent=2) + "\n")

    result: dict[str, Any] = {
        f"{seed}, larger" if seed in LARGER else f"room {seed}, {part_of(seed)}": row for seed, row in rows.items()
    }
    for part in ("finding", "judging"):
        values = [row["correlation"] for seed, row in rows.items() if part_of(seed) == part]
        low, middle, high = np.quantile(values, [0.1, 0.5, 0.9])
        figures = {"lowest": min(values), "tenth percentile": low, "median": middle, "ninetieth percentile": high}
        result |= {f"{part}, {name}": {"correlation": round(float(each), 3)} for name, each in figures.items()}
    if not smallest:  # whose rooms are all the same
        judged = [seed for seed in rows if part_of(seed) == "judging"]
        true = np.array([near[seed] for seed in judged])
        low, middle, high = np.array([expected[seed] for seed in judged]).T
        result |= {
            "expected, rank correlation with the true one": {"judging": round(float(spearmanr(true, middle)[0]), 2)},
            "expected, mean of the difference to it": {"judging": round(float(np.abs(true - middle).mean()), 3)},
            "expected, rooms within the range": {"judging": int(((low <= true) & (true <= high)).sum())},
        }
        result |= regression(has)
    print_figures(result, json_output, smallest)


def fitted_weights(shares: list[PowerShares], correlations: list[float]) -> Weights:
    """The weights with which log(1 − c²) differs least from the correlations c, by its mean square."""
    x = np.column_stack([np.ones(len(shares)), np.array(shares)])
    error = np.log(1 - np.array(correlations) ** 2)

    def misfit(logarithms: np.ndarray) -> float:
        return float(((np.log(x @ np.exp(logarithms)) - error) ** 2).mean())

    best = minimize(misfit, np.log([0.01, 0.1, 0.1, 0.1]), method="Nelder-Mead", options={"maxiter": 10_000})
    weights = np.exp(best.x)
    factors = np.quantile(np.exp(error) / (x @ weights), [0.1, 0.5, 0.9])
    constant, *rest = (float(f"{each:.3g}") for each in weights)
    return Weights(constant, (rest[0], rest[1], rest[2]), tuple(round(float(each), 2) for each in factors))  # type: ignore[arg-type]


if __name__ == "__main__":
    tyro.cli(main)
