"""How near do rays come to full wave in random rooms that nobody tuned them to, and what costs how much?

python benchmarks/random_rooms.py --json > runs/random_rooms.json

Each room of ``scenes.places.random_room`` is solved in full wave for one element, with cells of 2.5 cm, and traced at
the same positions by the default rays. A row is a room: the correlation of rays and full wave over all positions
(whole field), the level of the rays over full wave, and what the room has. Even seeds are for finding faults, odd ones
for judging. The last rows say by how much 1 − correlation rises with each feature over the even rooms: coefficients of
a ridge regression of log(1 − correlation), and their standard errors by bootstrap.

A room takes about a minute of full wave. What was solved is kept in random_rooms.npz, beside this file, and is solved
again only if the room changes (ledger/solved_rooms.py).
"""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
import tyro
from ledger.printing import print_figures
from ledger.smallest_room import smallest_room
from ledger.solved_rooms import correlation, of_one_element, solved

from scenes.places.random_room import random_room
from scenes.scene.description import Scene
from simulate.positions.placement import place
from simulate.rays.core.propagation import Propagation
from simulate.rays.tracer import Tracer

CELL, POSITIONS, ROOMS = 0.025, 400, 40

GROUPS = {
    "hollow boards": ("wardrobe", "wall cupboard", "chest", "crate"),
    "metal boxes": ("fridge", "locker", "microwave"),
    "cylinders": ("boiler", "column"),
    "curved sheets": ("curved screen",),
    "metal sheets": ("whiteboard", "radiator", "sink top", "tray", "steel shelf", "lamp"),
    "leaning sheets": ("screen",),
    "boards": ("worktop", "table", "shelf", "partition"),
    "glass in the room": ("pane", "mirror"),
}
"""Kinds of furniture that are alike to waves."""


def features(scene: Scene) -> dict[str, float]:
    """What a room has, as numbers."""
    names = [item.name for item in scene.objects]
    material = {item.name: item.material for item in scene.objects}
    found = {group: float(sum(name in kinds for name in names)) for group, kinds in GROUPS.items()}
    walls = [material[f"wall {side}"] for side in ("south", "north", "west", "east")]
    found["window"] = float("window" in names)
    found["glass door"] = float(material["door"] == "glass")
    found["light walls"] = float(sum(each in ("plasterboard", "wood") for each in walls))
    found["brick walls"] = float(walls.count("brick"))
    _, _, up = scene.gateway.boresight
    found["tilt of the gateway, 30°"] = abs(float(np.degrees(np.arcsin(up)))) / 30
    return found


def main(
    rooms: int = ROOMS,
    cell: float = CELL,
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Compare rays with full wave in random rooms.

    Args:
        rooms: number of rooms, seeds from 0.
        cell: size of the full-wave cells, metres.
        smallest: only test the benchmark, in seconds and in a smaller place; its figures mean nothing.
        json_output: print one JSON object.
    """
    positions, propagation = POSITIONS, Propagation()
    if smallest:
        rooms, cell, positions = 4, 0.024, 5
        propagation = Propagation(max_depth=1, diffraction=False, rays=1000)
    result: dict[str, Any] = {}
    found: dict[int, dict[str, float]] = {}
    for seed in range(rooms):
        scene = of_one_element(smallest_room() if smallest else random_room(seed))
        places = place(scene, "uniform", positions, 0)
        full = solved(scene, places, cell, keep=not smallest)
        rays = Tracer(scene, propagation).responses(places).ravel()
        near = correlation(rays, full)
        level = 20 * np.log10(np.linalg.norm(rays) / np.linalg.norm(full))
        has = [item.name for item in scene.objects[6:]]
        part = "judging" if seed % 2 else "finding"
        result[f"room {seed}, {part}"] = {
            "correlation": round(near, 3),
            "level_db": round(float(level), 2),
            "has": ", ".join(has),
        }
        if not smallest:
            found[seed] = {**features(scene), "1 − correlation": 1 - near}
    for part in ("finding", "judging"):
        values = [row["correlation"] for name, row in result.items() if name.endswith(part)]
        low, middle, high = np.quantile(values, [0.1, 0.5, 0.9])
        figures = {"lowest": min(values), "tenth percentile": low, "median": middle, "ninetieth percentile": high}
        result |= {f"{part}, {name}": {"correlation": round(float(each), 3)} for name, each in figures.items()}
    if found:
        result |= regression({seed: row for seed, row in found.items() if seed % 2 == 0})
    print_figures(result, json_output, smallest)


def regression(rooms: dict[int, dict[str, float]]) -> dict[str, Any]:
    """How much each feature multiplies 1 − correlation: ridge regression of its logarithm, and a bootstrap's range."""
    from sklearn.linear_model import RidgeCV

    names = [name for name in next(iter(rooms.values())) if name != "1 − correlation"]
    x = np.array([[room[name] for name in names] for room in rooms.values()])
    y = np.log([room["1 − correlation"] for room in rooms.values()])
    generator = np.random.default_rng(0)
    draws = [generator.integers(len(y), size=len(y)) for _ in range(200)]
    factors = np.exp([RidgeCV(np.logspace(-1, 2, 10)).fit(x[rows], y[rows]).coef_ for rows in draws])
    low, middle, high = np.quantile(factors, [0.1, 0.5, 0.9], axis=0)
    return {
        f"one more, {name}": {"1 − correlation, times": f"{middle[k]:.2f} ({low[k]:.2f} to {high[k]:.2f})"}
        for k, name in enumerate(names)
    }


if __name__ == "__main__":
    tyro.cli(main)
