"""How a scene is simulated in full wave."""

from __future__ import annotations

from dataclasses import dataclass

from scenes.errors import ParameterError

OURS = "bisplat"
"""Name of our own solver."""


@dataclass(frozen=True)
class FullWave:
    """Settings of the full-wave engine.

    Attributes:
        cell: side of the cells, metres.
        solver: ``OURS``, or gprMax and its version.

    Raises:
        ParameterError: a cell that is not positive.
    """

    cell: float
    solver: str

    def __post_init__(self) -> None:
        if not self.cell > 0:
            raise ParameterError("cell", f"expected metres above 0, found {self.cell}")
