"""What a model that interpolates keeps: where spectra are known, and the responses or pictures there."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from jaxtyping import Float, Int
from torch import Tensor

from learn.models.base import BeamformingLayer, Kept, SpectrumModel
from simulate.dataset.dataset import Dataset
from simulate.spectra.angular_grid import COLUMNS, ROWS
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import LARGEST_GREY

KEPT = 2000  # largest number of known spectra that are kept once they are computed, 260 MB


class InterpolatingModel(SpectrumModel):
    """Base class of the models that keep known spectra. A file of weights may have any number of them."""

    places: Tensor  # n known positions of the end that moves, metres, world frame
    times: Tensor  # index of each known spectrum in its dataset
    values: Tensor  # responses (real, imaginary), scaled to a mean square magnitude of 1, or 8-bit pictures; flattened
    mean: Tensor  # mean of ``values`` over the known spectra; zero for responses

    def __init__(self, region: Float[np.ndarray, "2 3"], beamformer: Beamformer, wavelength: float, of_responses: bool):
        super().__init__(region, wavelength)
        self.beamforming = BeamformingLayer(beamformer)
        self.of_responses = of_responses
        numbers = 2 * beamformer.array.elements if of_responses else ROWS * COLUMNS
        self.register_buffer("places", torch.zeros(0, 3))
        self.register_buffer("times", torch.zeros(0))
        self.register_buffer("values", torch.zeros(0, numbers))
        self.register_buffer("mean", torch.zeros(numbers))
        self._spectra: Kept[Tensor] = Kept()

    def keep(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> None:
        """Interpolate between these spectra from now on, with the same covariance."""
        self.places = torch.from_numpy(dataset.positions[known]).float()
        self.times = torch.from_numpy(known).float()
        if self.of_responses:
            assert dataset.responses is not None
            responses = torch.from_numpy(dataset.responses[known])
            root_mean_square = responses.abs().square().mean().sqrt()
            if root_mean_square > 0:  # pictures of one grey level have responses of zero
                responses = responses / root_mean_square
            self.values = torch.view_as_real(responses).flatten(1)
            self.mean = torch.zeros(self.values.shape[1])
        else:
            self.values = torch.from_numpy(dataset.pictures[known]).flatten(1)
            self.mean = torch.from_numpy(dataset.pictures[known].mean(axis=0, dtype=np.float64).ravel()).float()

    def known_spectra(self, members: Int[Tensor, "*b n"]) -> Float[Tensor, "*b n 90 360"]:
        """Spectra at known positions."""
        values = self.values[members].float()
        return self._as_spectra(values.flatten(0, -2)).unflatten(0, members.shape)

    def all_known_spectra(self) -> Float[Tensor, "n 90 360"] | None:
        """Spectra at all known positions, which are computed once. None: there are too many to keep."""
        known = torch.arange(len(self.places))
        return None if len(known) > KEPT else self._spectra.of([self.values], lambda: self.known_spectra(known))

    def _as_spectra(self, values: Float[Tensor, "n C"]) -> Float[Tensor, "n 90 360"]:
        if self.of_responses:
            return self.beamforming(values.unflatten(-1, (-1, 2)))
        return (values / LARGEST_GREY).clamp(0, 1).unflatten(-1, (ROWS, COLUMNS))

    def load_state_dict(self, state_dict: Mapping[str, Any], strict: bool = True, assign: bool = False) -> Any:
        """As ``torch.nn.Module.load_state_dict``, but for the number of known spectra that the file has."""
        known = len(state_dict["times"]) if state_dict.get("times", torch.zeros(())).ndim else 0
        if not known:
            raise RuntimeError("no known spectra")
        for name in ("places", "times", "values"):
            shape = (known, *getattr(self, name).shape[1:])
            if name in state_dict and state_dict[name].shape != shape:  # checked before memory is allocated
                raise RuntimeError(f"{name} of shape {tuple(state_dict[name].shape)} instead of {shape}")
            grey_levels = name == "values" and not self.of_responses
            setattr(self, name, torch.zeros(shape, dtype=torch.uint8 if grey_levels else torch.float32))
        return super().load_state_dict(state_dict, strict, assign)
