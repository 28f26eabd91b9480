"""Kriging of one field that all elements of a moving array sample."""

from __future__ import annotations

from functools import partial

import numpy as np
import torch
from jaxtyping import Float, Int
from scipy.spatial.transform import Rotation
from torch import Tensor

from learn.models.kriging.kriged_field import KrigedField
from learn.models.kriging.vecchia import fit_covariance
from simulate.dataset.dataset import Dataset
from simulate.spectra.array import PlanarArray
from simulate.spectra.beamformer import Beamformer

SAMPLES = 256
"""Number of nearest samples from which a prediction is made, in whole arrays."""


class OneField(KrigedField):
    """Interpolates the field of a fixed transmitter, from its samples at all elements and all known places of an array.

    If the receiver moves, all elements sample one field: y_m(r) = y(r + d_m), with the offset d_m of element m from the
    middle of the array. Kriging from all these samples tells more than kriging each element's response by itself.
    """

    def __init__(self, region: Float[np.ndarray, "2 3"], beamformer: Beamformer, wavelength: float):
        super().__init__(region, beamformer, wavelength, "responses")
        self._grid = beamformer.grid
        self._elements: Float[np.ndarray, "elements 3"] = float(self.wavelength) * beamformer.array.positions
        self.neighbours = max(2, SAMPLES // len(self._elements))
        self.register_buffer("offsets", torch.zeros(len(self._elements), 3))

    def keep(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> None:
        """As for ``KrigedField``. The elements are turned as the dataset's gateway is."""
        super().keep(dataset, known)
        self.offsets = torch.from_numpy(Rotation.from_quat(dataset.gateway_orientation).apply(self._elements)).float()

    def _maximise_likelihood(self) -> None:
        of = self._of_samples()
        fit_covariance(of, of.neighbours, partial(self.report, "covariance of responses"))
        self.shares, self.length, self.drift, self.nugget = of.shares, of.length, of.drift, of.nugget

    def _of_samples(self) -> KrigedField:
        """The same field as sampled by a single element, which stands at all places of the elements in turn."""
        single = Beamformer(PlanarArray(1, 1), self._grid)
        found = KrigedField(self.region.numpy(), single, float(self.wavelength), "responses")
        found.places = (self.places[:, None] + self.offsets).flatten(0, 1)
        found.times = self.times.repeat_interleave(len(self.offsets))
        found.values, found.mean = self.values.reshape(-1, 2), torch.zeros(2)
        return found

    def _quickly(self, positions: Float[Tensor, "B 3"]) -> None:
        """None: the compiled loop krigs each element by itself."""

    def beamformed(self) -> None:
        """None: the large covariances of many positions at once would not fit into memory."""
