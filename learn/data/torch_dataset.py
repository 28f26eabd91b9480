"""Spectra as a dataset of PyTorch, for training loops of one's own."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Int
from torch.utils import data

from scenes.files.errors import ParameterError, require_instance, shown
from simulate.dataset.dataset import Dataset
from simulate.spectra.spectrum import spectrum_of


class TorchDataset(data.Dataset[dict[str, torch.Tensor]]):
    """Spectra of a dataset for ``torch.utils.data.DataLoader``.

    Each item is a dictionary with these entries:

    - "position", the position of the end that moves, metres, world frame, [3], float32;
    - "receiver", the middle of the array; only if both ends move, and "position" is then the transmitter's;
    - "spectrum", the spectrum, 0…1, [90, 360], float32;
    - "responses", the recorded element responses, [elements], complex64; only if the dataset has any.

    Args:
        dataset: the dataset.
        indices: which of its spectra, in this order, such as one part of ``bisplat.split``. None: all.

    Raises:
        ParameterError: ``indices`` are not whole numbers, or the dataset has no spectrum with one of them.

    Example:
        >>> import bisplat, torch
        >>> dataset = bisplat.read_dataset("data/lab")
        >>> parts = bisplat.split(dataset, "random", seed=0)
        >>> train = bisplat.TorchDataset(dataset, parts.train)
        >>> len(train) == len(parts.train)
        True
        >>> batch = next(iter(torch.utils.data.DataLoader(train, batch_size=4, shuffle=True)))
        >>> batch["position"].shape, batch["spectrum"].shape, batch["responses"].shape
        (torch.Size([4, 3]), torch.Size([4, 90, 360]), torch.Size([4, 16]))
    """

    def __init__(self, dataset: Dataset, indices: Int[np.ndarray, " n"] | Sequence[int] | None = None):
        require_instance(Dataset, dataset=dataset)
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
        raise ParameterError("indices", f"expected a list of whole numbers, found {shown(indices)}")
    outside = found[(found < 0) | (found >= count)]
    if len(outside):
        raise ParameterError("indices", f"expected numbers from 0 to {count - 1}, found {outside[0]}")
    return found.astype(int)
