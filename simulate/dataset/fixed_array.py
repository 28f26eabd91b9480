"""The refusal of datasets whose receiver moves, by what traces a scene with a fixed array."""

from __future__ import annotations

from scenes.files.errors import InputError
from simulate.dataset.dataset_folder import Dataset


def require_fixed_array(dataset: Dataset, what: str) -> None:
    """Refuse a dataset whose receiver moves, for what traces the scene with a fixed array.

    Args:
        dataset: the dataset.
        what: what needs a fixed array, for the message.

    Raises:
        InputError: the receiver moves.
    """
    if dataset.moving == "receiver":
        raise InputError(
            f"{dataset.folder}: expected a dataset whose transmitter moves, for {what}, found one whose receiver moves"
        )
