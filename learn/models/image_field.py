"""Waves of the gateway's mirror images in the planes of a room, and kriging of the rest."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import torch
from jaxtyping import Complex, Float, Int
from scipy.linalg import cholesky, solve_triangular
from scipy.spatial.transform import Rotation
from torch import Tensor

from learn.models.capabilities import PredictsResponses
from learn.models.image_strengths import most_likely
from learn.models.kriged_field import KrigedField
from learn.models.mirror_images import Images, gateway_and_first_images, image_waves, second_images, together
from scenes.files.errors import InputError
from simulate.dataset.dataset_folder import Dataset
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.spectrum import evenly

FITTED_ON = 128
"""Largest number of known spectra, evenly spread, in which the images are found."""

ITERATIONS = 30
"""Iterations of ``most_likely`` for the images in one plane, and again with those in two."""

OF_REST, NUGGET = 2.0, 0.05
"""Length over which the rest is alike, wavelengths, and its nugget, as long as they are not fitted."""

IMAGES, REST = 0.7, 0.3
"""Shares of the power that the images and the rest have at the start of the search."""

WEAK, PERPENDICULAR, PARALLEL = 1e-3, 3e-3, 3e-4
"""Variances relative to the largest one: below which an image in one plane is left out before those in two are added,
and with which the images in two perpendicular and in two parallel planes start."""


class ImageField(PredictsResponses):
    """Adds up waves of the gateway and of its mirror images, and adds kriging of what these do not explain.

    A wall that reflects a wave makes it look as if it came from a mirror image of its source. By reciprocity, the
    gateway's images in the planes of a room send spherical waves to the transmitter. Element m at offset d_m has in the
    image with the middle c_j and the signs S_j of its coordinates the place ``c_j + S_j d_m``, so its response is::

        y_m(r) = Σ_j x_j e^{−jk R}/R + e_m(r),   R = |r − c_j − S_j d_m|

    One amplitude x_j thus explains all elements at all positions. j runs over the gateway itself and its images in
    planes at hundreds of distances, and then over those in two planes, of which the second repeat the strongest of the
    first. ``most_likely`` finds the strengths of them all; most are zero. ``KrigedField`` interpolates the rest e.
    Nothing is told of the room but the directions of its walls: they are assumed to lie along the axes of the world
    frame. Other surfaces are left to the rest.

    Args:
        region: as for ``SpectrumModel``; this model does not use it.
        beamformer: the dataset's array and grid.
        wavelength: metres.

    Attributes:
        middles: c_j of the gateway and of the images that have an amplitude, metres, world frame; none before ``fit``.
        signs: S_j.
        amplitudes: x_j (real, imaginary), for R in wavelengths.
        offsets: d_m, metres, world frame.
        rest: the field that interpolates e.
        power: mean of ``|e|²`` over the known spectra and elements.
        whole_power: the same mean of the known responses.
    """

    middles: Tensor
    signs: Tensor
    amplitudes: Tensor
    offsets: Tensor
    power: Tensor
    whole_power: Tensor

    def __init__(self, region: Float[np.ndarray, "2 3"], beamformer: Beamformer, wavelength: float):
        super().__init__(region, beamformer, wavelength)
        self._array = beamformer.array
        for name, width in (("middles", 3), ("signs", 3), ("amplitudes", 2)):
            self.register_buffer(name, torch.zeros(0, width))
        self.register_buffer("offsets", torch.zeros(beamformer.array.elements, 3))
        self.register_buffer("power", torch.zeros(()))
        self.register_buffer("whole_power", torch.zeros(()))
        self.rest = KrigedField(region, beamformer, wavelength, "responses")

    def responses(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, "B elements 2"]:
        """Element responses y (real, imaginary), in the units of the known ones."""
        real, imaginary = image_waves(positions, self.middles, self.signs, self.offsets, self.wavelength)
        x, y = self.amplitudes.unbind(dim=1)  # real numbers, since ONNX has no complex ones
        explained = torch.stack([real @ x - imaginary @ y, real @ y + imaginary @ x], dim=-1)
        return explained + self.power.sqrt() * self.rest.responses(positions)

    def uncertainty(self, positions: Float[Tensor, "B 3"]) -> Float[Tensor, " B"]:
        """Variance of e relative to the power of the responses. The amplitudes count as known."""
        share = self.power / self.whole_power.clamp_min(1e-30)
        return (share * self.rest.uncertainty(positions)).clamp(0, 1)

    @classmethod
    def unsuited(cls, dataset: Dataset) -> str | None:
        """Why the images cannot be found in a dataset: it has no responses, or another end moves."""
        if dataset.responses is None:
            apart = dataset.metadata.get("phases") == "per-position"
            found = "phases that cannot be compared between positions" if apart else "pictures alone"
            return f"expected element responses with their phases, which tell mirror images, found {found}"
        if dataset.moving != "transmitter":
            found = "a receiver that moves" if dataset.moving == "receiver" else "both ends moving"
            return f"expected a transmitter that moves before a gateway that stands still, found {found}"
        return None

    def fit(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> str:
        """Find the images in the known responses, and fit the covariance of the rest.

        Args:
            dataset: a dataset with responses, whose transmitter moves. Of a band, the carrier's responses are used.
            known: indices of the spectra to fit to.

        Returns:
            The share of the power that the images explain, as a sentence for the user.

        Raises:
            InputError: the dataset has no responses, or something else moves.
        """
        self.refit(dataset, known)
        explained = 1 - float(self.power / self.whole_power.clamp_min(1e-30))
        return (
            f"the gateway and {max(len(self.middles) - 1, 0)} mirror images of it explain {explained:.0%} of the power"
        )

    def refit(self, dataset: Dataset, known: Int[np.ndarray, " n"]) -> None:
        """As ``fit``, which makes no choices beyond it."""
        unsuited = self.unsuited(dataset)
        if unsuited is not None:
            raise InputError(f"{dataset.folder}: {unsuited}")
        assert dataset.responses is not None
        known = np.unique(known)
        turn = Rotation.from_quat(dataset.gateway_orientation)
        offsets = turn.apply(float(self.wavelength) * self._array.positions)
        images, amplitudes = self._found(dataset, evenly(known, FITTED_ON), offsets)
        explained = self._waves(images, dataset.positions[known], offsets) @ amplitudes
        self.middles, self.signs, self.offsets = (
            torch.from_numpy(each).float() for each in (images.middles, images.signs, offsets)
        )
        self.amplitudes = torch.view_as_real(torch.from_numpy(amplitudes)).float()
        rest = np.zeros_like(dataset.responses)
        rest[known] = dataset.responses[known] - explained
        self.power, self.whole_power = (
            torch.tensor(float((np.abs(values[known].astype(complex)) ** 2).mean()))
            for values in (rest, dataset.responses)
        )
        self.rest.report = self.report  # type: ignore[method-assign]
        self.rest.fit(replace(dataset, responses=rest), known)

    def _waves(
        self, images: Images, positions: Float[np.ndarray, "n 3"], offsets: Float[np.ndarray, "elements 3"]
    ) -> Complex[np.ndarray, "n elements J"]:
        at, middles, signs, elements = map(torch.from_numpy, (positions, images.middles, images.signs, offsets))
        real, imaginary = image_waves(at, middles, signs, elements, self.wavelength.double())
        return torch.complex(real, imaginary).numpy()

    def _found(
        self, dataset: Dataset, known: Int[np.ndarray, " n"], offsets: Float[np.ndarray, "elements 3"]
    ) -> tuple[Images, Complex[np.ndarray, " J"]]:
        """The images and their amplitudes: first those in one plane are looked for, then those in two."""
        assert dataset.responses is not None
        positions, wavelength = dataset.positions[known].astype(float), float(self.wavelength)
        region = np.stack([positions.min(axis=0), positions.max(axis=0)])
        first = gateway_and_first_images(np.asarray(dataset.gateway_position, float), region, wavelength)
        white = self._whitened(positions)
        data = white(dataset.responses[known].astype(complex)).ravel()
        power = float((np.abs(data) ** 2).mean())
        if not power:
            return first.of(np.zeros(len(first), bool)), np.zeros(0, complex)

        def waves(images: Images) -> Complex[np.ndarray, "N J"]:
            return white(self._waves(images, positions, offsets)).reshape(len(data), -1)

        self.report("mirror images", 0, 2)
        of_first = waves(first)
        even = IMAGES * power / float((np.abs(of_first) ** 2).mean()) / len(first)
        found = most_likely(of_first, data, np.full(len(first), even), REST * power, ITERATIONS)
        if not found.variances.any():
            return first.of(found.variances > 0), np.zeros(0, complex)
        self.report("mirror images", 1, 2)
        perpendicular, parallel = second_images(first, found.variances, region, wavelength)
        strong = found.variances > WEAK * found.variances.max()
        images = together(first.of(strong), perpendicular, parallel)
        shares = np.repeat([PERPENDICULAR, PARALLEL], [len(perpendicular), len(parallel)])
        start = np.append(found.variances[strong], shares * found.variances.max())
        found = most_likely(waves(images), data, start, found.noise, ITERATIONS)
        used = found.variances > 0
        return images.of(used), found.amplitudes[used]

    def _whitened(
        self, positions: Float[np.ndarray, "n 3"]
    ) -> Callable[[Complex[np.ndarray, "n *shape"]], Complex[np.ndarray, "n *shape"]]:
        """The function that makes values with the covariance of the rest, as it is assumed, independent."""
        apart = np.linalg.norm(positions[:, None] - positions, axis=-1) / float(self.wavelength)
        alike = np.sinc(2 * apart) * np.exp(-apart / OF_REST) + NUGGET * np.eye(len(positions))
        root = cholesky(alike, lower=True)
        return lambda values: solve_triangular(root, values.reshape(len(values), -1), lower=True).reshape(values.shape)

    def load_state_dict(self, state_dict: Mapping[str, Any], strict: bool = True, assign: bool = False) -> Any:
        """As ``torch.nn.Module.load_state_dict``, but for the number of spectra and images that the file has."""
        for name in ("middles", "signs", "amplitudes"):
            value, own = state_dict.get(name), getattr(self, name)
            setattr(self, name, torch.zeros(len(value) if value is not None and value.ndim == 2 else 0, own.shape[1]))
        if len({len(self.middles), len(self.signs), len(self.amplitudes)}) > 1:
            raise RuntimeError("other numbers of images, signs and amplitudes")
        of_rest = {key.removeprefix("rest."): each for key, each in state_dict.items() if key.startswith("rest.")}
        self.rest.load_state_dict(of_rest, strict)
        return super().load_state_dict(state_dict, strict, assign)
