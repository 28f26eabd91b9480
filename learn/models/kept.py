"""What is computed from tensors and kept while these do not change."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Generic, TypeVar

import torch
from torch import Tensor

T = TypeVar("T")
State = tuple[Tensor, tuple[int, torch.device, torch.dtype]]
"""A tensor, and what changes with its values where it stays the same object: its version, device and type."""


class Kept(Generic[T]):
    """Keeps what was last made of some tensors, until these are replaced or changed in place. A copy is empty."""

    def __init__(self) -> None:
        self._made: tuple[list[State], T] | None = None

    def of(self, tensors: Sequence[Tensor], make: Callable[[], T]) -> T:
        """What ``make`` returns, which is called only if other tensors are given than the last time.

        >>> import torch
        >>> kept, tensor = Kept(), torch.zeros(2)
        >>> [kept.of([tensor], lambda: float(tensor.sum())), kept.of([tensor], lambda: 7.0)]
        [0.0, 0.0]
        >>> kept.of([tensor.add_(1)], lambda: float(tensor.sum()))
        2.0
        """
        versions = [(each, (0 if each.is_inference() else each._version, each.device, each.dtype)) for each in tensors]
        if self._made is None or not _same(self._made[0], versions):
            self._made = versions, make()
        return self._made[1]

    def __deepcopy__(self, memo: dict[int, Any]) -> Kept[T]:
        return Kept()

    def __getstate__(self) -> dict[str, Any]:
        return {"_made": None}


def _same(some: list[State], others: list[State]) -> bool:
    pairs = zip(some, others, strict=True)
    return all(one is other and version == changed for (one, version), (other, changed) in pairs)
