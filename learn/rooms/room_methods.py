"""Methods for rooms never seen before: some learn in the known spectra of a room alone, some in other rooms."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
import torch
from jaxtyping import Float
from pytorch_msssim import ssim as gaussian_ssim
from torch import Tensor, nn

from learn.models.images.image_field import ImageField
from learn.models.kriging.helmholtz import HelmholtzField
from learn.models.quadrature import L1_WEIGHT, SIGMA, SSIM_WEIGHT, WINDOW
from learn.quantities.known import Known
from learn.quantities.quantity import Prediction
from learn.rooms.neighbour_attention import NeighbourAttention, RoomTensors, local_places, to_all_pixels
from learn.training.prediction import predict
from scenes.files.plain_text import say
from simulate.dataset.dataset import Dataset

NEAREST = 16  # Largest number of known spectra, the nearest ones, that the network attends to

LEAST, MOST = 5, 100
"""Range of the number of known spectra in a training step, drawn evenly in its logarithm."""

BATCH, LEARNING_RATE, WARM_UP = 6, 3e-3, 50
"""Targets in a training step; the rate of Adam, which rises over ``WARM_UP`` steps and falls to 0 at the end."""

AT_ONCE = 16  # Positions that are predicted at once


class HelmholtzInRoom:
    """``helmholtz``, fitted to the known spectra and responses of the room alone."""

    field: ClassVar[type[HelmholtzField | ImageField]] = HelmholtzField

    def fit(self, room: Known) -> None:
        dataset = room.dataset
        region = np.stack([room.positions.min(axis=0), room.positions.max(axis=0)])
        self._model = self.field(region, dataset.beamformer, dataset.wavelength)
        self._model.fit(dataset, room.rows)

    def predict(self, positions: Float[np.ndarray, "K 3"], given: Any = None) -> Prediction:
        return Prediction(predict(self._model, positions).spectra)


class HelmholtzOfPictures(HelmholtzInRoom):
    """``helmholtz``, fitted to the pictures of the room alone, as the methods that learn in other rooms see them."""

    def fit(self, room: Known) -> None:
        super().fit(replace(room, dataset=room.dataset.with_values(response=None)))


class MirrorImagesInRoom(HelmholtzInRoom):
    """``mirror-images``, fitted to the known responses of the room alone, with the gateway's place and orientation."""

    field = ImageField


class AttentionOverNeighbours:
    """``NeighbourAttention`` as a method of ``compare``: trained in other rooms, given a room's neighbours."""

    by_steps = True

    def __init__(self) -> None:
        self.steps = 0
        self._network = NeighbourAttention()

    def learn(self, rooms: Sequence[Dataset], minutes: float, seed: int) -> None:
        """Train in rooms."""
        torch.manual_seed(seed)
        generator = np.random.default_rng(seed)
        self._network = NeighbourAttention()
        tensors = [RoomTensors.of(dataset, np.arange(len(dataset))) for dataset in rooms]
        optimiser = torch.optim.Adam(self._network.parameters(), LEARNING_RATE)
        began, self.steps = time.monotonic(), 0
        while (passed := (time.monotonic() - began) / (60 * minutes)) < 1 or not self.steps:
            room = tensors[generator.integers(len(tensors))]
            rate = LEARNING_RATE * min(1.0, (self.steps + 1) / WARM_UP) * max(0.0, 1 - passed)
            optimiser.param_groups[0]["lr"] = rate
            optimiser.zero_grad()
            loss = self._loss(room, generator)
            loss.backward()
            nn.utils.clip_grad_norm_(self._network.parameters(), 1.0)
            optimiser.step()
            self.steps += 1
            if self.steps % 100 == 0:
                say(f"attention: step {self.steps}, loss {loss.item():.4f}")

    def fit(self, room: Known) -> None:
        """Keep the known spectra of a room."""
        self._room = room
        self._tensors = RoomTensors.of(room.dataset, room.rows)

    def predict(self, positions: Float[np.ndarray, "K 3"], given: Any = None) -> Prediction:
        """Predict in this room; the weights are interpolated to all pixels."""
        spectra, room = torch.from_numpy(self._room.values).float(), self._tensors
        predicted = []
        with torch.inference_mode():
            for targets in local_places(self._room.dataset, positions).split(AT_ONCE):
                near = torch.cdist(targets, room.places).topk(min(NEAREST, len(spectra)), largest=False).indices
                shares, correction = self._network(targets, room.places[near], room.pictures[near], room.directions)
                mean = (to_all_pixels(shares) * spectra[near]).sum(dim=1)
                predicted.append((mean + to_all_pixels(correction[:, None])[:, 0]).clamp(0, 1))
        return Prediction(torch.cat(predicted).numpy())

    def _loss(self, room: RoomTensors, generator: np.random.Generator) -> Float[Tensor, ""]:
        """The loss of some targets in a room, of which a random number of other spectra are known."""
        batch = min(BATCH, len(room.places) // 2)
        order = torch.from_numpy(generator.permutation(len(room.places)))
        size = int(np.exp(generator.uniform(np.log(LEAST), np.log(MOST))))
        targets, known = order[:batch], order[batch : batch + max(1, size)]
        distance = torch.cdist(room.places[targets], room.places[known])
        near = known[distance.topk(min(NEAREST, len(known)), largest=False).indices]
        pictures = room.pictures[near]
        shares, correction = self._network(room.places[targets], room.places[near], pictures, room.directions)
        predicted, truth = (shares * pictures).sum(dim=1) + correction, room.pictures[targets]
        alike = gaussian_ssim(predicted[None], truth[None], data_range=1.0, win_size=WINDOW, win_sigma=SIGMA)
        return L1_WEIGHT * (predicted - truth).abs().mean() + SSIM_WEIGHT * (1 - alike)
