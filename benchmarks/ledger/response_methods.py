"""Methods that predict complex responses at new positions from known ones, whatever the number of elements."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import torch
from jaxtyping import Complex, Float
from scipy.spatial import cKDTree

from learn.methods.interpolation import Interpolator
from learn.models.kriging.kriged_field import KrigedField
from learn.models.kriging.vecchia import fit_covariance
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer

Predict = Callable[[Float[np.ndarray, "K 3"]], Complex[np.ndarray, "K E"]]

NEIGHBOURS = 4


class Known(NamedTuple):
    """Known responses of E antennas that stand still to one that moves."""

    positions: Float[np.ndarray, "n 3"]  # known positions of the one that moves, metres
    responses: Complex[np.ndarray, "n E"]  # responses there
    others: Float[np.ndarray, "E 3"]  # positions of the antennas that stand still, metres
    wavelength: float  # metres
    ways: int  # 2 if the responses are of the way there and back, otherwise 1

    def direct(self, positions: Float[np.ndarray, "K 3"]) -> Complex[np.ndarray, "K E"]:
        """Direct paths e^{−jkd} / d, or the squares of them."""
        distance = np.linalg.norm(positions[:, None] - self.others, axis=-1)
        return (np.exp(-2j * np.pi * distance / self.wavelength) / distance) ** self.ways

    @property
    def gain(self) -> Complex[np.ndarray, " E"]:
        """The factor of each antenna's direct path that fits the known responses best."""
        direct = self.direct(self.positions)
        return (direct.conj() * self.responses).sum(axis=0) / np.square(np.abs(direct)).sum(axis=0)


def free_space(known: Known) -> Predict:
    """The direct path, with the fitted amplitude and phase of each antenna."""
    return lambda positions: known.gain * known.direct(positions)


def by_distance(known: Known, neighbours: int) -> Predict:
    """The mean of the nearest known responses, weighted by 1 / distance."""
    tree = cKDTree(known.positions)

    def predict(positions: Float[np.ndarray, "K 3"]) -> Complex[np.ndarray, "K E"]:
        distance, index = tree.query(positions, k=[*range(1, neighbours + 1)])
        weight = 1 / np.maximum(distance, 1e-9)
        return np.einsum("kn,kne->ke", weight / weight.sum(axis=1, keepdims=True), known.responses[index])

    return predict


def kriging(known: Known) -> Predict:
    """Kriging of the responses with a squared-exponential covariance."""
    return _kriged(known.positions, known.responses)


def kriged_gain(known: Known) -> Predict:
    """The direct path, times its gain: the known responses, relative to the direct path, about their fitted mean."""
    kriged = _kriged(known.positions, known.responses / known.direct(known.positions) - known.gain)
    return lambda positions: (kriged(positions) + known.gain) * known.direct(positions)


def helmholtz(known: Known) -> Predict:
    """Kriging with the directional covariance of ``helmholtz``, one for all antennas."""
    region = np.stack([known.positions.min(axis=0), known.positions.max(axis=0)])
    # The square of a plane wave has twice its wavenumber.
    field = KrigedField(region, Beamformer(PlanarArray(1, 1)), known.wavelength / known.ways, "responses")
    field.places = torch.from_numpy(known.positions).float()
    field.times = torch.arange(len(known.positions)).float()
    level = np.sqrt(np.square(np.abs(known.responses)).mean())
    values = torch.from_numpy(known.responses / level).to(torch.complex64)
    field.values = torch.view_as_real(values).flatten(1)
    field.mean = torch.zeros(field.values.shape[1])
    fit_covariance(field, field.neighbours)

    def predict(positions: Float[np.ndarray, "K 3"]) -> Complex[np.ndarray, "K E"]:
        with torch.inference_mode():
            found = field.responses(torch.from_numpy(positions).float()).contiguous()
        return level * torch.view_as_complex(found).numpy()

    return predict


def _kriged(positions: Float[np.ndarray, "n 3"], values: Complex[np.ndarray, "n E"]) -> Predict:
    interpolator = Interpolator(positions, np.concatenate([values.real, values.imag], axis=1), 0)

    def predict(new: Float[np.ndarray, "K 3"]) -> Complex[np.ndarray, "K E"]:
        real, imaginary = np.split(interpolator(new), 2, axis=1)
        return real + 1j * imaginary

    return predict


METHODS: dict[str, Callable[[Known], Predict]] = {
    "free space": free_space,
    "nearest": lambda known: by_distance(known, 1),
    "inverse distance": lambda known: by_distance(known, NEIGHBOURS),
    "kriging-responses": kriging,
    "helmholtz": helmholtz,
    "kriged gain of free space": kriged_gain,
}
"""Functions from what is known to a function that predicts."""
