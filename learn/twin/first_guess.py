"""A first guess of the gateway's pose: the one of many that its prior allows whose responses are most like measured."""

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
"""Poses that are tried, the described one among them."""

COMPARED = 20
"""Largest number of positions that they are compared at."""

LEAST_MISFIT = 1e-6
"""Of 1 − s: more alike is a rounding error."""

AT_ONCE = 4_000_000
"""Phases computed at once: bounds the memory."""


def first_guess(
    tracer: Tracer,
    which: Sequence[Unknown],
    positions: Float[np.ndarray, "K 3"],
    measured: Complex[np.ndarray, "K M"],
    flips: bool,
    counted: int,
) -> Float[np.ndarray, " n"]:
    """Values of a scene's unknowns from which Gauss–Newton steps lead to the right minimum more often than from 0.

    A gateway that is described a third of a wavelength away from where it is makes the responses so different that
    steps from there can end anywhere. Here many poses are drawn from the prior. Each path's length changes with them to
    first order (``simulate.rays.core.terms``), so that y = Σ a e^{−jk(L + δL)} takes no tracing. The most likely pose
    is returned: with the mean s of |⟨y, measured⟩|² / (|y|² |measured|²) over the positions, on which a phase and a
    scale of each position's own have no effect, −2 log of its posterior is 2 N log(1 − s) + Σ (value / tolerance)², but
    for a constant. N is the number of responses that count.

    Args:
        tracer: of the scene as described.
        which: its n unknowns; those that are not of the pose stay 0.
        positions: of the transmitters, metres, world frame.
        measured: element responses.
        flips: whether these may be flipped, as behind pictures (y_m → conj y_{M−1−m}).
        counted: N.
    """
    of_pose = [number for number, each in enumerate(which) if each.kind in OF_POSE]
    if not of_pose:
        return np.zeros(len(which))
    scene, guesses = tracer.ray_scene.description, np.zeros((GUESSES, len(which)))
    deviations = [which[number].tolerance for number in of_pose]
    guesses[1:, of_pose] = np.random.default_rng(0).normal(size=(GUESSES - 1, len(of_pose))) * deviations
    compared = evenly(np.arange(len(positions)), COMPARED)
    found = _responses(tracer, which, positions[compared], guesses)
    wanted = measured[compared]
    alike = np.abs(np.einsum("gkm,km->gk", found, wanted.conj()))
    if flips:
        alike = np.maximum(alike, np.abs(np.einsum("gkm,km->gk", found, wanted[:, ::-1])))
    size = np.linalg.norm(found, axis=-1) * np.linalg.norm(wanted, axis=-1)
    score = np.divide(alike, size, out=np.zeros_like(alike), where=size > 0) ** 2
    unlikely = 2 * counted * np.log(np.maximum(1 - score.mean(axis=1), LEAST_MISFIT))
    unlikely += ((guesses[:, of_pose] / deviations) ** 2).sum(axis=1)
    for guess in guesses[unlikely.argsort(kind="stable")]:
        if is_valid(vary(scene, which, guess)):
            return guess
    return guesses[0]


def _responses(
    tracer: Tracer,
    which: Sequence[Unknown],
    positions: Float[np.ndarray, "K 3"],
    guesses: Float[np.ndarray, "G n"],
) -> Complex[np.ndarray, "G K M"]:
    """Responses to transmitters, for each guess of the unknowns of the pose."""
    elements, wavenumber = len(tracer.elements), 2 * np.pi / tracer.ray_scene.description.wavelength
    total = np.zeros((len(positions) * elements, len(guesses)), complex)
    for batch in tracer.terms(positions):
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
