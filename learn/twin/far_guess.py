"""A first guess of the gateway's pose where this may be many half wavelengths from the description.

So far away, a path's length does not change in proportion to the displacement. But behind a reflection or a
transmission the transmitter appears at an image, which stays where it is if the gateway moves. The length is therefore
the distance to this image, however far the gateway moves, as long as the path exists. Other paths exist elsewhere, so
that the scene is traced again at the most likely guesses, and more are drawn near each of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from jaxtyping import Bool, Complex, Float
from scipy.sparse import csr_array
from scipy.spatial.transform import Rotation

from learn.twin.first_guess import AT_ONCE, COMPARED, misfits
from learn.twin.linearised import moved, over_band
from scenes.checks.array_clearance import element_positions
from scenes.checks.validation import is_valid
from scenes.scene.description import Scene
from scenes.scene.unknowns import OF_POSE, Unknown, vary
from simulate.rays.tracer import Tracer
from simulate.spectra.spectrum import evenly

FAR = 0.5
"""Wavelengths. If the gateway's position has a larger tolerance, small steps hardly lead to it."""

DRAWN, NEARBY = 4000, 300
"""Numbers of poses that are drawn from the prior, and near each that is kept."""

KEPT = 8
"""Number of guesses near which the scene is traced again."""

APART = 0.5
"""Wavelengths. The positions of two guesses that are kept are no closer."""

NARROWER = (1 / 3, 1 / 9, 1 / 27)
"""Standard deviations of the draws around the guesses that are kept, in those of the prior."""


def is_far(scene: Scene, which: Sequence[Unknown]) -> bool:
    """Whether the gateway may be so far from its described position that ``far_guess`` is needed."""
    return any(each.kind == "position" and each.tolerance > FAR * scene.wavelength for each in which)


def far_guess(
    tracer: Tracer,
    ratios: Sequence[float],
    which: Sequence[Unknown],
    positions: Float[np.ndarray, "K 3"],
    measured: Complex[np.ndarray, "K M"],
    flips: bool,
    counted: int,
) -> Float[np.ndarray, " n"]:
    """Values of a scene's unknowns near the most likely pose, as ``first_guess`` has them, for poses from far away.

    Thousands of poses are drawn from the prior, and scored by paths to fixed images. Eight that lie apart are kept. At
    each the scene is traced with chains found anew, more poses are drawn around it, ever closer, and the most likely
    one takes its place. The likelihood is that of ``first_guess``, in which each position has a phase of its own.
    """
    described, propagation = tracer.ray_scene.description, tracer.ray_scene.propagation
    compared = evenly(np.arange(len(positions)), COMPARED)
    places, wanted = positions[compared], measured[compared]
    region = np.stack([positions.min(axis=0), positions.max(axis=0)])
    prior = np.array([each.tolerance for each in which])
    spread = prior * [each.kind in OF_POSE for each in which]
    generator = np.random.default_rng(0)

    def unlikely(traced: Tracer, guesses: Float[np.ndarray, "G n"]) -> Float[np.ndarray, " G"]:
        """−2 log of the posterior of guesses, by the paths of a tracer at a pose near them."""
        batches = _responses(over_band(traced, ratios), places, elements_of(described, which, guesses))
        left = [misfits(found, wanted, flips, counted) for found in batches]
        return np.concatenate(left) + ((guesses / prior) ** 2).sum(axis=1)

    def valid(guess: Float[np.ndarray, " n"]) -> bool:
        return is_valid(vary(described, which, guess))

    drawn = generator.normal(size=(DRAWN, len(which))) * spread
    drawn[0] = 0
    drawn = drawn[inside(described, which, drawn)]
    drawn = drawn[unlikely(tracer, drawn).argsort(kind="stable")]
    position = [number for number, each in enumerate(which) if each.kind == "position"]
    best, least = np.zeros(len(which)), np.inf
    for guess in kept_apart(drawn, position, APART * described.wavelength, valid):
        traced = Tracer(vary(described, which, guess), propagation, region)
        for narrower in NARROWER:
            near = guess + generator.normal(size=(NEARBY, len(which))) * spread * narrower
            near[0] = guess
            order = unlikely(traced, near).argsort(kind="stable")
            guess = next(near[number] for number in order if valid(near[number]))
            traced = moved(traced, vary(described, which, guess), region)
        value = unlikely(traced, guess[None])[0]
        if value < least:
            best, least = guess, value
    return best


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


def _responses(
    band: Sequence[Tracer], positions: Float[np.ndarray, "K 3"], elements: Float[np.ndarray, "G M 3"]
) -> Iterator[Complex[np.ndarray, "g K M*used"]]:
    """Responses at positions for each guess of the elements' places, in batches of guesses."""
    number = elements.shape[1]
    shape = len(positions), number * len(band)
    paths = []
    for column, tracer in enumerate(band):
        wavenumber = 2 * np.pi / tracer.ray_scene.description.wavelength
        for batch in tracer.multipath(positions):
            lengths, (by_element, _) = batch.lengths(), batch.length_derivatives()
            images = batch.vertices[:, 0] - lengths[:, None] * by_element
            amplitudes = batch.responses * lengths * np.exp(1j * wavenumber * lengths)
            place = (batch.targets * len(band) + column) * number + batch.sources
            paths.append((batch.sources, images, amplitudes, np.full(len(place), wavenumber), place))
    if not paths:
        yield np.zeros((len(elements), *shape), complex)
        return
    sources, images, amplitudes, wavenumbers, place = (np.concatenate(each) for each in zip(*paths, strict=True))
    sums = csr_array((amplitudes, (place, np.arange(len(place)))), shape=(shape[0] * shape[1], len(place)))
    step = max(1, AT_ONCE // max(1, 3 * len(place)))
    for start in range(0, len(elements), step):
        lengths = np.linalg.norm(elements[start : start + step, sources] - images, axis=-1)
        found = sums @ (np.exp(-1j * wavenumbers * lengths) / lengths).T
        yield found.T.reshape(-1, *shape)
