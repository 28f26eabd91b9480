"""What an engine is: the interface between a simulation and how its responses are found.

A new engine is a frozen dataclass of its options that extends ``Engine``, in a file of its own, and a line in
``simulate.engines.engine_table``. Its options are then options of ``bisplat simulate`` and ``bisplat.simulate``, and
metadata.json records them.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Protocol, Self

import msgspec
import numpy as np
from jaxtyping import Complex, Float

from scenes.files.errors import require_whole
from simulate.parallel.ray_cluster import require_ray

if TYPE_CHECKING:  # their imports take long, and the help of the command line does not need them
    from rich.progress import Progress

    from scenes.scene.description import Scene

WORKERS_MOST = 1000
"""Largest number of Ray workers, or of the solver's runs at a time."""


class ResponseSource(Protocol):
    """Tells the responses of all elements to transmitters anywhere in a setting's region."""

    def responses(self, positions: Float[np.ndarray, "K 3"]) -> Complex[np.ndarray, "K elements"]: ...


class Setting(NamedTuple):
    """What responses are found in.

    Attributes:
        scene: the scene, of one gateway.
        region: lowest and highest corner of the box that all transmitters are in, metres, world frame.
        seed: of whatever the engine draws at random.
    """

    scene: Scene
    region: Float[np.ndarray, "2 3"]
    seed: int


@dataclass(frozen=True)
class Machines:
    """Where a simulation runs. The results are the same everywhere.

    Attributes:
        workers: number of parallel Ray workers (needs bisplat-wrf[ray]), or of parallel runs in full wave. By default
            rays are traced in this process, and full wave has a run per core.
        ray: address of a running Ray cluster that does the work.

    Raises:
        ParameterError: no workers, or more than ``WORKERS_MOST``.
    """

    workers: int | None = None
    ray: str | None = None

    def __post_init__(self) -> None:
        if self.workers is not None:
            require_whole(1, WORKERS_MOST, workers=self.workers)


@dataclass(frozen=True)
class Engine(ABC):
    """How responses are simulated. Its attributes are its options."""

    name: ClassVar[str]
    """On the command line, and in metadata.json: a Python identifier."""

    called: ClassVar[str]
    """What its responses are, for reports: "fresh ray tracing"."""

    packages: ClassVar[tuple[str, ...]] = ("numpy",)
    """Packages whose versions metadata.json records."""

    always_recorded: ClassVar[bool] = True
    """Whether every metadata.json of its datasets has the engine's part; one without it is then refused."""

    spreads_parts: ClassVar[bool] = True
    """Whether parts of a dataset are made by Ray workers, if there are any; otherwise ``source`` uses the workers."""

    keeps_source: ClassVar[bool] = False
    """Whether ``source`` takes so long that what it makes is kept in the dataset folder, for ``kept`` to read."""

    def for_scene(self, scene: Scene) -> Self:
        """This engine, with those options set that depend on the scene or on what is installed.

        Args:
            scene: the scene.
        """
        return self

    def metadata(self, setting: Setting) -> dict[str, Any]:
        """The engine's part of metadata.json: everything of it that the responses depend on, and its name.

        Args:
            setting: what the responses are found in.
        """
        return {"engine": self.name, self.name: asdict(self)}

    @classmethod
    def schema(cls) -> dict[str, Any]:
        """The types of the keys that ``metadata`` has beside the name, for the check of metadata.json."""
        return {cls.name: cls}

    @classmethod
    def of(cls, metadata: Mapping[str, Any]) -> Self:
        """The engine that a dataset was made by.

        Args:
            metadata: content of its metadata.json, which has been checked.
        """
        return msgspec.convert(metadata[cls.name], cls)

    def require(self, machines: Machines) -> None:
        """Make sure, before anything is written, that the engine can run.

        Args:
            machines: where it is to run.

        Raises:
            InputError: a package or library is missing.
            ParameterError: no Ray cluster at the address.
        """
        if machines != Machines():
            require_ray(machines.ray)

    def again(self, recorded: Engine) -> Engine:
        """The engine that makes a dataset once more: the recorded one, with options of this one that are not recorded.

        Args:
            recorded: the engine that made the dataset.
        """
        return recorded

    @abstractmethod
    def source(self, setting: Setting, folder: Path, machines: Machines, progress: Progress) -> ResponseSource:
        """Find what tells the responses.

        Args:
            setting: what they are found in.
            folder: the dataset folder, which may keep what takes long.
            machines: where to run.
            progress: shows what is done.

        Raises:
            InputError: it failed.
        """

    def is_whole(self, folder: Path) -> bool:
        """Whether a finished dataset folder still has what ``source`` kept in it.

        Args:
            folder: the dataset folder.
        """
        return True

    @classmethod
    def kept(cls, folder: Path) -> ResponseSource:
        """What ``source`` has kept in a dataset folder; only where ``keeps_source``.

        Args:
            folder: the dataset folder.

        Raises:
            InputError: it is not there, or damaged.
        """
        raise NotImplementedError

    def sent(self, source: ResponseSource) -> Any:
        """What a worker needs, beside the setting, to find the same responses.

        Args:
            source: from ``source``.
        """
        return source

    def received(self, setting: Setting, sent: Any, threads: int) -> ResponseSource:
        """The source in a worker.

        Args:
            setting: what the responses are found in.
            sent: from ``sent``.
            threads: that the worker may use.
        """
        return sent
