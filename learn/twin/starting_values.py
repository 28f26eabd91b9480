"""Starting values of a calibration: of many poses drawn from the prior, the most likely one given measured responses.

A path's length changes in proportion to a small displacement of the gateway. Far away it does not. But behind a
reflection or a transmission the transmitter appears at an image, which stays where it is if the gateway moves, so that
the length is the distance to this image as long as the path exists. Other paths exist elsewhere, so the scene is traced
again at the most likely poses, and more are drawn near each of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from jaxtyping import Bool, Complex, Float
from scipy.sparse import csr_array
from scipy.spatial.transform import Rotation

from learn.twin.linearised import moved, over_band
from scenes.checks.occupancy import element_positions
from scenes.checks.validation import is_valid
from scenes.scene.description import Scene
from scenes.scene.unknowns import OF_POSE, Unknown, vary
from simulate.rays.derivatives import by_rotation
from simulate.rays.tracer import Tracer
from simulate.spectra.spectrum import evenly

GUESSES = 1000  # Number of poses that are tried, including the described one

COMPARED = 20  # Largest number of positions at which they are compared

LEAST_MISFIT = 1e-6  # Least value of 1 − s; smaller values are rounding errors

AT_ONCE = 4_000_000  # Number of phases computed at once, which bounds the memory


def start_nearby(
    band: Sequence[Tracer],
    which: Sequence[Unknown],
    positions: Float[np.ndarray, "K 3"],
    measured: Complex[np.ndarray, "K M"],
    flips: bool,
    counted: int,
) -> Float[np.ndarray, " n"]:
    """Values of a scene's unknowns from which Gauss–Newton steps lead to the right minimum more often than from 0.

    If the gateway is described a third of a wavelength from its true place, the responses are so different that steps
    from there can end anywhere. Therefore many poses are drawn from the prior. The length of each path changes with the
    pose to first order (``simulate.rays.core.multipath``), so that y = Σ a e^{−jk(L + δL)} needs no tracing.

    The most likely pose is returned. Let s be the mean over the positions of |⟨y, measured⟩|² / (|y|² |measured|²), on
    which a separate phase and scale of each position have no effect. Then −2 log of the posterior is, up to a constant,
    2 N log(1 − s) + Σ (value / tolerance)². N is the number of responses that count as independent.
    """
    of_pose = [number for number, each in enumerate(which) if each.kind in OF_POSE]
    if not of_pose:
        return np.zeros(len(which))
    scene, guesses = band[0].ray_scene.description, np.zeros((GUESSES, len(which)))
    guesses[:, of_pose] = drawn_poses([which[number] for number in of_pose])
    deviations = [which[number].tolerance for number in of_pose]
    compared = evenly(np.arange(len(positions)), COMPARED)
    found = np.concatenate([responses_of(each, which, positions[compared], guesses) for each in band], axis=-1)
    unlikely = misfits(found, measured[compared], flips, counted)
    unlikely += ((guesses[:, of_pose] / deviations) ** 2).sum(axis=1)
    for guess in guesses[unlikely.argsort(kind="stable")]:
        if is_valid(vary(scene, which, guess)):
            return guess
    return guesses[0]


def misfits(
    found: Complex[np.ndarray, "G K M"], measured: Complex[np.ndarray, "K M"], flips: bool, counted: int
) -> Float[np.ndarray, " G"]:
    """−2 log of the likelihood of each guess, 2 N log(1 − s), as ``start_nearby`` has it."""
    alike = np.abs(np.einsum("gkm,km->gk", found, measured.conj()))
    if flips:
        alike = np.maximum(alike, np.abs(np.einsum("gkm,km->gk", found, measured[:, ::-1])))
    size = np.linalg.norm(found, axis=-1) * np.linalg.norm(measured, axis=-1)
    score = np.divide(alike, size, out=np.zeros_like(alike), where=size > 0) ** 2
    return 2 * counted * np.log(np.maximum(1 - score.mean(axis=1), LEAST_MISFIT))


def drawn_poses(which: Sequence[Unknown]) -> Float[np.ndarray, "G n"]:
    """Draws of the unknowns of a pose from their prior; the first one is the description."""
    drawn = np.random.default_rng(0).normal(size=(GUESSES - 1, len(which))) * [each.tolerance for each in which]
    return np.vstack([np.zeros(len(which)), drawn])


def responses_of(
    tracer: Tracer,
    which: Sequence[Unknown],
    positions: Float[np.ndarray, "K 3"],
    guesses: Float[np.ndarray, "G n"],
) -> Complex[np.ndarray, "G K M"]:
    """Responses at positions, for each guess of the pose."""
    elements, wavenumber = len(tracer.elements), 2 * np.pi / tracer.ray_scene.description.wavelength
    total = np.zeros((len(positions) * elements, len(guesses)), complex)
    for batch in tracer.multipath(positions):
        by_element, _ = batch.length_derivatives()
        changes = {"position": by_element, "rotation": by_rotation(tracer, batch.sources, by_element)}
        by_unknown = np.zeros((len(batch.responses), len(which)))
        for column, unknown in enumerate(which):
            if unknown.kind in changes:
                by_unknown[:, column] = changes[unknown.kind][:, unknown.axis]
        place = batch.targets * elements + batch.sources
        sums = csr_array((batch.responses, (place, np.arange(len(place)))), shape=(len(total), len(place)))
        step = max(1, AT_ONCE // max(1, len(place)))
        for start in range(0, len(guesses), step):
            longer = by_unknown @ guesses[start : start + step].T
            total[:, start : start + step] += sums @ np.exp(-1j * wavenumber * longer)
    return total.T.reshape(len(guesses), len(positions), elements)


FAR = 0.5
"""Wavelengths. If the gateway's position has a larger tolerance, small steps hardly lead to it."""

DRAWN, NEARBY = 4000, 300  # Numbers of poses that are drawn from the prior, and near each that is kept

KEPT = 8  # Number of guesses near which the scene is traced again

APART = 0.5  # Wavelengths. The positions of two guesses that are kept are no closer.

NARROWER = (1 / 3, 1 / 9, 1 / 27)
"""Standard deviations of the draws around the guesses that are kept, in those of the prior."""


def is_far(scene: Scene, which: Sequence[Unknown]) -> bool:
    """Whether the gateway may be so far from its described position that ``start_far_away`` is needed."""
    return any(each.kind == "position" and each.tolerance > FAR * scene.wavelength for each in which)


def start_far_away(
    tracer: Tracer,
    ratios: Sequence[float],
    which: Sequence[Unknown],
    positions: Float[np.ndarray, "K 3"],
    measured: Complex[np.ndarray, "K M"],
    flips: bool,
    counted: int,
) -> Float[np.ndarray, " n"]:
    """As ``start_nearby``, for poses from far away: draws are scored by paths to fixed images, the best are traced.

    At each of the eight that are kept, more poses are drawn around it, ever closer, and the most likely one follows.
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
