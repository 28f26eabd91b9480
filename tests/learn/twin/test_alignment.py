"""Measured responses in the phases and scales of traced ones."""

import numpy as np

from learn.twin.gains import aligned_to


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
