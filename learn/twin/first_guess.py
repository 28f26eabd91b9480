"""A first guess of the gateway's pose: of many draws from its prior, the most likely one given measured responses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Complex, Float
from scipy.sparse import csr_array

from scenes.checks.validation import is_valid
from scenes.scene.unknowns import OF_POSE, Unknown, vary
from simulate.rays.derivatives import by_rotation
from simulate.rays.tracer import Tracer
from simulate.spectra.spectrum import evenly

GUESSES = 1000
"""Number of poses that are tried, including the described one."""

COMPARED = 20
"""Largest number of positions at which they are compared."""

LEAST_MISFIT = 1e-6
"""Least value of 1 − s; smaller values are rounding errors."""

AT_ONCE = 4_000_000
"""Number of phases computed at once, which bounds the memory."""


def first_guess(
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
    guesses[:, of_pose] = guessed_poses([which[number] for number in of_pose])
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
    """−2 log of the likelihood of each guess, 2 N log(1 − s), as ``first_guess`` has it."""
    alike = np.abs(np.einsum("gkm,km->gk", found, measured.conj()))
    if flips:
        alike = np.maximum(alike, np.abs(np.einsum("gkm,km->gk", found, measured[:, ::-1])))
    size = np.linalg.norm(found, axis=-1) * np.linalg.norm(measured, axis=-1)
    score = np.divide(alike, size, out=np.zeros_like(alike), where=size > 0) ** 2
    return 2 * counted * np.log(np.maximum(1 - score.mean(axis=1), LEAST_MISFIT))


def guessed_poses(which: Sequence[Unknown]) -> Float[np.ndarray, "G n"]:
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
