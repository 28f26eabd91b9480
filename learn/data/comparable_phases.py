"""What a dataset lacks for methods that compare the phases of responses between positions."""

from __future__ import annotations

from simulate.dataset.dataset import Dataset


def no_comparable_phases(dataset: Dataset) -> str:
    """What was expected and what was found, for the user, where phases of two positions cannot be compared."""
    apart = dataset.phases_recorded_per_position
    found = "phases that cannot be compared between positions" if apart else "pictures alone"
    return f"expected element responses with their phases, found {found}"
