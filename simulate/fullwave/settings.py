"""How a scene is simulated in full wave."""

from __future__ import annotations

from dataclasses import dataclass

from scenes.files.errors import require_positive

OURS = "bisplat"
"""Name of our own solver."""


@dataclass(frozen=True)
class FullWave:
    """Settings of the full-wave engine.

    Attributes:
        cell: side of the cells, metres.
        solver: ``OURS``, or gprMax and its version.

    Raises:
        ParameterError: a cell that is no positive, finite number.
    """

    cell: float
    solver: str

    def __post_init__(self) -> None:
        require_positive(cell=self.cell)
