"""The methods that predict responses over a band at new positions, and what they learn from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np
import torch
from jaxtyping import Complex, Float, Int
from scipy.spatial import cKDTree
from torch import Tensor

from learn.baselines.kriging import Interpolator
from learn.baselines.neighbours import NEIGHBOURS
from learn.models.base import as_complex
from learn.models.capabilities import adapt_to
from learn.models.kriging.band_field import BandField
from learn.models.networks.response_network import ResponseNetwork
from learn.training.fit_progress import train_steps
from learn.training.prediction import batches_for
from learn.training.registry import model_class, model_entry
from scenes.files.errors import InputError
from simulate.dataset.dataset import Dataset


@dataclass(frozen=True)
class KnownBand:
    """Responses over a band at n known positions, from which a method learns.

    Attributes:
        dataset: the dataset; a method must use no other positions of it than the known ones.
        known: indices of the known positions, rising.
        seed: seed of everything that is random in a method.
        minutes: training time of a method that is trained by steps.

    Raises:
        InputError: the dataset has no responses over a band.
    """

    dataset: Dataset
    known: Int[np.ndarray, " n"]
    seed: int = 0
    minutes: float = 5.0

    def __post_init__(self) -> None:
        require_band(self.dataset)

    @property
    def positions(self) -> Float[np.ndarray, "n 3"]:
        """Known positions, metres, world frame."""
        return self.dataset.positions[self.known]

    @property
    def responses(self) -> Complex[np.ndarray, "n elements subcarriers"]:
        """Known responses, as recorded, not normalised."""
        assert self.dataset.band is not None
        return self.dataset.band_responses[self.known]

    @property
    def frequencies(self) -> Float[np.ndarray, " subcarriers"]:
        """Frequencies of the subcarriers, rising, Hz."""
        assert self.dataset.band is not None
        return self.dataset.band.frequencies(self.dataset.frequency.hertz)


@dataclass(frozen=True)
class PredictedBand:
    """Responses that a method predicts at K positions, in the units of the known ones."""

    responses: Complex[np.ndarray, "K elements subcarriers"]  # the predicted responses
    # stated standard deviation of the real and of the imaginary part of each response, the same for all elements and
    # subcarriers of a position. About 90 % of these parts are within 1.645 deviations. None: the method states none.
    deviation: Float[np.ndarray, " K"] | None = None


class BandMethod(Protocol):
    """A method that learns from known responses over a band and predicts others."""

    def fit(self, known: KnownBand) -> None:
        """Learn from known responses."""

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> PredictedBand:
        """Predict responses at positions in metres, world frame."""


def require_band(dataset: Dataset) -> None:
    """Refuse a dataset without responses over a band."""
    if dataset.band is None:
        found = "responses at the carrier alone" if "response" in dataset.values else "spectra alone"
        raise InputError(
            f"{dataset.folder}: expected responses over a band (bisplat simulate --bandwidth 20MHz --subcarriers 32), "
            f"found {found}"
        )


class Nearest:
    """The responses of the nearest known position."""

    neighbours = 1

    def fit(self, known: KnownBand) -> None:
        self._places, self._responses = cKDTree(known.positions), known.responses

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> PredictedBand:
        distance, index = self._places.query(positions, k=min(self.neighbours, self._places.n))
        weight = 1 / np.maximum(distance.reshape(len(positions), -1), 1e-9)
        weight /= weight.sum(axis=1, keepdims=True)
        near = self._responses[index.reshape(weight.shape)]
        return PredictedBand(np.einsum("kn,knas->kas", weight, near))


class InverseDistance(Nearest):
    """The mean of the responses of the four nearest known positions, weighted by 1 / distance."""

    neighbours = NEIGHBOURS


COMPONENTS = 8  # largest number of principal components over the subcarriers that ``Kriging`` interpolates


class Kriging:
    """Gaussian-process interpolation of all subcarriers, with one squared-exponential kernel for all.

    With one kernel, to interpolate each subcarrier is to interpolate their principal components, which are fewer.
    """

    def fit(self, known: KnownBand) -> None:
        responses = known.responses
        self._components = np.linalg.svd(responses.reshape(-1, responses.shape[2]), full_matrices=False)[2][:COMPONENTS]
        flat = (responses @ self._components.conj().T).reshape(len(responses), -1)
        self._shape = responses.shape[1], len(self._components)
        self._interpolator = Interpolator(known.positions, np.concatenate([flat.real, flat.imag], axis=1), known.seed)

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> PredictedBand:
        values, deviation = self._interpolator.with_deviation(positions)
        real, imaginary = np.split(values, 2, axis=1)
        responses = (real + 1j * imaginary).reshape(len(positions), *self._shape) @ self._components
        kept = len(self._components) / self._components.shape[1]
        return PredictedBand(responses, np.sqrt(kept * np.square(deviation).mean(axis=1)))


class HelmholtzBand:
    """``BandField``: waves whose directions and delays are fitted."""

    found: str  # what the fit found, in words

    def fit(self, known: KnownBand) -> None:
        dataset = known.dataset
        region = np.stack([known.positions.min(axis=0), known.positions.max(axis=0)])
        self._field = BandField(region, dataset.beamformer, dataset.wavelength)
        self.found = self._field.fit(dataset, known.known)

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> PredictedBand:
        return PredictedBand(*self._field.at(positions))


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

    def fit(self, known: KnownBand) -> None:
        dataset, entry, responses = known.dataset, model_entry(self.model), known.responses
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
            adapt_to(network, dataset, known.known)
            self._network = network.to(device)
            assert network.band is not None

            def loss() -> Tensor:
                drawn = torch.randperm(len(places))[: settings.batch_size].to(device)
                return network.responses_loss(places[drawn], pairs[drawn])

            optimiser = torch.optim.AdamW(network.groups(settings.weight_decay), lr=settings.learning_rate)
            most = settings.steps if self._steps is None else self._steps
            minutes = known.minutes if self._steps is None else None
            self.steps = train_steps(loss, optimiser, title=self.model, most=most, minutes=minutes)
        assert dataset.band is not None
        self.delays = np.sort(network.band.delays.detach().double().cpu().numpy()) / dataset.band.spacing
        first, last = 1e9 * self.delays[[0, -1]]
        self.found = f"{len(self.delays)} delays from {first:.0f} to {last:.0f} ns"

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> PredictedBand:
        band = self._network.band
        assert band is not None
        with torch.inference_mode():
            batches = batches_for(self._network, positions, PREDICTED_AT_ONCE)
            found = [as_complex(self._network.over_band(band, each)) for each in batches]
        return PredictedBand(self._scale * np.concatenate(found).astype(complex))


class ResponseMLPBand(LearnedBand):
    """``mlp-responses``: a network of the position predicts the gain of a few delays at each element."""

    model = "mlp-responses"


class ApertureBand(LearnedBand):
    """``bisplat-aperture``: Gaussians with a gain and a delay each, and an array that receives their field."""

    model = "bisplat-aperture"


BAND_METHODS: dict[str, Callable[[], BandMethod]] = {
    "nearest": Nearest,
    "inverse-distance": InverseDistance,
    "kriging": Kriging,
    "helmholtz": HelmholtzBand,
    "mlp-responses": ResponseMLPBand,
    "bisplat-aperture": ApertureBand,
}
"""Functions that make new, unfitted methods."""
