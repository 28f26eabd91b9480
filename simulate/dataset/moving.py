"""Which end of the link is at a dataset's positions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from scenes.files.errors import InputError

if TYPE_CHECKING:
    from simulate.dataset.dataset_folder import Dataset

Moving = Literal["transmitter", "receiver"]
"""What moves. The other end stands at the gateway's position. If the receiver moves, its array keeps the gateway's
orientation. "RX moving" is the name that SwiftWRF [liu2025] gives to such data."""


def require_moving_transmitter(dataset: Dataset, what: str) -> None:
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
