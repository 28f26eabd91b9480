"""The interface of a compared method: it has ``fit``, which takes a ``KnownSpectra``, and ``predict``."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Protocol

import numpy as np
from jaxtyping import Complex, Float

from learn.data.splits import Split, SplitKind, split
from simulate.dataset.dataset import Dataset
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import spectrum_of


@dataclass(frozen=True)
class KnownSpectra:
    """The spectra from which a method learns, and how long it may train.

    Attributes:
        dataset: the dataset; a method must not use its test part.
        kind: how the test part is chosen.
        split_seed: seed of the split.
        train_size: number of training spectra, drawn from the training part. None: all of it.
        seed: seed of everything that is random in the method itself.
        minutes: training time. None: no limit, ``steps`` is set.
        steps: number of training steps of a model trained by steps. None: as many as fit into ``minutes``.
        folder: the method's own folder; it is kept, so that an interrupted training can continue.
        guard: known positions nearer than this to a test position are left out, wavelengths.
    """

    dataset: Dataset
    kind: SplitKind
    split_seed: int
    train_size: int | None
    seed: int
    minutes: float | None
    steps: int | None
    folder: Path
    guard: float = 0.0

    @cached_property
    def parts(self) -> Split:
        """Training, validation and test part."""
        return split(self.dataset, self.kind, self.split_seed, self.train_size, self.guard)

    @property
    def positions(self) -> Float[np.ndarray, "n 3"]:
        """Transmitter positions of the known spectra (training and validation part), metres, world frame."""
        return self.dataset.positions[self.parts.known]

    @property
    def spectra(self) -> Float[np.ndarray, "n 90 360"]:
        """The known spectra, 0…1."""
        return spectrum_of(self.dataset.pictures[self.parts.known])

    @property
    def responses(self) -> Complex[np.ndarray, "n elements"] | None:
        """Element responses of the known spectra. None: the dataset has none."""
        return None if "response" not in self.dataset.values else self.dataset.responses[self.parts.known]

    @property
    def beamformer(self) -> Beamformer:
        """The dataset's array and grid."""
        return self.dataset.beamformer


class Method(Protocol):
    """A method that learns from known spectra and predicts others.

    A method may also have the attributes ``parameters`` (number of trainable parameters), ``seconds`` (training time)
    and ``steps`` (number of training steps). The rows of a comparison then state them.
    """

    def fit(self, known: KnownSpectra) -> None:
        """Learn from known spectra."""

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, "K 90 360"]:
        """Predict spectra, 0…1, at transmitter positions in metres, world frame."""
