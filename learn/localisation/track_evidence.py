"""Responses along the track of a moving antenna as evidence of a tag's place (synthetic aperture)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Complex, Float
from scipy.linalg import solve_triangular

from learn.localisation.evidence import Evidence

AT_ONCE = 2**22  # Numbers of the largest array that is held at a time

LEAST_SHARE = 1e-6
"""Components of the direct path's gain with a smaller share of its power are left out."""


LEAST_COSINE = 0.05
"""Least factor of the antenna's pattern; none receives nothing from beside and behind."""


@dataclass(frozen=True, eq=False)
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

    @cached_property
    def quieter(self) -> list[DirectPath]:
        """The model with smaller variances of g, m and w."""
        each = ({name: factor * getattr(self, name) for name in ("gain", "multipath", "noise")} for factor in QUIETER)
        return [replace(self, **variances) for variances in each]

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


LEAST_READS = 4  # Least number of antenna positions at which a tag must be read

PLAIN = 0.1
"""A tag whose magnitudes lie between 1 − PLAIN and 1, on average and at most, has phases alone: means of unit phasors,
as of several reads at a stop, are so long."""

CLEAN, QUIETER = 1e-3, (1e-2, 1e-4)
"""Largest share of the power that the direct path leaves open somewhere, for which the model's variances may be smaller
by a factor. A single reflection that leaves more changes the phases as a wrong place does."""


class TrackEvidence(Evidence):
    """Responses of K tags at N antenna positions, NaN where a tag was not read."""

    clean = 0.05

    def __init__(
        self,
        responses: Complex[np.ndarray, "K N"],
        antennas: Float[np.ndarray, "N 3"],
        region: Float[np.ndarray, "2 3"],
        wavelength: float,
        boresight: Float[np.ndarray, " 3"] | None = None,
    ):
        super().__init__(np.where(responses == 0, np.nan, responses), region, wavelength)
        self._antennas, self._boresight = antennas, boresight
        self._models: dict[tuple[bytes, bool], DirectPath] = {}

    @property
    def told(self) -> Bool[np.ndarray, " K"]:
        """Tags that were read at enough antenna positions."""
        return np.isfinite(self.heard).sum(axis=1) >= LEAST_READS

    def log_likelihood(
        self, points: Float[np.ndarray, "n 3"], heard: Complex[np.ndarray, "k N"]
    ) -> Iterator[Float[np.ndarray, " n"]]:
        """By the direct path from each point; all tags that were read at the same antenna positions together."""
        found = np.empty((len(heard), len(points)))
        models = [self._model(row) for row in heard]
        for model in set(models):
            rows = np.array([each is model for each in models])
            seen = heard[np.ix_(rows, np.isfinite(heard[rows][0]))]
            found[rows] = model.log_likelihood(points, seen)
            for number, row in zip(np.flatnonzero(rows), seen, strict=True):
                if model.unexplained(points, row).min() < CLEAN:
                    each = [other.log_likelihood(points, row[None])[0] for other in model.quieter]
                    found[number] = np.max([found[number], *each], axis=0)
        yield from found

    def misfit(self, points: Float[np.ndarray, "n 3"], row: Complex[np.ndarray, " N"]) -> Float[np.ndarray, " n"]:
        """Share of the power that the direct path alone does not explain."""
        return self._model(row).unexplained(points, row[np.isfinite(row)])

    def _model(self, row: Complex[np.ndarray, " N"]) -> DirectPath:
        """The model of the antenna positions at which a tag was read."""
        read = np.isfinite(row)
        magnitudes = np.abs(row[read])
        plain = bool(magnitudes.mean() > 1 - PLAIN and magnitudes.max() < 1 + 1e-6)
        key = (read.tobytes(), plain)
        if key not in self._models:
            self._models[key] = DirectPath(self._antennas[read], self.wavelength, self._boresight, plain)
        return self._models[key]
