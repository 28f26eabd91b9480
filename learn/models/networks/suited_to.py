"""What an untrained model must know of a dataset: the array that moves, and the band."""

from __future__ import annotations

import numpy as np
import torch
from jaxtyping import Int
from scipy.spatial.transform import Rotation

from learn.models.base import SpectrumModel
from learn.models.capabilities import LearnsBand, SamplesOneField
from simulate.dataset.dataset import Dataset


def suit_to(model: SpectrumModel, dataset: Dataset, known: Int[np.ndarray, " n"]) -> None:
    """Suit an untrained model to a dataset, as far as it can be.

    If the receiver moves, it learns the one field that all elements sample. If there is a band, it learns the responses
    at all subcarriers.
    """
    if dataset.moving == "receiver" and isinstance(model, SamplesOneField):
        turn = Rotation.from_quat(dataset.gateway_orientation).as_matrix()
        model.sample_one_field(torch.from_numpy(turn).float())
    if dataset.band_responses is not None and isinstance(model, LearnsBand):
        model.learn_band(dataset.band_responses[known])
