"""The method mirror-images for received powers: waves of the gateways' mirror images, and kriging of the rest in dB."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations, product
from typing import ClassVar

import numpy as np
import torch
from jaxtyping import Bool, Complex, Float, Int
from scipy.linalg import cholesky, solve_triangular
from scipy.spatial.distance import cdist

from learn.models.images.image_search import expected_amplitudes
from learn.models.images.mirror_images import APART, image_waves, plane_distances, strongest_apart
from learn.powers.helmholtz_powers import ExplainedPowers
from learn.quantities.known_powers import KnownPowers
from simulate.spectra.spectrum import evenly


@dataclass(frozen=True)
class SharedImages:
    """Image j of each of G gateways is in the same planes."""

    middles: Float[np.ndarray, "G J 3"]  # positions of the images, metres, world frame
    sent: Bool[np.ndarray, "G J"]  # whether the gateway has this image. One behind the plane has none.
    # axis of the plane of each image, 0 to 2; −1 for the gateways themselves and images in two planes
    axes: Int[np.ndarray, " J"]
    planes: Float[np.ndarray, " J"]  # coordinate of the plane on this axis, metres

    def of(self, which: Bool[np.ndarray, " J"]) -> SharedImages:
        """Some of the images."""
        return SharedImages(self.middles[:, which], self.sent[:, which], self.axes[which], self.planes[which])

    def waves(self, positions: Float[np.ndarray, "n 3"], wavelength: float) -> Complex[np.ndarray, "G n J"]:
        """The spherical waves e^{−jkR}/R of the images, R in wavelengths."""
        at, length = torch.from_numpy(np.asarray(positions, float)), torch.tensor(wavelength, dtype=torch.float64)
        point = torch.zeros(1, 3, dtype=torch.float64)
        found = []
        for middles, sent in zip(self.middles, self.sent, strict=True):
            of = torch.from_numpy(middles)
            real, imaginary = image_waves(at, of, torch.ones_like(of), point, length)
            found.append(torch.complex(real, imaginary)[:, 0].numpy() * sent)
        return np.stack(found)


def together(*images: SharedImages) -> SharedImages:
    """All of several images."""
    return SharedImages(
        np.concatenate([each.middles for each in images], axis=1),
        np.concatenate([each.sent for each in images], axis=1),
        np.concatenate([each.axes for each in images]),
        np.concatenate([each.planes for each in images]),
    )


def images_in_one_plane(
    gateways: Float[np.ndarray, "G 3"], region: Float[np.ndarray, "2 3"], wavelength: float
) -> SharedImages:
    """The gateways themselves, and their images in planes beyond the transmitters, on all six sides."""
    count = len(gateways)
    itself = np.array([-1]), np.zeros(1)
    found = [SharedImages(gateways[:, None], np.ones((count, 1), bool), *itself)]
    for axis, up in product(range(3), (1, -1)):
        planes = up * ((up * region[:, axis]).max() + plane_distances(wavelength))
        middles = np.repeat(gateways[:, None], len(planes), axis=1)
        middles[:, :, axis] = 2 * planes - gateways[:, axis, None]
        sent = up * planes > up * gateways[:, axis, None]
        found.append(SharedImages(middles, sent, np.full(len(planes), axis), planes))
    return together(*found)


def images_in_two_planes(
    gateways: Float[np.ndarray, "G 3"],
    first: SharedImages,
    strengths: Float[np.ndarray, " J"],
    region: Float[np.ndarray, "2 3"],
    wavelength: float,
) -> tuple[SharedImages, SharedImages]:
    """Images in two planes, of the strongest ones along each axis if they are perpendicular."""
    count = len(gateways)
    perpendicular, parallel = [], []
    strongest = []
    for axis in range(3):
        along = np.flatnonzero(first.axes == axis)
        strongest.append(along[strongest_apart(first.planes[along], strengths[along], APART * wavelength / 2)])
    for one, other in combinations(range(3), 2):
        for a, b in product(strongest[one], strongest[other]):
            middles = gateways.copy()
            middles[:, one], middles[:, other] = first.middles[:, a, one], first.middles[:, b, other]
            sent = first.sent[:, a] & first.sent[:, b]
            perpendicular.append(SharedImages(middles[:, None], sent[:, None], np.array([-1]), np.zeros(1)))
    for axis, up in product(range(3), (1, -1)):
        shifts = 2 * up * (np.ptp(region[:, axis]) + plane_distances(wavelength))
        middles = np.repeat(gateways[:, None], len(shifts), axis=1)
        middles[:, :, axis] += shifts
        nowhere = np.full(len(shifts), -1), np.zeros(len(shifts))
        parallel.append(SharedImages(middles, np.ones((count, len(shifts)), bool), *nowhere))
    none = first.of(np.zeros(len(first.planes), bool))
    return together(none, *perpendicular), together(*parallel)


BY_REFERENCE, IN_ONE, IN_TWO = 10, 20, 20
"""Iterations with the direct wave as reference; after them with the found phases, for images in one plane; and again
with those in two."""

OF_REST, NUGGET = 2.0, 0.3
"""Length over which what the images leave is alike, wavelengths, and its nugget."""

IMAGES, REST = 0.7, 0.3
"""Shares of the interference that the images and the rest have at the start of the search."""

WEAK, WEAKEST, PERPENDICULAR, PARALLEL = 1e-3, 1e-6, 3e-3, 3e-4
"""Variances relative to that of the direct wave: below which an image in one plane is left out before those in two are
added; below which any image is left out (of powers); with which those in two planes start."""

DARKEST, BRIGHTEST = -1.0, 2.0
"""Range of the interference (P/P₀ − 1)/2, beyond which it is mostly that of images with each other."""

IN_FADES = 0.3
"""Share of the rest's power that is added to the predicted one, which is never 0, as the median of fading is not."""

TINY = 1e-14


class PowerImages:
    """The fields of G gateways as sums of waves of the gateways and their mirror images.

    A received power P = |y|² has no phase. But of the field y of a gateway, the direct wave w₀ x₀ is known up to its
    level, and it is mostly the strongest. It interferes with the waves of the mirror images, as the reference wave does
    in a hologram [gabor1948]::

        y = Σ_j x_j w_j,    (P / |w₀ x₀|² − 1) / 2 ≈ Re Σ_{j>0} (x_j / x₀) (w_j / w₀)

    This is linear in the amplitudes x_j. After it, the phases φ of the found field are taken for those at the known
    positions. Then √P ≈ Re(e^{−jφ} Σ_j x_j w_j) is linear, too, and holds for all waves together. This is repeated with
    the new phases, as in phase retrieval [gerchberg1972].

    All gateways are in one room. So the variance of an image's amplitude, which tells how large it may become, is the
    same for all gateways in front of a plane. It becomes zero for most planes, as for ``most_likely``.
    """

    images: SharedImages  # the gateways and the images that were found
    amplitudes: Complex[np.ndarray, "G J"]  # x_j of each gateway, for R in wavelengths, relative to its level
    _variances: Float[np.ndarray, "G J"]
    _noise: Float[np.ndarray, " G"]

    def __init__(self, gateways: Float[np.ndarray, "G 3"], region: Float[np.ndarray, "2 3"], wavelength: float):
        self._gateways, self._region, self._wavelength = gateways, region, wavelength

    def fit(self, positions: Float[np.ndarray, "n 3"], powers: Float[np.ndarray, "n G"]) -> None:
        """Find the images and their amplitudes."""
        apart = cdist(positions, positions) / self._wavelength
        self._alike = np.sinc(2 * apart) * np.exp(-apart / OF_REST)
        self.images = images_in_one_plane(self._gateways, self._region, self._wavelength)
        waves = self.images.waves(positions, self._wavelength)
        magnitudes = 10 ** (powers.T / 20)
        self._levels = np.sqrt(np.median((magnitudes / np.abs(waves[:, :, 0])) ** 2, axis=1))
        self._magnitudes = magnitudes / self._levels[:, None]
        self._start(waves)
        self._improve(waves, IN_ONE)
        strengths = self._variances.max(axis=0)
        pair = images_in_two_planes(self._gateways, self.images, strengths, self._region, self._wavelength)
        strong = strengths > WEAK * strengths[0]
        shares = np.repeat([PERPENDICULAR, PARALLEL], [len(each.planes) for each in pair])
        self.images = together(self.images.of(strong), *pair)
        added = self._variances[:, :1] * shares
        self._variances = np.concatenate([self._variances[:, strong], added], axis=1)
        self.amplitudes = np.concatenate([self.amplitudes[:, strong], np.zeros_like(added)], axis=1)
        self._improve(self.images.waves(positions, self._wavelength), IN_TWO)

    def _start(self, waves: Complex[np.ndarray, "G n J"]) -> None:
        """Amplitudes by interference with the direct wave, the first image."""
        direct = waves[:, :, :1]
        interference = np.clip(((self._magnitudes / np.abs(direct[:, :, 0])) ** 2 - 1) / 2, DARKEST, BRIGHTEST)
        root = cholesky(self._alike + NUGGET * np.eye(len(self._alike)), lower=True)
        data = solve_triangular(root, interference.T, lower=True).T
        parts = [
            solve_triangular(root, _parts(each / one), lower=True) for each, one in zip(waves, direct, strict=True)
        ]
        power = float((data**2).mean())
        even = 2 * IMAGES * power / max(float(np.mean([(each**2).sum(axis=1).mean() for each in parts])), TINY)
        self._variances = np.full((len(waves), waves.shape[2]), even)
        self._noise = np.full(len(waves), max(REST * power, TINY))
        for _ in range(BY_REFERENCE):
            self._step(list(zip(parts, data, strict=True)))
        self.amplitudes[:, 0] += 1
        self._variances[:, 0] = np.maximum(np.abs(self.amplitudes[:, 0]) ** 2, TINY)
        self._noise = self._noise * np.median(np.abs(direct[:, :, 0]) ** 2, axis=1)

    def _improve(self, waves: Complex[np.ndarray, "G n J"], iterations: int) -> None:
        """Repeat: take the phases of the found fields for those of the known magnitudes, and find the amplitudes."""
        for _ in range(iterations):
            equations = []
            for each, amplitudes, magnitude in zip(waves, self.amplitudes, self._magnitudes, strict=True):
                phase = _phases(each @ amplitudes)
                root = cholesky(self._of_rest(phase), lower=True)
                values = np.column_stack([magnitude, _parts(each * phase.conj()[:, None])])
                white = solve_triangular(root, values, lower=True)
                equations.append((white[:, 1:], white[:, 0]))
            self._step(equations)
            self._variances[:, 0] = np.maximum(np.abs(self.amplitudes[:, 0]) ** 2, TINY)
            powers = self._variances * (np.abs(waves) ** 2).mean(axis=1)
            used = (powers > WEAKEST * powers.max(axis=1, keepdims=True)).any(axis=0)
            used[0] = True
            waves, self.images = waves[:, :, used], self.images.of(used)
            self.amplitudes, self._variances = self.amplitudes[:, used], self._variances[:, used]

    def _step(self, equations: list[tuple[Float[np.ndarray, "n 2*J"], Float[np.ndarray, " n"]]]) -> None:
        """New amplitudes of each gateway from linear equations, its noise, and the variances that all share."""
        squares, ratios = np.zeros((2, *self._variances.shape))
        self.amplitudes = np.zeros(self._variances.shape, complex)
        for gateway, (parts, data) in enumerate(equations):
            variances = self._variances[gateway].repeat(2)
            values, ratio = expected_amplitudes(parts, data, variances, self._noise[gateway])
            self.amplitudes[gateway] = values[::2] + 1j * values[1::2]
            squares[gateway], ratios[gateway] = np.abs(self.amplitudes[gateway]) ** 2, ratio.reshape(-1, 2).sum(axis=1)
            determined = float((variances * ratio).sum())  # number of amplitudes that the data determine
            unexplained = float(((data - parts @ values) ** 2).sum()) / max(len(data) - determined, 1.0)
            self._noise[gateway] = max(unexplained, 1e-5 * float((data**2).mean()), TINY)
        shared = np.sqrt(squares.sum(axis=0) / np.maximum(ratios.sum(axis=0), 1e-12))
        self._variances = np.tile(np.maximum(shared, TINY), (len(squares), 1))

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, "K G"]:
        """Received powers, dBm."""
        fields = np.einsum("gnj,gj->gn", self.images.waves(positions, self._wavelength), self.amplitudes)
        powers = np.abs(fields) ** 2 + IN_FADES * self._noise[:, None]
        return 10 * np.log10(np.maximum(powers, TINY) * self._levels[:, None] ** 2).T

    def _of_rest(self, phases: Complex[np.ndarray, " n"]) -> Float[np.ndarray, "n n"]:
        """Covariance of the rest's part in phase with the field."""
        return self._alike * (phases[:, None] * phases.conj()).real + NUGGET * np.eye(len(phases))


def _phases(fields: Complex[np.ndarray, "*shape"]) -> Complex[np.ndarray, "*shape"]:
    """e^{jφ} of fields."""
    return fields / np.maximum(np.abs(fields), TINY)


def _parts(waves: Complex[np.ndarray, "n J"]) -> Float[np.ndarray, "n 2*J"]:
    """Factors of the real and imaginary parts of amplitudes in the real part of a sum of waves."""
    return np.stack([waves.real, -waves.imag], axis=-1).reshape(len(waves), -1)


FOLDS = 5  # Parts of the known positions. The images that predict each part are found without it.

LEAST_KNOWN = 20  # With fewer known positions no images are looked for, and the method is ``helmholtz``

FITTED_ON = 300
"""Largest number of known positions, evenly spread, in which images are found. All known positions are kriged."""

AT_ONCE = 16  # Largest number of gateways whose images are found together


class MirrorPowers(ExplainedPowers):
    """Universal kriging in dB about the powers of the gateways and their mirror images.

    ``PowerImages`` predicts T. At a known position, it is predicted without the position's part of the known ones.

    Walls are taken to run along the axes of the world frame. The gateways must be where the dataset says.
    """

    NAME: ClassVar[str] = "mirror-images"

    def _learn(self, known: KnownPowers) -> None:
        count = len(known.positions)
        self._images: list[PowerImages] = []
        self._of_known = np.zeros_like(known.powers)
        if count >= LEAST_KNOWN:
            for fold in range(FOLDS):
                part = np.arange(count) % FOLDS == fold
                self._images = _found(known, np.flatnonzero(~part))
                self._of_known[part] = self._explained(known.positions[part])
            self._images = _found(known, np.arange(count))
        super()._learn(known)

    def _explained(self, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, "K G"]:
        if not self._images:
            return np.zeros((len(positions), self._of_known.shape[1]))
        return np.concatenate([each.predict(positions) for each in self._images], axis=1)


def _found(known: KnownPowers, members: Int[np.ndarray, " m"]) -> list[PowerImages]:
    """Images of all gateways, in groups of these, found in some of the known powers."""
    region = np.stack([known.positions.min(axis=0), known.positions.max(axis=0)])
    members = evenly(members, FITTED_ON)
    found = []
    for group in np.array_split(np.arange(len(known.gateways)), -(-len(known.gateways) // AT_ONCE)):
        images = PowerImages(known.gateways[group], region, known.wavelength)
        images.fit(known.positions[members], known.filled[members][:, group])
        found.append(images)
    return found
