"""Received powers that the viewer shows: the folder, its scene, fitted methods, and maps that all tabs share."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from threading import Lock

import numpy as np
from jaxtyping import Float, Int

from learn.fitted.coverage import CoverageMap, coverage_map
from learn.fitted.fitted_method import Fitted, fit_method
from learn.quantities.quantity import Prediction
from scenes.files.errors import InputError
from scenes.scene.description import Scene
from scenes.scene.shapes import bounding_box
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import read_dataset
from simulate.dataset.rooms_folder import recorded_scene

CELLS = 4000  # About the number of cells of a map; more would take longer than a user wants to wait


@dataclass
class PowerSubject:
    """A folder of received powers that the viewer shows."""

    name: str  # name of the folder
    dataset: Dataset  # the powers
    # indices of the positions that methods learn from: the folder's training part, or all if it has none
    known: Int[np.ndarray, " n"]
    scene: Scene | None  # the scene of the folder. None: it has none.
    missing: list[str]  # one sentence for each part of the subject that could not be read
    planned: Float[np.ndarray, "n 3"] | None = None  # further positions to show, metres, world frame
    _fitted: dict[str, Fitted] = field(default_factory=dict, repr=False)
    _maps: dict[tuple[str, float], CoverageMap] = field(default_factory=dict, repr=False)
    _one_at_a_time: Lock = field(default_factory=Lock, repr=False)

    @classmethod
    def of(cls, folder: Path) -> PowerSubject:
        """Read a folder."""
        dataset, missing, scene = read_dataset(folder), [], None
        try:
            scene = recorded_scene(folder, dataset.metadata)
        except (InputError, OSError) as error:
            missing.append(f"The scene of this folder cannot be read ({error}), so the room is not drawn.")
        known = dataset.train if len(dataset.train) else np.arange(len(dataset))
        return cls(folder.resolve().name, dataset, known, scene, missing)

    @property
    def region(self) -> Float[np.ndarray, "2 3"]:
        """Corners (min, max) of the box of all positions, metres, world frame."""
        return bounding_box(self.dataset.positions)

    @property
    def known_region(self) -> Float[np.ndarray, "2 3"]:
        """Corners (min, max) of the box of the known positions, metres, world frame."""
        return bounding_box(self.dataset.positions[self.known])

    @property
    def middle_height(self) -> float:
        """Median height of the known positions, metres."""
        return float(np.median(self.dataset.positions[self.known, 2]))

    @property
    def step(self) -> float:
        """Side of a cell of a map, metres."""
        width, depth = np.ptp(self.known_region, axis=0)[:2]
        return max(float(np.sqrt(width * depth / CELLS)), float(max(width, depth)) / CELLS, 0.01)

    @property
    def strongest_measured(self) -> Int[np.ndarray, " K"]:
        """Index of the gateway that received most from each position; −1 where none received anything."""
        powers = np.where(np.isnan(self.dataset.powers), -np.inf, self.dataset.powers)
        return np.where(np.isfinite(powers).any(axis=1), powers.argmax(axis=1), -1)

    def predict(self, method: str, position: Float[np.ndarray, " 3"]) -> Prediction:
        """Powers at a position in metres, world frame: arrays [1, G]. The first call of a method fits it."""
        with self._one_at_a_time:
            return self._fit(method).predict(position[None])

    def coverage(self, method: str, height: float) -> CoverageMap:
        """The map of a method at a height in metres. It is computed once."""
        with self._one_at_a_time:
            key = method, round(height, 3)
            if key not in self._maps:
                self._maps[key] = coverage_map(self._fit(method), height=height, step=self.step)
            return self._maps[key]

    def _fit(self, method: str) -> Fitted:
        if method not in self._fitted:
            self._fitted[method] = fit_method(self.dataset, "power", method, known=self.known)
        return self._fitted[method]
