"""An engine for tests, and an example of one: short dipoles in free space, in closed form, whatever the objects."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from jaxtyping import Complex, Float

from benchmarks.ledger.exact_fields import free_space_response
from scenes.checks.occupancy import element_positions
from scenes.files.errors import require_within
from scenes.scene.description import Scene
from simulate.engines.engine import Engine, ResponseSource, Setting
from simulate.parallel.machines import Machines

if TYPE_CHECKING:
    from rich.progress import Progress

UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class FreeSpaceField:
    """The responses of a scene's elements."""

    scene: Scene
    loss: float

    def responses(self, positions: Float[np.ndarray, "K 3"]) -> Complex[np.ndarray, "K elements"]:
        elements = element_positions(self.scene.gateway, self.scene.wavelength)
        fields = [free_space_response(each, UP, positions, UP, self.scene.frequency) for each in elements]
        return (10 ** (-self.loss / 20) * np.stack(fields, axis=1)).astype(np.complex64)


@dataclass(frozen=True)
class FreeSpace(Engine):
    """The field in free space, in microseconds."""

    loss: float = 0.0  # what a cable takes, dB

    name: ClassVar[str] = "freespace"
    called: ClassVar[str] = "free space"

    def __post_init__(self) -> None:
        require_within(0, 100, "a loss in dB", loss=self.loss)

    def source(self, setting: Setting, folder: Path, machines: Machines, progress: Progress) -> ResponseSource:
        return FreeSpaceField(setting.scene, self.loss)
