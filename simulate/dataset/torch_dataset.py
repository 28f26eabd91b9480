"""Spectra as a dataset of PyTorch, for training loops of one's own."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from jaxtyping import Int
from torch.utils import data

from scenes.files.errors import ParameterError, shown
from simulate.spectra.spectrum import spectrum_of


class TorchDataset(data.Dataset[dict[str, torch.Tensor]]):
    """Spectra of a dataset for ``torch.utils.data.DataLoader``, as ``Dataset.torch`` explains it."""

    def __init__(self, dataset: Any, indices: Int[np.ndarray, " n"] | Sequence[int] | None = None):
        self.dataset = dataset
        self.indices = np.arange(len(dataset)) if indices is None else _checked(indices, len(dataset))

    def __len__(self) -> int:
        return len(self.indices)

    def __repr__(self) -> str:
        return f"TorchDataset({len(self)} of {len(self.dataset)} spectra of {str(self.dataset.folder)!r})"

    def __getitem__(self, item: int) -> dict[str, torch.Tensor]:
        index = self.indices[item]
        found = {
            "position": torch.from_numpy(self.dataset.positions[index].astype(np.float32)),
            "spectrum": torch.from_numpy(spectrum_of(self.dataset.pictures[index])),
        }
        if self.dataset.moving == "both":
            found["receiver"] = torch.from_numpy(self.dataset.receivers[index].astype(np.float32))
        if "response" in self.dataset.values:
            found["responses"] = torch.from_numpy(self.dataset.responses[index].astype(np.complex64))
        return found


def _checked(indices: Int[np.ndarray, " n"] | Sequence[int], count: int) -> Int[np.ndarray, " n"]:
    """Indices that a user gave."""
    try:
        found = np.asarray(indices)
    except ValueError:  # lists of different lengths
        found = np.array(None)
    if found.ndim != 1 or not (np.issubdtype(found.dtype, np.integer) or not len(found)):
        raise ParameterError("rows", f"expected a list of whole numbers, found {shown(indices)}")
    outside = found[(found < 0) | (found >= count)]
    if len(outside):
        raise ParameterError("rows", f"expected numbers from 0 to {count - 1}, found {outside[0]}")
    return found.astype(int)
