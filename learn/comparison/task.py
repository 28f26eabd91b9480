"""What a compared method is given, and what it has to do: ``fit`` and ``predict`` (docs/compare.md has an example)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Protocol

import numpy as np
from jaxtyping import Complex, Float

from learn.splits import Split, SplitKind, split
from simulate.array import PlanarArray
from simulate.dataset import Dataset
from simulate.spectrum import spectrum_of


@dataclass(frozen=True)
class Task:
    """What a method may learn from, and for how long.

    Attributes:
        dataset: the spectra; a method must not look at the test part.
        kind: how the split is made.
        split_seed: draws the split.
        train_size: number of training spectra, drawn from the training part; None: all of it.
        seed: draws everything random in the method itself.
        minutes: training time; None: as long as ``steps`` take.
        steps: training steps of a model trained by steps; None: as many as fit into ``minutes``.
        folder: the method's own folder, which is kept, so that an interrupted training goes on.
    """

    dataset: Dataset
    kind: SplitKind
    split_seed: int
    train_size: int | None
    seed: int
    minutes: float | None
    steps: int | None
    folder: Path

    @cached_property
    def parts(self) -> Split:
        """Training, validation and test part."""
        return split(self.dataset, self.kind, self.split_seed, self.train_size)

    @property
    def positions(self) -> Float[np.ndarray, "n 3"]:
        """Known transmitter positions, metres."""
        return self.dataset.positions[self.parts.known]

    @property
    def spectra(self) -> Float[np.ndarray, "n 90 360"]:
        """Spectra of the known positions, 0…1."""
        return spectrum_of(self.dataset.pictures[self.parts.known])

    @property
    def responses(self) -> Complex[np.ndarray, "n elements"] | None:
        """Known element responses, where the dataset has them."""
        return None if self.dataset.responses is None else self.dataset.responses[self.parts.known]

    @property
    def array(self) -> PlanarArray:
        """The gateway's array."""
        return self.dataset.array


class Method(Protocol):
    """Anything that predicts spectra from known ones.

    A method may also have the attributes ``parameters`` (number of trainable parameters) and ``seconds`` (training
    time); tables show them where they exist.
    """

    def fit(self, task: Task) -> None:
        """Learn from the known spectra."""

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, "K 90 360"]:
        """Predicted spectra, 0…1."""
