"""What is kept is made again once a tensor is replaced or changed, and is not copied."""

import copy
import pickle

import torch

from learn.models.base import Kept


def test_it_is_made_again_for_other_or_changed_tensors_only():
    kept, tensor, calls = Kept(), torch.ones(3), []

    def total(given: torch.Tensor) -> float:
        def make() -> float:
            calls.append(given)
            return float(given.sum())

        return kept.of([given], make)

    assert [total(tensor), total(tensor)] == [3, 3] and len(calls) == 1
    tensor[1] = 5
    assert [total(tensor), total(tensor)] == [7, 7] and len(calls) == 2
    assert total(tensor.clone()) == 7 and len(calls) == 3


def test_copies_are_empty():
    kept, tensor = Kept(), torch.ones(3)
    kept.of([tensor], lambda: 1)
    for other in (copy.deepcopy(kept), pickle.loads(pickle.dumps(kept))):
        assert other.of([tensor], lambda: 2) == 2
    assert kept.of([tensor], lambda: 3) == 1
