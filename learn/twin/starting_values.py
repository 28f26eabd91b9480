"""Starting values of a calibration: of many poses drawn from the prior, the most likely one.

They need no tracing. Behind a reflection or a transmission the transmitter appears at an image, which stays where it is
if the gateway moves, so that a path's length is the distance to this image as long as the path exists. Nearby, the
length changes in proportion to the displacement.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Complex, Float
from scipy.sparse import csr_array
from scipy.spatial.transform import Rotation

from learn.twin.linearised import CARRIER, moved, over_band
from scenes.checks.occupancy import element_positions
from scenes.checks.validation import is_valid
from scenes.scene.description import Scene
from scenes.scene.unknowns import OF_POSE, Unknown, vary
from simulate.rays.tracer import Tracer

GUESSES = 1000  # Number of poses that are tried, including the described one

FAR = 0.5
"""Wavelengths. If the gateway's position has a larger tolerance, small steps hardly lead to it."""

DRAWN, NEARBY = 4000, 300  # Numbers of poses that are drawn from the prior, and near each that is kept

KEPT = 8  # Number of guesses near which the scene is traced again

APART = 0.5  # Wavelengths. The positions of two guesses that are kept are no closer.

NARROWER = (1 / 3, 1 / 9, 1 / 27)
"""Standard deviations of the draws around the guesses that are kept, in those of the prior."""

AT_ONCE = 4_000_000  # Number of phases computed at once, which bounds the memory


def is_far(scene: Scene, which: Sequence[Unknown]) -> bool:
    """Whether the gateway may be so far from its described position that ``Draws.far_away`` is needed."""
    return any(each.kind == "position" and each.tolerance > FAR * scene.wavelength for each in which)


@dataclass(frozen=True)
class Draws:
    """Poses of a gateway that are drawn from their prior, and judged by −2 log of the posterior."""

    scene: Scene  # as described, with one gateway
    which: Sequence[Unknown]  # n unknowns; those that are not of the gateway's pose stay 0
    positions: Float[np.ndarray, "K 3"]  # at which guesses are compared
    unlikely: Callable[[Complex[np.ndarray, "G K M"]], Float[np.ndarray, " G"]]  # −2 log of the likelihood of responses
    ratios: Sequence[float] = CARRIER  # frequencies of the responses, in carrier frequencies

    def nearby(self, tracer: Tracer) -> Float[np.ndarray, " n"]:
        """Values from which steps lead to the right minimum more often than from 0: those of the most likely draw."""
        of_pose = [number for number, each in enumerate(self.which) if each.kind in OF_POSE]
        guesses = np.zeros((GUESSES, len(self.which)))
        drawn = np.random.default_rng(0).normal(size=(GUESSES - 1, len(of_pose)))
        guesses[1:, of_pose] = drawn * self._prior[of_pose]
        return self._best(tracer, guesses, first_order=True)

    def far_away(self, tracer: Tracer) -> Float[np.ndarray, " n"]:
        """The same from far away, where other paths exist: at the best draws the scene is traced again.

        Around each of them more poses are drawn, ever closer.
        """
        spread = self._prior * [each.kind in OF_POSE for each in self.which]
        generator = np.random.default_rng(0)
        drawn = generator.normal(size=(DRAWN, len(self.which))) * spread
        drawn[0] = 0
        drawn = drawn[inside(self.scene, self.which, drawn)]
        drawn = drawn[self._unlikely(tracer, drawn).argsort(kind="stable")]
        position = [number for number, each in enumerate(self.which) if each.kind == "position"]
        best, least = np.zeros(len(self.which)), np.inf
        for guess in kept_apart(drawn, position, APART * self.scene.wavelength, self._is_valid):
            traced = Tracer(vary(self.scene, self.which, guess), tracer.ray_scene.propagation, tracer.region)
            for narrower in NARROWER:
                near = guess + generator.normal(size=(NEARBY, len(self.which))) * spread * narrower
                near[0] = guess
                guess = self._best(traced, near)
                traced = moved(traced, vary(self.scene, self.which, guess))
            value = self._unlikely(traced, guess[None])[0]
            if value < least:
                best, least = guess, value
        return best

    def _best(
        self, traced: Tracer, guesses: Float[np.ndarray, "G n"], first_order: bool = False
    ) -> Float[np.ndarray, " n"]:
        """The most likely guess that is a valid scene; the first one if none is."""
        order = guesses[self._unlikely(traced, guesses, first_order).argsort(kind="stable")]
        return next((guess for guess in order if self._is_valid(guess)), guesses[0])

    def _unlikely(
        self, traced: Tracer, guesses: Float[np.ndarray, "G n"], first_order: bool = False
    ) -> Float[np.ndarray, " G"]:
        """−2 log of the posterior of guesses, by the paths of a tracer at a pose near them."""
        elements = elements_of(self.scene, self.which, guesses)
        batches = responses_of(over_band(traced, self.ratios), self.positions, elements, first_order)
        unlikely = np.concatenate([self.unlikely(found) for found in batches])
        return unlikely + ((guesses / self._prior) ** 2).sum(axis=1)

    @property
    def _prior(self) -> Float[np.ndarray, " n"]:
        """Standard deviations of the unknowns' priors."""
        return np.array([each.tolerance for each in self.which])

    def _is_valid(self, guess: Float[np.ndarray, " n"]) -> bool:
        return is_valid(vary(self.scene, self.which, guess))


def kept_apart(
    guesses: Float[np.ndarray, "G n"],
    position: Sequence[int],
    apart: float,
    valid: Callable[[Float[np.ndarray, " n"]], bool],
) -> list[Float[np.ndarray, " n"]]:
    """The first few valid guesses whose positions lie apart.

    >>> line = np.array([[0.0], [0.1], [0.3], [0.7]])
    >>> [float(each[0]) for each in kept_apart(line, [0], 0.2, lambda guess: guess[0] != 0.3)]
    [0.0, 0.7]
    """
    kept: list[Float[np.ndarray, " n"]] = []
    for guess in guesses:
        away = all(np.linalg.norm((guess - other)[position]) > apart for other in kept)
        if away and valid(guess):
            kept.append(guess)
        if len(kept) == KEPT:
            break
    return kept


def inside(scene: Scene, which: Sequence[Unknown], guesses: Float[np.ndarray, "G n"]) -> Bool[np.ndarray, " G"]:
    """Which guesses leave a gateway within the scene's bounds that is described within them; all, if it is not."""
    low, high = scene.bounds
    shifts, _ = poses(which, guesses)
    places = np.asarray(scene.gateway.position) + np.vstack([np.zeros(3), shifts])
    within = ((places >= low) & (places <= high)).all(axis=1)
    return within[1:] | ~within[0]


def poses(
    which: Sequence[Unknown], guesses: Float[np.ndarray, "G n"]
) -> tuple[Float[np.ndarray, "G 3"], Float[np.ndarray, "G 3"]]:
    """Displacements of the gateway, metres, and rotation vectors, radians, both in the world frame."""
    shifts, turns = np.zeros((len(guesses), 3)), np.zeros((len(guesses), 3))
    for column, each in enumerate(which):
        if each.kind == "position":
            shifts[:, each.axis] += guesses[:, column]
        elif each.kind == "rotation":
            turns[:, each.axis] += guesses[:, column]
    return shifts, turns


def elements_of(
    scene: Scene, which: Sequence[Unknown], guesses: Float[np.ndarray, "G n"]
) -> Float[np.ndarray, "G M 3"]:
    """Positions of the array's elements for each guess, metres, world frame."""
    gateway = scene.gateway
    arms = element_positions(gateway, scene.wavelength) - gateway.position
    shifts, turns = poses(which, guesses)
    turned = np.einsum("gij,mj->gmi", Rotation.from_rotvec(turns).as_matrix(), arms)
    return gateway.position + shifts[:, None] + turned


def responses_of(
    band: Sequence[Tracer],
    positions: Float[np.ndarray, "K 3"],
    elements: Float[np.ndarray, "G M 3"],
    first_order: bool = False,
) -> Iterator[Complex[np.ndarray, "g K M*used"]]:
    """Responses at positions for each guess of the elements' places, in batches of guesses."""
    number = elements.shape[1]
    shape = len(positions), number * len(band)
    paths = []
    for column, tracer in enumerate(band):
        wavenumber = 2 * np.pi / tracer.scene.wavelength
        for batch in tracer.multipath(positions):
            place = (batch.targets * len(band) + column) * number + batch.sources
            ends = batch.vertices[:, 0], batch.length_derivatives()[0]
            paths.append(
                (batch.sources, *ends, batch.lengths(), batch.responses, np.full(len(place), wavenumber), place)
            )
    if not paths:
        yield np.zeros((len(elements), *shape), complex)
        return
    sources, starts, units, lengths, responses, wavenumbers, place = map(np.concatenate, zip(*paths, strict=True))
    sums = csr_array((responses, (place, np.arange(len(place)))), shape=(shape[0] * shape[1], len(place)))
    step = max(1, AT_ONCE // max(1, 3 * len(place)))
    for start in range(0, len(elements), step):
        shifts = elements[start : start + step, sources] - starts
        if first_order:
            longer, weaker = np.einsum("gpi,pi->gp", shifts, units), 1.0
        else:
            there = np.linalg.norm(shifts + lengths[:, None] * units, axis=-1)
            longer, weaker = there - lengths, lengths / there
        yield (sums @ (weaker * np.exp(-1j * wavenumbers * longer)).T).T.reshape(-1, *shape)
