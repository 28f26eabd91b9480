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
    """The scene, region and seed for which an engine computes responses.

    Attributes:
        scene: the scene, with one gateway; the one of the lowest frequency if there are several.
        region: lowest and highest corner of a box around all transmitters, metres, world frame, [2, 3].
        seed: seed of everything that the engine draws at random.
        band: subcarriers at which responses are wanted. None: only at the carrier.
        further: the scene at further frequencies, rising, with an array of the same size in metres.
    """

    scene: Scene
    region: Float[np.ndarray, "2 3"]
    seed: int
    band: Band | None = None
    further: tuple[Scene, ...] = ()

    @property
    def scenes(self) -> list[Scene]:
        """The scene at each frequency, rising."""
        return [self.scene, *self.further]


@dataclass(frozen=True)
class Engine(ABC):
    """Computes element responses. The attributes of an engine are its options."""

    name: ClassVar[str]
    """Name of the engine on the command line and in metadata.json; a Python identifier."""

    called: ClassVar[str]
    """What its responses are called in reports, such as "fresh ray tracing"."""

    packages: ClassVar[tuple[str, ...]] = ("numpy",)
    """Packages whose versions metadata.json records."""

    always_recorded: ClassVar[bool] = True
    """Whether every metadata.json of its datasets has the engine's part. If so, one without it is refused."""

    spreads_parts: ClassVar[bool] = True
    """Whether Ray workers make the parts of a dataset. If not, ``sources`` uses the workers itself."""

    keeps_source: ClassVar[bool] = False
    """Whether ``sources`` takes long, so that its result is stored in the dataset folder, where ``kept`` reads it."""

    knows_bands: ClassVar[bool] = False
    """Whether it computes responses over a band: its sources are each a ``BandSource``."""

    knows_frequencies: ClassVar[bool] = False
    """Whether ``sources`` computes the responses at several frequencies."""

    def for_scene(self, scene: Scene, frequencies: Sequence[float] = ()) -> Self:
        """This engine, with the options filled in that depend on the scene or on what is installed.

        Args:
            scene: the scene to simulate.
            frequencies: frequencies at which it is simulated, Hz, rising. Empty: that of the scene.

        Returns:
            The engine whose options metadata.json records.
        """
        return self

    def metadata(self, setting: Setting) -> dict[str, Any]:
        """The engine's part of metadata.json: its name, and every option that the responses depend on.

        Args:
            setting: the scene, region and seed of the simulation.

        Returns:
            Keys of metadata.json with their values.
        """
        return {"engine": self.name, self.name: asdict(self)}

    @classmethod
    def schema(cls) -> dict[str, Any]:
        """The types of the keys that ``metadata`` returns, except the name; metadata.json is checked against them."""
        return {cls.name: cls}

    @classmethod
    def of(cls, metadata: Mapping[str, Any]) -> Self:
        """The engine that a dataset was simulated with.

        Args:
            metadata: content of its metadata.json, which has been checked.

        Returns:
            The engine with the recorded options.
        """
        return msgspec.convert(metadata[cls.name], cls)

    def versions(self) -> dict[str, str]:
        """Versions of ``packages``, for metadata.json.

        Raises:
            MissingExtraError: they are not installed.
        """
        return {name: version(name) for name in self.packages}

    def require(self, setting: Setting, folder: Path, machines: Machines) -> None:
        """Make sure that the engine can run, before anything is written.

        Args:
            setting: the scene, region and seed.
            folder: the dataset folder, which need not exist.
            machines: where it is to run.

        Raises:
            InputError: a package or library is missing, or a file that the engine uses does not fit the setting.
            ParameterError: there is no Ray cluster at the address.
        """
        if machines != Machines():
            require_ray(machines.ray)

    def again(self, recorded: Engine) -> Engine:
        """The engine that repeats a simulation: the recorded one, with those options of this one that are not recorded.

        Args:
            recorded: the engine that made the dataset.

        Returns:
            The engine to use.
        """
        return recorded

    @abstractmethod
    def source(self, setting: Setting, folder: Path, machines: Machines, progress: Progress) -> ResponseSource:
        """Prepare what computes the responses, such as a tracer or a stored field.

        Args:
            setting: the scene, region and seed.
            folder: the dataset folder, in which results that take long may be stored.
            machines: where to run.
            progress: shows the progress.

        Returns:
            An object whose method ``responses`` takes positions [K, 3] and returns element responses [K, elements].

        Raises:
            InputError: the computation failed.
        """

    def sources(
        self, settings: Sequence[Setting], folder: Path, machines: Machines, progress: Progress
    ) -> list[list[ResponseSource]]:
        """Prepare what computes the responses in several settings, at each of their frequencies.

        An engine with ``knows_frequencies`` extends this; others never get several frequencies.

        Args:
            settings: the scenes, region and seed; they differ in what stands still in the scene.
            folder: as ``source``.
            machines: as ``source``.
            progress: as ``source``.

        Returns:
            For each setting what ``source`` would return for each of its scenes.

        Raises:
            InputError: the computation failed.
        """
        return [[self.source(setting, folder, machines, progress)] for setting in settings]

    def is_whole(self, setting: Setting, folder: Path) -> bool:
        """Whether a finished dataset folder still has what ``sources`` stored in it.

        Args:
            setting: the scene, region and seed.
            folder: the dataset folder.
        """
        return True

    @classmethod
    def kept(cls, setting: Setting, folder: Path) -> ResponseSource:
        """Read what ``sources`` stored in a dataset folder; only for engines with ``keeps_source``.

        Args:
            setting: the scene, region and seed.
            folder: the dataset folder.

        Returns:
            The source at the frequency of the setting's scene.

        Raises:
            InputError: it is missing or damaged, or does not fit the setting.
        """
        raise NotImplementedError

    def sent(self, sources: list[ResponseSource]) -> Any:
        """What a worker needs, besides the setting, to compute the same responses.

        Args:
            sources: what ``sources`` returned for one setting.
        """
        return sources

    def received(self, setting: Setting, sent: Any, threads: int) -> list[ResponseSource]:
        """Prepare in a worker what ``sources`` prepared in the main process.

        Args:
            setting: the scene, region and seed.
            sent: what ``sent`` returned.
            threads: number of threads that the worker may use.

        Returns:
            What ``sources`` returns for this setting.
        """
        return sent
