"""What a method learns from: some rows of a dataset, and how long it may train."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
from jaxtyping import Float, Int, Num

from learn.data.splits import Split, SplitKind
from learn.quantities.quantity import Prediction, Quantity


class HowSplit(NamedTuple):
    """How the parts of a dataset were chosen, as ``bisplat.split`` takes it."""

    kind: SplitKind
    seed: int
    train_size: int | None
    guard: float


@dataclass(frozen=True)
class Known:
    """The rows of a dataset from which a method learns a quantity.

    Attributes:
        dataset: the dataset; a method must not use the values of rows that are not known.
        quantity: what is learned.
        parts: training and validation part, which are known, and the test part, which is not.
        seed: seed of everything that is random in the method itself.
        minutes: training time of a method that is trained by steps; None: no limit, ``steps`` is set.
        steps: number of training steps of such a method; None: as many as fit into ``minutes``.
        folder: the method's own folder, which is kept, so that an interrupted training can continue.
        how: how the parts were chosen; None: not by ``bisplat.split``.

    Example:
        >>> import bisplat
        >>> class Looks:
        ...     def fit(self, known):
        ...         print(known.positions.shape, known.values.shape, known.given)
        ...         self.mean = known.values.mean(axis=0)
        ...
        ...     def predict(self, positions):
        ...         return np.tile(self.mean, (len(positions), 1, 1))
        >>> comparison = bisplat.compare("data/lab", {"looks": Looks}, tested=4)
        (32, 3) (32, 90, 360) None
    """

    dataset: Any
    quantity: Quantity
    parts: Split
    seed: int = 0
    minutes: float | None = 5.0
    steps: int | None = None
    folder: Path | None = None
    how: HowSplit | None = None

    @classmethod
    def of(cls, dataset: Any, quantity: Quantity, rows: Int[np.ndarray, " n"], seed: int = 0) -> Known:
        """Some rows of a dataset, none of which is set aside for validation."""
        nothing = np.zeros(0, int)
        return cls(dataset, quantity, Split(train=np.sort(rows), validation=nothing, test=nothing), seed)

    def limits(self, own: int | None, usual: int) -> tuple[int, float | None]:
        """Largest number of training steps and of minutes; a method's own number of steps goes before ``steps``."""
        stated = self.steps if own is None else own
        return (usual, self.minutes) if stated is None else (stated, None)

    @property
    def rows(self) -> Int[np.ndarray, " n"]:
        """Indices of the known rows, of the training and the validation part."""
        return self.parts.known

    @property
    def positions(self) -> Any:
        """Known positions [n, 3], metres, world frame; None if the dataset has no positions."""
        return None if self.dataset.places is None else self.dataset.places[self.rows]

    @cached_property
    def values(self) -> Num[np.ndarray, "n ..."]:
        """The known values."""
        return self.quantity.of(self.dataset, self.rows)

    @cached_property
    def given(self) -> Num[np.ndarray, "n ..."] | None:
        """What is also given of the rows to be predicted, such as the uplink. None: nothing."""
        return self.quantity.given(self.dataset, self.rows)


class Method(Protocol):
    """A method that learns some values of a quantity and predicts others.

    It may also have ``unsuited(dataset)``, which says why it cannot be used on a dataset, or None; and the attributes
    ``steps`` and ``seconds`` of its training, ``parameters``, their number, and ``found``, what the fit found in words.
    The rows of a comparison state them. A method with ``learn(datasets, minutes, seed)`` learns in other rooms first.
    """

    def fit(self, known: Known) -> None:
        """Learn from known values."""

    def predict(
        self, positions: Float[np.ndarray, "K 3"], given: Num[np.ndarray, "K ..."] | None = None
    ) -> Prediction | Num[np.ndarray, "K ..."]:
        """Predict values at positions, metres, world frame; ``given`` only comes where ``known.given`` is not None."""


MakesMethod = Callable[[], Method]  # A class, or a function, that makes a new, unfitted method
