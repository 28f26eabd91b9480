"""The refusals of datasets by which end of the link moves: for what traces a fixed array, and for what learns."""

from __future__ import annotations

from scenes.files.errors import InputError
from simulate.dataset.dataset import Dataset


def require_fixed_array(dataset: Dataset, what: str) -> None:
    """Refuse a dataset whose receiver moves, for what traces the scene with a fixed array."""
    require_fixed_end(dataset)
    if dataset.moving == "receiver":
        raise InputError(
            f"{dataset.folder}: expected a dataset whose transmitter moves, for {what}, found one whose receiver moves"
        )


def require_fixed_end(dataset: Dataset) -> None:
    """Refuse a dataset of which both ends move, for what takes spectra as a function of one position."""
    if dataset.moving == "both":
        raise InputError(
            f"{dataset.folder}: expected spectra of a link with one end that stands still, found some whose "
            "transmitter and receiver both move; simulate --moving receiver makes spectra of one transmitter"
        )
