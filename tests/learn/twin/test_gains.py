"""Gains of chains: found in a common gain or behind pictures, and tested on positions that they were not found from."""

import numpy as np
import pytest

from learn.twin.gains import aligned_gains, aligned_to


def test_aligned_responses_are_nearer_the_more_alike_they_are():
    """The share that a phase and a scale of each position's own leave unexplained is 1 − ρ²."""
    generator = np.random.default_rng(0)
    traced, other = generator.normal(size=(2, 200, 16, 2)) @ [1, 1j]
    unit = traced / np.linalg.norm(traced, axis=1, keepdims=True)
    other -= unit * (unit.conj() * other).sum(axis=1, keepdims=True)
    other *= np.linalg.norm(traced, axis=1, keepdims=True) / np.linalg.norm(other, axis=1, keepdims=True)
    for alike in (0.9, 0.6, 0.2):
        measured = 3j * (alike * traced + np.sqrt(1 - alike**2) * other)
        aligned = aligned_to(measured, traced, phases_known=False, flips=True)[0]
        across = aligned - unit * (unit.conj() * aligned).sum(axis=1, keepdims=True)
        share = (np.abs(across) ** 2).sum() / (np.abs(aligned) ** 2).sum()
        assert share <= 1 - alike**2 + 1e-6 and share > 0.8 * (1 - alike**2)  # the flipped one may be nearer
    np.testing.assert_allclose(np.linalg.norm(aligned, axis=1), np.linalg.norm(traced, axis=1))


GENERATOR = np.random.default_rng(0)
BY_CHAIN = GENERATOR.normal(size=(24, 16, 30, 2)) @ [1, 1j] * np.geomspace(1, 0.1, 30)
TRACED = BY_CHAIN.sum(axis=-1)
TRUE = BY_CHAIN @ (1 + 0.2 * GENERATOR.normal(size=(30, 2)) @ [1, 1j])


def unlike(found):
    """Median over the positions of 1 − correlation with the true responses."""
    product = np.abs((found.conj() * TRUE).sum(axis=1))
    return np.median(1 - product / np.linalg.norm(found, axis=1) / np.linalg.norm(TRUE, axis=1))


@pytest.mark.parametrize("phases_known", [True, False])
def test_gains_are_found(phases_known):
    own = np.exp(1j * np.arange(24))[:, None] / np.linalg.norm(TRUE, axis=1, keepdims=True)
    gains, held_out = aligned_gains(BY_CHAIN, TRACED, TRUE * (3j if phases_known else own), phases_known, True)
    assert unlike(BY_CHAIN @ (1 + gains)) < 0.2 * unlike(TRACED)
    assert unlike(held_out) < 0.2 * unlike(TRACED)


def test_a_position_is_tested_with_gains_that_are_not_from_it():
    """Where noise is measured, the gains of all positions fit it; those of the other parts fit the true responses."""
    measured = TRUE.copy()
    measured[::4] = GENERATOR.normal(size=(6, 16, 2)) @ [1, 1j] * np.abs(TRUE).mean()
    gains, held_out = aligned_gains(BY_CHAIN, TRACED, measured, phases_known=True, flips=True)
    fitted = BY_CHAIN @ (1 + gains)
    assert np.abs(fitted - measured)[::4].mean() < np.abs(held_out - measured)[::4].mean()
    assert np.abs(fitted - TRUE)[::4].mean() > np.abs(held_out - TRUE)[::4].mean()


def test_a_single_position_is_left_as_traced():
    _, held_out = aligned_gains(BY_CHAIN[:1], TRACED[:1], TRUE[:1], phases_known=True, flips=True)
    np.testing.assert_array_equal(held_out, TRACED[:1])


def test_responses_of_elements_at_given_places_are_never_flipped():
    """Flipped responses fit the traced ones exactly, so where flips are allowed no gains are left to find."""
    flipped = TRACED[:, ::-1].conj()
    allowed, forbidden = (
        aligned_gains(BY_CHAIN, TRACED, flipped, phases_known=False, flips=flips)[0] for flips in (True, False)
    )
    assert np.abs(allowed).max() < 1e-6 and np.abs(forbidden).max() > 0.01
