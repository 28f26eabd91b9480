"""Methods that predict responses over a band at new positions, by waves or networks with delays."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from learn.models.base import as_complex
from learn.models.kriging.band_field import BandField
from learn.models.networks.response_network import ResponseNetwork
from learn.quantities.known import Known
from learn.quantities.quantity import Prediction
from learn.training.fit_progress import train_steps
from learn.training.prediction import batches_for
from learn.training.registry import model_class, model_entry


class HelmholtzBand:
    """``BandField``: waves whose directions and delays are fitted."""

    found: str  # what the fit found, in words

    def fit(self, known: Known) -> None:
        dataset = known.dataset
        region = np.stack([known.positions.min(axis=0), known.positions.max(axis=0)])
        self._field = BandField(region, dataset.beamformer, dataset.wavelength)
        self.found = self._field.fit(dataset, known.rows)

    def predict(self, positions: Float[np.ndarray, "K 3"], given: Any = None) -> Prediction:
        value, deviation = self._field.at(positions)
        return Prediction(value, deviation=deviation)


PREDICTED_AT_ONCE = 128  # number of positions in a batch of a prediction


class LearnedBand:
    """A model of ``bisplat train`` that learns the gains of delays, with its own batch size, rate and weight decay."""

    model: ClassVar[str]  # its name
    by_steps: ClassVar[bool] = True  # it is trained for minutes, so a comparison has it only if it is named
    delays: Float[np.ndarray, " paths"]  # the learned delays, rising, seconds
    found: str  # the delays in words
    steps: int  # number of training steps that were made

    def __init__(self, steps: int | None = None):
        self._steps = steps

    def fit(self, known: Known) -> None:
        dataset, entry, responses = known.dataset, model_entry(self.model), known.values
        device = "cuda" if torch.cuda.is_available() else "cpu"
        self._scale = float(np.sqrt(np.square(np.abs(responses)).mean())) or 1.0
        pairs = torch.view_as_real(torch.from_numpy((responses / self._scale).astype(np.complex64))).to(device)
        places = torch.from_numpy(known.positions).float().to(device)
        region = np.stack([known.positions.min(axis=0), known.positions.max(axis=0)])
        settings = entry.by_steps
        assert settings is not None
        with torch.random.fork_rng():
            torch.manual_seed(known.seed)
            build: Any = model_class(self.model)
            network = build(region, dataset.beamformer, dataset.wavelength, **entry.options)
            assert isinstance(network, ResponseNetwork)
            network.adapt_to(dataset, known.rows)
            self.network = network.to(device)
            assert network.band is not None

            def loss() -> Tensor:
                drawn = torch.randperm(len(places))[: settings.batch_size].to(device)
                return network.responses_loss(places[drawn], pairs[drawn])

            optimiser = torch.optim.AdamW(network.groups(settings.weight_decay), lr=settings.learning_rate)
            most, minutes = known.limits(self._steps, settings.steps)
            self.steps = train_steps(loss, optimiser, title=self.model, most=most, minutes=minutes)
        assert dataset.band is not None
        self.delays = np.sort(network.band.delays.detach().double().cpu().numpy()) / dataset.band.spacing
        first, last = 1e9 * self.delays[[0, -1]]
        self.found = f"{len(self.delays)} delays from {first:.0f} to {last:.0f} ns"

    def predict(self, positions: Float[np.ndarray, "K 3"], given: Any = None) -> Prediction:
        band = self.network.band
        assert band is not None
        with torch.inference_mode():
            batches = batches_for(self.network, positions, PREDICTED_AT_ONCE)
            found = [as_complex(self.network.over_band(band, each)) for each in batches]
        return Prediction(self._scale * np.concatenate(found).astype(complex))


class ResponseMLPBand(LearnedBand):
    """``mlp-responses``: a network of the position predicts the gain of a few delays at each element."""

    model = "mlp-responses"


class ApertureBand(LearnedBand):
    """``bisplat-aperture``: Gaussians with a gain and a delay each, and an array that receives their field."""

    model = "bisplat-aperture"
