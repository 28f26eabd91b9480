"""Waves of the gateways' mirror images, found in received powers as in a hologram."""

from __future__ import annotations

import numpy as np
from jaxtyping import Complex, Float
from scipy.linalg import cholesky, solve_triangular
from scipy.spatial.distance import cdist

from learn.models.images.image_search import expected_amplitudes
from learn.powers.shared_images import SharedImages, images_in_one_plane, images_in_two_planes, together

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
