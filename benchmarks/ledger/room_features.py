"""What random rooms have, as numbers, and how much of the rays' error goes with each of them."""

from __future__ import annotations

from typing import Any

import numpy as np

from scenes.scene.description import Scene

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
