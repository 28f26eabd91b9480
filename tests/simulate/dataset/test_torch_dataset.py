"""Spectra and responses as a dataset of PyTorch."""

import numpy as np
import pytest
import torch
from torch.utils.data import DataLoader

from simulate.dataset.dataset_folder import read_dataset
from simulate.dataset.torch_dataset import TorchDataset


@pytest.fixture(scope="module")
def dataset(tiny):
    return read_dataset(tiny)


def test_items_are_those_of_the_indices_in_their_order(dataset):
    chosen = TorchDataset(dataset, [5, 2])
    assert len(chosen) == 2
    for item, index in zip(chosen, (5, 2), strict=True):
        np.testing.assert_array_equal(item["position"], dataset.positions[index].astype(np.float32))
        np.testing.assert_array_equal(item["spectrum"], dataset.pictures[index] / np.float32(255))
        assert item["spectrum"].dtype == item["position"].dtype == torch.float32
    assert len(TorchDataset(dataset)) == len(dataset)
    assert repr(chosen) == f"TorchDataset(2 of {len(dataset)} spectra of {str(dataset.folder)!r})"


def test_a_loader_stacks_items_and_responses_where_there_are_any(dataset):
    responses = np.arange(16 * len(dataset)).reshape(-1, 16) * (1 + 2j)
    (batch,) = DataLoader(TorchDataset(dataset.with_values(response=responses), [3, 4]), batch_size=2)
    np.testing.assert_array_equal(batch["responses"], responses[[3, 4]].astype(np.complex64))
    assert "responses" not in TorchDataset(dataset.with_values(response=None))[0]
