"""The interface of an engine: what computes the element responses of a simulation.

A new engine is a frozen dataclass that extends ``Engine``, in a file of its own, and a line in
``simulate.engines.engine_table``. The attributes of the dataclass are the engine's options. ``bisplat simulate`` and
``bisplat.simulate`` then offer these options, and metadata.json records them.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Protocol, Self

import msgspec
import numpy as np
from jaxtyping import Complex, Float

from simulate.parallel.machines import Machines, require_ray

if TYPE_CHECKING:  # their imports take long, and the help of the command line does not need them
    from rich.progress import Progress

    from scenes.scene.description import Scene
    from simulate.spectra.band import Band


class ResponseSource(Protocol):
    """Computes the responses of all elements to transmitters anywhere in a setting's region, at one frequency."""

    def responses(self, positions: Float[np.ndarray, "K 3"]) -> Complex[np.ndarray, "K elements"]: ...


class BandSource(ResponseSource, Protocol):
    """Computes the responses over a band, too. The sources of an engine with ``knows_bands`` do."""

    def band_responses(
        self, positions: Float[np.ndarray, "K 3"], band: Band
    ) -> Complex[np.ndarray, "K elements subcarriers"]: ...


class Setting(NamedTuple):
    """The scene, region and seed for which an engine computes responses."""

    scene: Scene  # with one gateway; the one of the lowest frequency if there are several
    region: Float[np.ndarray, "2 3"]  # lowest and highest corner of a box around all transmitters, metres, world frame
    seed: int  # of everything that the engine draws at random
    band: Band | None = None  # subcarriers at which responses are wanted. None: only at the carrier.
    further: tuple[Scene, ...] = ()  # at further frequencies, rising, with an array of the same size in metres

    @property
    def scenes(self) -> list[Scene]:
        """The scene at each frequency, rising."""
        return [self.scene, *self.further]


@dataclass(frozen=True)
class Engine(ABC):
    """Computes element responses. The attributes of an engine are its options."""

    name: ClassVar[str]
    """Name of the engine on the command line and in metadata.json; a Python identifier."""

    called: ClassVar[str]  # What its responses are called in reports, such as "fresh ray tracing"

    packages: ClassVar[tuple[str, ...]] = ("numpy",)  # Packages whose versions metadata.json records

    always_recorded: ClassVar[bool] = True
    """Whether every metadata.json of its datasets has the engine's part. If so, one without it is refused."""

    keeps_source: ClassVar[bool] = False
    """Whether ``sources`` takes long, so that its result is stored in the dataset folder, where ``kept`` reads it. It
    uses the workers itself, whereas other engines leave them the parts of a dataset."""

    knows_bands: ClassVar[bool] = False
    """Whether it computes responses over a band: its sources are each a ``BandSource``."""

    knows_frequencies: ClassVar[bool] = False
    """Whether ``sources`` computes the responses at several frequencies."""

    def for_scene(self, scene: Scene, frequencies: Sequence[float] = ()) -> Self:
        """This engine, with the options filled in that depend on the scene, its frequencies or what is installed."""
        return self

    def metadata(self, setting: Setting) -> dict[str, Any]:
        """The engine's part of metadata.json: its name, and every option that the responses depend on."""
        return {"engine": self.name, self.name: asdict(self)}

    @classmethod
    def schema(cls) -> dict[str, Any]:
        """The types of the keys that ``metadata`` returns, except the name; metadata.json is checked against them."""
        return {cls.name: cls}

    @classmethod
    def of(cls, metadata: Mapping[str, Any]) -> Self:
        """The engine that a dataset was simulated with, from its metadata.json, which has been checked."""
        return msgspec.convert(metadata[cls.name], cls)

    def versions(self) -> dict[str, str]:
        """Versions of ``packages``, for metadata.json."""
        return {name: version(name) for name in self.packages}

    def require(self, setting: Setting, folder: Path, machines: Machines) -> None:
        """Make sure that the engine can run, before anything is written into the dataset folder."""
        if machines != Machines():
            require_ray(machines.ray)

    def again(self, recorded: Engine) -> Engine:
        """The engine that repeats a simulation: the recorded one, with what is not recorded from this one."""
        return recorded

    @abstractmethod
    def source(self, setting: Setting, folder: Path, machines: Machines, progress: Progress) -> ResponseSource:
        """Prepare what computes the responses, such as a tracer. The dataset folder may store what takes long."""

    def sources(
        self, settings: Sequence[Setting], folder: Path, machines: Machines, progress: Progress
    ) -> list[list[ResponseSource]]:
        """``source`` for each scene of several settings; only those with ``knows_frequencies`` get several scenes."""
        return [[self.source(setting, folder, machines, progress)] for setting in settings]

    def is_whole(self, setting: Setting, folder: Path) -> bool:
        """Whether a finished dataset folder still has what ``sources`` stored in it."""
        return True

    @classmethod
    def kept(cls, setting: Setting, folder: Path) -> ResponseSource:
        """Read what ``sources`` of an engine with ``keeps_source`` stored in a dataset folder."""
        raise NotImplementedError

    def sent(self, sources: list[ResponseSource]) -> Any:
        """What a worker needs, besides the setting, to compute the same responses as some sources of it."""
        return sources

    def received(self, setting: Setting, sent: Any, threads: int) -> list[ResponseSource]:
        """Prepare in a worker, from what ``sent`` returned, what ``sources`` prepared in the main process."""
        return sent
