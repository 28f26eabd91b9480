"""Waves of the gateway's mirror images in the planes of a room, and kriging of the rest."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import torch
from jaxtyping import Float, Int
from scipy.spatial.transform import Rotation
from torch import Tensor

from learn.models.base import Region, runs_compiled
from learn.models.capabilities import PredictsResponses, no_comparable_phases
from learn.models.images.image_search import ImageSearch, offsets_of, waves_of
from learn.models.images.mirror_images import image_waves
from learn.models.kriging.kriged_field import KrigedField
from scenes.files.errors import InputError
from simulate.dataset.dataset import Dataset
from simulate.dataset.receivers import ArrayReceiver
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import evenly

COARSE = 5  # step of the angles that are tried first, degrees. Around the best one, whole degrees are tried.

CLEAR = 0.25
"""Least gain of the log-likelihood of each response over that of walls along the axes. For less, walls are not turned:
most descriptions of rooms have them along the axes, and an angle that is a few degrees off changes little."""


def angle_of_walls(likelihood: Callable[[int], float]) -> int:
    """The angle of perpendicular walls from the x axis, degrees, 0…89."""
    tried = {degrees: likelihood(degrees) for degrees in range(0, 90, COARSE)}
    best = max(tried, key=tried.__getitem__)
    for each in range(best - COARSE + 1, best + COARSE):
        degrees = each % 90
        tried[degrees] = tried[degrees] if degrees in tried else likelihood(degrees)
    best = max(tried, key=tried.__getitem__)
    return best if tried[best] > tried[0] + CLEAR else 0


def frame_of_walls(degrees: int) -> Float[np.ndarray, "3 3"]:
    """The rotation matrix from the world frame to a frame whose axes run along the walls and up."""
    return Rotation.from_euler("z", -degrees, degrees=True).as_matrix()


def in_frame(dataset: Dataset, frame: Float[np.ndarray, "3 3"]) -> Dataset:
    """A dataset whose world frame is another one."""
    turn = Rotation.from_matrix(frame)
    gateway = ArrayReceiver(
        turn.apply(dataset.gateway_position),
        (turn * Rotation.from_quat(dataset.gateway_orientation)).as_quat(),
        dataset.identification,
    )
    return replace(dataset, places=turn.apply(dataset.positions), receiver=gateway)


FITTED_ON = 128  # largest number of known spectra, evenly spread, in which the images are found

LEAST_TURNED, TURNED_ON, PLACES = 200, 400, 8
"""Least and largest number of responses, of evenly spread spectra, that tell the angle of the walls, but at least those
of so many spectra. With fewer responses, the walls are taken to run along the axes."""


class ImageField(PredictsResponses):
    """Adds up waves of the gateway and of its mirror images, and adds kriging of what these do not explain.

    ``y_m(r) = Σ_j x_j e^{−jk R}/R + e_m(r)``, ``R = |r − c_j − S_j d_m|``

    j runs over the gateway itself and its images in one and in two planes. ``most_likely`` finds their amplitudes x_j,
    most of which are zero, ``angle_of_walls`` the direction of the planes, and ``KrigedField`` interpolates the rest e.
    """

    frame: Tensor  # rotation matrix from the world frame to that of the walls
    # c_j of the gateway and of the images that have an amplitude, metres, in the frame of the walls; none before
    # ``fit``
    middles: Tensor
    signs: Tensor  # S_j
    amplitudes: Tensor  # x_j (real, imaginary), for R in wavelengths
    offsets: Tensor  # d_m, metres, in the frame of the walls
    power: Tensor  # mean of ``|e|²`` over the known spectra and elements
    whole_power: Tensor  # the same mean of the known responses

    def __init__(self, region: Region, beamformer: Beamformer, wavelength: float):
        super().__init__(region, beamformer, wavelength)
        for name, width in (("middles", 3), ("signs", 3), ("amplitudes", 2)):
            self.register_buffer(name, torch.zeros(0, width))
        self.register_buffer("frame", torch.eye(3))
        self.register_buffer("offsets", torch.zeros(beamformer.array.elements, 3))
        self.register_buffer("power", torch.zeros(()))
        self.register_buffer("whole_power", torch.zeros(()))
        self.rest = KrigedField(region, beamformer, wavelength, "responses")

    def responses(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B elements 2"]:
        """Element responses y (real, imaginary), in the units of the known ones."""
        return self._of_images(positions @ self.frame.T) + self.power.sqrt() * self.rest.responses(positions)

    def _of_images(self, places: Float[Tensor, "B 3"]) -> Float[Tensor, "B elements 2"]:
        """The sum over the images at places in the frame of the walls; a prediction has double precision for phases."""
        numbers = (places, self.middles, self.signs, self.offsets, self.wavelength, self.amplitudes)
        *of_waves, amplitudes = (each.double() for each in numbers) if runs_compiled(places) else numbers
        real, imaginary = image_waves(*of_waves)
        x, y = amplitudes.unbind(dim=1)  # real numbers, since ONNX has no complex ones
        return torch.stack([real @ x - imaginary @ y, real @ y + imaginary @ x], dim=-1).float()

    def uncertainty(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, " B"]:
        """Variance of e relative to the power of the responses. The amplitudes count as known."""
        share = self.power / self.whole_power.clamp_min(1e-30)
        return (share * self.rest.uncertainty(positions)).clamp(0, 1)

    @classmethod
    def unsuited(cls, dataset: Dataset) -> str | None:
        """Why the images cannot be found in a dataset: it has no responses, or another end moves."""
        if "response" not in dataset.values:  # their phases tell mirror images
            return no_comparable_phases(dataset)
        if dataset.moving != "transmitter":
            found = "a receiver that moves" if dataset.moving == "receiver" else "both ends moving"
            return f"expected a transmitter that moves before a gateway that stands still, found {found}"
        return None

    def fit(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> str:
        """Find the angle of the walls and the images in the known responses, and fit the covariance of the rest."""
        unsuited = self.unsuited(dataset)
        if unsuited is not None:
            raise InputError(f"{dataset.folder}: {unsuited}")
        degrees = self._angle(dataset, np.unique(known))
        self.frame = torch.from_numpy(frame_of_walls(degrees)).float()
        self.refit(dataset, known)
        explained = 1 - float(self.power / self.whole_power.clamp_min(1e-30))
        images = f"{max(len(self.middles) - 1, 0)} mirror images of it"
        walls = f" in walls turned by {degrees}°" if degrees else ""
        return f"the gateway and {images}{walls} explain {explained:.0%} of the power"

    def refit(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> None:
        """As ``fit``, with the angle of the walls that it found."""
        known = np.unique(known)
        turned = in_frame(dataset, self.frame.double().cpu().numpy())
        images, amplitudes = ImageSearch(turned, evenly(known, FITTED_ON)).found(self.report)
        explained = waves_of(images, turned, known) @ amplitudes
        of_images = images.middles, images.signs, offsets_of(turned)
        # Contiguous, as loaded ones are: with other strides a prediction takes several times as long.
        self.middles, self.signs, self.offsets = (
            torch.from_numpy(np.ascontiguousarray(each)).float() for each in of_images
        )
        self.amplitudes = torch.view_as_real(torch.from_numpy(amplitudes)).float()
        rest = np.zeros_like(dataset.responses)
        rest[known] = dataset.responses[known] - explained
        self.power, self.whole_power = (
            torch.tensor(float((np.abs(values[known].astype(complex)) ** 2).mean()))
            for values in (rest, dataset.responses)
        )
        self.rest.report = self.report  # type: ignore[method-assign]
        self.rest.fit(dataset.with_values(response=rest), known)

    def _angle(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> int:
        """The angle of the walls, degrees."""
        elements = dataset.array.elements
        if len(known) < PLACES or len(known) * elements < LEAST_TURNED:
            return 0
        known = evenly(known, max(PLACES, TURNED_ON // elements))
        self.report("angle of the walls", 0, 1)

        def likelihood(degrees: int) -> float:
            return ImageSearch(in_frame(dataset, frame_of_walls(degrees)), known).likelihood()

        return angle_of_walls(likelihood)

    def _load_from_state_dict(self, state_dict: Mapping[str, Tensor], prefix: str, *others: Any) -> None:
        """As for ``torch.nn.Module``, but for the number of images that the file has."""
        middles = state_dict.get(f"{prefix}middles", self.middles)
        images = len(middles) if middles.ndim else 0
        for name in ("middles", "signs", "amplitudes"):
            setattr(self, name, torch.zeros(images, getattr(self, name).shape[1]))
        super()._load_from_state_dict(state_dict, prefix, *others)
