"""Likelihood of a tag's responses along an antenna's track, if the tag stands at a point, and its maxima."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float
from scipy.linalg import solve_triangular

AT_ONCE = 2**22  # Numbers of the largest array that is held at a time

LEAST_SHARE = 1e-6
"""Components of the direct path's gain with a smaller share of its power are left out."""


LEAST_COSINE = 0.05
"""Least factor of the antenna's pattern; none receives nothing from beside and behind."""


@dataclass(frozen=True)
class DirectPath:
    """A Gaussian model of the one-way responses h_n of a tag at r, at antennas r_n along a track.

    ``h_n = α [(1 + g_n) e^{−jk|r − r_n|} / |r − r_n| + m_n + w_n]``

    The size and the phase of α are unknown. The gain 1 + g of the direct path changes smoothly along the track, since
    antenna and tag have patterns and things stand in the way. m is the field of waves from all directions
    [cook1955], and w is noise. With the direct path scaled to a mean square magnitude of 1 along the track, the
    covariances are::

        ⟨g_n g*_m⟩ = gain · e^{−Δ² / 2ℓ²},   ⟨m_n m*_m⟩ = multipath · sin(kΔ) / kΔ,   ⟨w_n w*_m⟩ = noise · δ_nm

    with the distance Δ of antennas n and m.
    """

    antennas: Float[np.ndarray, "N 3"]  # positions of the antenna, metres, world frame
    wavelength: float  # metres
    # unit vector in which the antenna looks, world frame: the direct path's magnitude then has the factor cos θ of
    # the angle from it. None: it looks in all directions alike.
    boresight: Float[np.ndarray, " 3"] | None = None
    # the responses have phases but no magnitudes, so that the direct path's magnitude is 1 everywhere
    phases_only: bool = False
    gain: float = 0.45  # variance of g
    length: float = 0.45  # ℓ, wavelengths
    multipath: float = 0.06  # power of m
    noise: float = 0.001  # power of w

    def quieter(self, factor: float) -> DirectPath:
        """The model with this factor on the variances of g, m and w."""
        return replace(self, gain=factor * self.gain, multipath=factor * self.multipath, noise=factor * self.noise)

    def log_likelihood(
        self, points: Float[np.ndarray, "G 3"], responses: Complex[np.ndarray, "K N"]
    ) -> Float[np.ndarray, "K G"]:
        """Logarithm of the likelihood of each tag's responses at each point, up to a constant.

        It is that of the most likely size of α: −N log(hᴴ C⁻¹ h) − log|C| with the covariance C of h / α.
        """
        whitened = self._whiten(responses.T)
        energy = np.square(np.abs(whitened)).sum(axis=0)
        found = np.empty((len(responses), len(points)))
        for some in self._blocks(len(points)):
            parts, inner = self._parts(points[some])
            seen = (parts.reshape(-1, len(whitened)) @ whitened).reshape(*inner.shape[:2], -1)
            found[:, some] = self._likelihood(energy, np.linalg.solve(inner, seen), inner).T
        return found

    def log_likelihood_at(
        self, points: Float[np.ndarray, "M 3"], responses: Complex[np.ndarray, "M N"]
    ) -> Float[np.ndarray, " M"]:
        """As ``log_likelihood``, of one point for each tag."""
        whitened = self._whiten(responses.T)
        energy = np.square(np.abs(whitened)).sum(axis=0)
        found = np.empty(len(points))
        for some in self._blocks(len(points)):
            parts, inner = self._parts(points[some])
            seen = parts @ whitened[:, some].T[:, :, None]
            found[some] = self._likelihood(energy[some, None], np.linalg.solve(inner, seen), inner)[:, 0]
        return found

    def unexplained(
        self, points: Float[np.ndarray, "G 3"], responses: Complex[np.ndarray, " N"]
    ) -> Float[np.ndarray, " G"]:
        """Share of a tag's power that the direct path from each point does not explain, 0…1."""
        power = len(responses) * np.square(np.abs(responses)).sum()
        return 1 - np.square(np.abs(self.direct(points).conj() @ responses)) / power

    def direct(self, points: Float[np.ndarray, "G 3"]) -> Complex[np.ndarray, "G N"]:
        """Direct paths from points, with a mean square magnitude of 1 along the track."""
        towards = points[:, None] - self.antennas
        distance = np.maximum(np.linalg.norm(towards, axis=-1), 1e-3 * self.wavelength)
        waves = np.exp(-2j * np.pi * distance / self.wavelength)
        if self.phases_only:
            return waves
        waves /= distance
        if self.boresight is not None:
            waves *= np.maximum(towards @ self.boresight / distance, LEAST_COSINE)
        return waves / np.sqrt(np.square(np.abs(waves)).mean(axis=1, keepdims=True))

    @cached_property
    def _apart(self) -> Float[np.ndarray, "N N"]:
        """Distances of the antennas, wavelengths."""
        return np.linalg.norm(self.antennas[:, None] - self.antennas, axis=-1) / self.wavelength

    @cached_property
    def _gains(self) -> Float[np.ndarray, "N R"]:
        """Factors G of the covariance G Gᵀ of 1 + g."""
        shares, modes = np.linalg.eigh(1 + self.gain * np.exp(-np.square(self._apart / self.length) / 2))
        kept = shares > LEAST_SHARE * shares[-1]
        return modes[:, kept] * np.sqrt(shares[kept])

    @cached_property
    def _root(self) -> Float[np.ndarray, "N N"]:
        """Cholesky factor of the covariance of m + w."""
        spread = self.multipath * np.sinc(2 * self._apart)
        return np.linalg.cholesky(spread + (self.noise + 1e-12) * np.eye(len(self.antennas)))

    def _blocks(self, count: int) -> list[slice]:
        step = max(1, AT_ONCE // self._gains.size)
        return [slice(start, start + step) for start in range(0, count, step)]

    def _parts(
        self, points: Float[np.ndarray, "G 3"]
    ) -> tuple[Complex[np.ndarray, "G R N"], Complex[np.ndarray, "G R R"]]:
        """The direct path's whitened components U (conjugated), and the Cholesky factor of UᴴU + I."""
        count, rank = self._gains.shape
        direct = self.direct(points).T
        parts = self._whiten((direct[:, :, None] * self._gains[:, None]).reshape(count, -1))
        parts = parts.reshape(count, -1, rank).transpose(1, 2, 0).conj()
        return parts, np.linalg.cholesky(parts @ parts.conj().transpose(0, 2, 1) + np.eye(rank))

    def _likelihood(
        self,
        energy: Float[np.ndarray, "*m"],
        explained: Complex[np.ndarray, "G R K"],
        inner: Complex[np.ndarray, "G R R"],
    ) -> Float[np.ndarray, "G K"]:
        count = len(self.antennas)
        left = energy - np.square(np.abs(explained)).sum(axis=1)
        logarithm = np.log(np.diag(self._root)).sum() + np.log(np.einsum("grr->gr", inner).real).sum(axis=1)
        return -count * np.log(np.maximum(left, 1e-30)) - 2 * logarithm[:, None]

    def _whiten(self, columns: Complex[np.ndarray, "N C"]) -> Complex[np.ndarray, "N C"]:
        return solve_triangular(self._root, columns, lower=True)


STEPS, STEP = 12, 0.01
"""Newton's steps, and the first distance of the points that show the derivatives, wavelengths."""


class Maxima(NamedTuple):
    """Maxima of the likelihood: positions, covariances, and the logarithm of the probability in each maximum."""

    positions: Float[np.ndarray, "M 3"]
    covariances: Float[np.ndarray, "M 3 3"]
    evidence: Float[np.ndarray, " M"]

    def apart(self, least: float) -> Maxima:
        """The maxima at least so far apart, in metres, the most probable one first."""
        kept: list[int] = []
        for each in np.argsort(-self.evidence):
            if all(np.linalg.norm(self.positions[each] - self.positions[other]) > least for other in kept):
                kept.append(int(each))
        return Maxima(*(each[kept] for each in self))


def maximise(
    model: DirectPath, rows: Complex[np.ndarray, "M N"], starts: Float[np.ndarray, "M 3"], box: Float[np.ndarray, "2 3"]
) -> Maxima:
    """Newton's steps from the starts, and the covariances from the curvature at their ends."""
    free = np.flatnonzero(box[1] > box[0])
    positions, value = starts.copy(), model.log_likelihood_at(starts, rows)
    step = np.full((len(starts), len(free)), STEP * model.wavelength)
    damping = np.ones(len(starts))
    for _ in range(STEPS):
        slope, curvature = _derivatives(model, rows, positions, free, step)
        shares, axes = _eigen(curvature, model.wavelength)
        ahead = np.einsum("mij,mj->mi", axes, np.einsum("mij,mi->mj", axes, slope) / (shares * damping[:, None]))
        length = np.linalg.norm(ahead, axis=1, keepdims=True)
        ahead *= np.minimum(1, model.wavelength / 8 / np.maximum(length, 1e-12))
        moved = positions.copy()
        moved[:, free] += ahead
        away = moved - starts
        away *= np.minimum(1, model.wavelength / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-12) / 2)
        moved = np.clip(starts + away, *box)
        after = model.log_likelihood_at(moved, rows)
        better = after > value
        positions[better], value[better] = moved[better], after[better]
        damping = np.where(better, np.maximum(damping / 4, 1), damping * 4)
        deviation = 1 / np.sqrt(np.maximum(np.einsum("mii->mi", curvature), 1e-12))
        step = np.clip(deviation / 4, 1e-5 * model.wavelength, STEP * model.wavelength)
    shares, axes = _eigen(_derivatives(model, rows, positions, free, step)[1], model.wavelength)
    covariances = np.zeros((len(starts), 3, 3))
    covariances[:, free[:, None], free] = (axes / shares[:, None]) @ axes.transpose(0, 2, 1)
    return Maxima(positions, covariances, value - np.log(shares).sum(axis=1) / 2)


def _derivatives(
    model: DirectPath,
    rows: Complex[np.ndarray, "M N"],
    positions: Float[np.ndarray, "M 3"],
    free: np.ndarray,
    step: Float[np.ndarray, "M F"],
) -> tuple[Float[np.ndarray, "M F"], Float[np.ndarray, "M F F"]]:
    """Gradient of the log-likelihood, and minus its second derivatives, by central differences."""
    count = len(free)
    axes = np.eye(count)
    signs = np.array([np.zeros(count), *axes, *-axes, *(a + b for i, a in enumerate(axes) for b in axes[i + 1 :])])
    points = np.repeat(positions[:, None], len(signs), axis=1)
    points[..., free] += signs * step[:, None]
    values = model.log_likelihood_at(points.reshape(-1, 3), np.repeat(rows, len(signs), axis=0))
    values = values.reshape(len(rows), len(signs))
    middle, ahead, behind = values[:, :1], values[:, 1 : count + 1], values[:, count + 1 : 2 * count + 1]
    curvature = np.empty((len(rows), count, count))
    curvature[:, range(count), range(count)] = (2 * middle - ahead - behind) / step**2
    pairs = [(i, j) for i in range(count) for j in range(i + 1, count)]
    for both, (i, j) in zip(values[:, 2 * count + 1 :].T, pairs, strict=True):
        # f(a + b) − f(a) − f(b) + f(0) has the mixed derivative, and third ones that one more point would remove.
        mixed = (both - ahead[:, i] - ahead[:, j] + middle[:, 0]) / (step[:, i] * step[:, j])
        curvature[:, i, j] = curvature[:, j, i] = -mixed
    return (ahead - behind) / (2 * step), curvature


def _eigen(
    curvature: Float[np.ndarray, "M F F"], wavelength: float
) -> tuple[Float[np.ndarray, "M F"], Float[np.ndarray, "M F F"]]:
    """Eigenvalues of the curvature, and its axes."""
    shares, axes = np.linalg.eigh(curvature)
    return np.maximum(np.abs(shares), 1 / wavelength**2), axes
