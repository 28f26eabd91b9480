"""The engine that traces rays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

from scenes.files.errors import InputError
from scenes.files.long_work import about
from scenes.files.optional_packages import require_extra
from scenes.files.options import check_kinds
from scenes.files.plain_text import say
from scenes.files.schema import Count, recorded
from simulate.engines.engine import Engine, ResponseSource, Setting
from simulate.parallel.machines import Machines, machine_memory
from simulate.rays.core.propagation import Propagation

if TYPE_CHECKING:  # need the ray tracer
    from rich.progress import Progress

    from simulate.rays.tracer import Tracer

BYTES, BYTES_OF_TRIANGLE = 6e8, 2500
"""Memory of a tracer before it searches for paths: 0.6 GB for Sionna's munich, 0.8 GB for 190,000 triangles."""

SECONDS_OF_TRIANGLE, SECONDS_OF_OBJECT = 30e-6, 0.5e-3
"""What it takes before it searches, in the same scenes."""

DEFAULT_SEED = 1  # Seed of the rays if a dataset does not record one


@dataclass(frozen=True)
class Rays(Engine):
    """Engine that traces rays: milliseconds for each spectrum.

    It searches the scene once for the chains of interactions that carry power, then solves each chain exactly for every
    element and transmitter by the image method. Sionna RT [hoydis2023] launches the rays. ``Tracer`` gives the single
    paths.

    Attributes:
        propagation: what the ray tracer follows.

    Example:
        >>> import bisplat
        >>> engine = bisplat.Rays(bisplat.Propagation(max_depth=1, diffraction=False))
        >>> engine.propagation.max_depth, engine.propagation.los
        (1, True)
    """

    propagation: Propagation = Propagation()

    def __post_init__(self) -> None:
        check_kinds(self)

    name: ClassVar[str] = "rays"
    called: ClassVar[str] = "fresh ray tracing"
    packages: ClassVar[tuple[str, ...]] = ("sionna-rt", "mitsuba", "drjit", "numpy")
    always_recorded: ClassVar[bool] = False  # folders of powers record other things than those of spectra
    knows_bands: ClassVar[bool] = True
    knows_frequencies: ClassVar[bool] = True

    def metadata(self, setting: Setting) -> dict[str, Any]:
        return {
            "engine": self.name,
            "propagation": asdict(self.propagation) | {"seed": setting.seed},
            "method": "shooting" if self.propagation.sionna else "chains",
        }

    @classmethod
    def schema(cls) -> dict[str, Any]:
        return {"propagation": recorded(Propagation, seed=(Count, 0)), "method": str}

    @classmethod
    def of(cls, metadata: Mapping[str, Any]) -> Self:
        """The recorded engine; that with the defaults for a dataset that was not simulated."""
        settings = {name: value for name, value in metadata.get("propagation", {}).items() if name != "seed"}
        return cls(Propagation(**settings))

    def versions(self) -> dict[str, str]:
        require_extra("rays", "ray tracing")
        return super().versions()

    def require(self, setting: Setting, folder: Path, machines: Machines) -> None:
        import simulate.rays.core.ray_tracer  # noqa: F401  refuses a ray tracer that cannot be used

        super().require(setting, folder, machines)
        triangles, memory = setting.scene.triangles, machine_memory()
        if BYTES + triangles * BYTES_OF_TRIANGLE > memory:
            most = max(0, int((memory - BYTES) / BYTES_OF_TRIANGLE))
            raise InputError(
                f"{setting.scene.name}: expected at most {most:,} triangles, since this machine has "
                f"{memory / 1e9:.3g} GB of memory, found {triangles:,}"
            )

    def source(self, setting: Setting, folder: Path, machines: Machines, progress: Progress) -> Tracer:
        return self._tracers([setting], progress)[0]

    def sources(
        self, settings: Sequence[Setting], folder: Path, machines: Machines, progress: Progress
    ) -> list[list[ResponseSource]]:
        """A tracer for each frequency. In a setting, all of them follow the chains found at the lowest one."""
        return [_at_all(*each) for each in zip(self._tracers(settings, progress), settings, strict=True)]

    def _tracers(self, settings: Sequence[Setting], progress: Progress) -> list[Tracer]:
        """The tracer of each setting. The user is warned if rays are not to be believed there."""
        from simulate.rays.expected_correlation import BELIEVED, expected_correlation, sentence

        tracers = [self.tracer(setting, progress) for setting in settings]
        every = [expected_correlation(tracer, *of[:2]) for tracer, of in zip(tracers, settings, strict=True)]
        worst = min((each for each in every if each is not None), key=lambda each: each.middle, default=None)
        if worst is not None and worst.middle < BELIEVED:
            say(f"warning: {sentence(worst, len(settings))}")
        return tracers

    def tracer(self, setting: Setting, progress: Progress) -> Tracer:
        """Find the chains of a scene, and return the tracer that computes the responses."""
        from simulate.rays.tracer import Tracer

        objects, triangles = len(setting.scene.objects), setting.scene.triangles
        size = f"{setting.scene.name}: {triangles:,} triangles in {objects:,} objects"
        before = about(triangles * SECONDS_OF_TRIANGLE + objects * SECONDS_OF_OBJECT)
        search = progress.add_task(f"finding paths in {size}{before and f'{before} before the search'}", total=None)
        tracer = Tracer(
            setting.scene,
            self.propagation,
            setting.region,
            setting.seed,
            lambda sentence: progress.update(search, description=f"finding paths, {sentence}"),
        )
        progress.update(search, total=1, completed=1)
        return tracer

    def sent(self, sources: list[ResponseSource]) -> Any:
        return sources[0].found  # type: ignore[attr-defined]

    def received(self, setting: Setting, sent: Any, threads: int) -> list[ResponseSource]:
        from simulate.rays.core.ray_tracer import dr
        from simulate.rays.tracer import Tracer

        dr.set_thread_count(threads)
        return _at_all(Tracer(setting.scene, self.propagation, setting.region, setting.seed, found=sent), setting)


def _at_all(first: Tracer, setting: Setting) -> list[ResponseSource]:
    """The tracers at all frequencies of a setting, from that at the lowest one."""
    return [first, *(first.at_frequency(scene) for scene in setting.further)]


def seed_of_rays(metadata: Mapping[str, Any]) -> int:
    return metadata.get("propagation", {}).get("seed", DEFAULT_SEED)
