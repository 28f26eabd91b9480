"""The engine that solves Maxwell's equations."""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

from tyro.conf import Suppress

from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError, ParameterError, require_path, require_within
from scenes.files.options import check_kinds
from simulate.engines.engine import Engine, ResponseSource, Setting
from simulate.engines.field_folder import CELLS, Recorded, field_file, kept_field, solver_of_field
from simulate.fullwave import OURS
from simulate.parallel.machines import Machines

if TYPE_CHECKING:  # their imports take long, and the help of the command line does not need them
    from rich.progress import Progress

    from scenes.scene.description import Scene
    from simulate.fullwave.frequency_groups import Group
    from simulate.fullwave.run_plan import Plan
    from simulate.fullwave.stored_field import StoredField


@dataclass(frozen=True)
class FullWave(Engine):
    """Engine that solves Maxwell's equations by finite differences in time (FDTD) [yee1966].

    By reciprocity one solver run for each element of the array gives the responses at every position of the
    transmitter's region. So a scene takes minutes to hours, whatever the number of spectra. The field is stored in the
    dataset folder, and spline interpolation gives the responses between its points. Several frequencies that are near
    each other are solved by the same runs. Elements and transmitters are short
    dipoles, whatever antennas the scene names.

    Attributes:
        cell: side of the cells in full wave, metres. None: 1/7 of the shortest wavelength in a material, at most 1/16
            of the wavelength in air.
        solver: "bisplat" for our own solver, or gprMax [warren2016] and its version. The engine sets it from ``gpu``.
        field: folder of a full-wave dataset of the same scene, to use its stored field.
        gpu: solve full wave with gprMax on an NVIDIA GPU (needs bisplat-wrf[fullwave] and pycuda).

    Raises:
        ParameterError: ``cell`` is outside 1e-5 to 10 m. ``simulate`` checks it against the scene.

    Example:
        Give the engine to ``simulate``; the run itself takes minutes:

        >>> import bisplat
        >>> engine = bisplat.FullWave(cell=0.02)
        >>> engine.cell, engine.solver
        (0.02, 'bisplat')
    """

    cell: float | None = None
    solver: Annotated[str, Suppress] = OURS
    field: Path | None = None
    gpu: bool = False

    def __post_init__(self) -> None:
        check_kinds(self)
        if self.cell is not None:
            require_within(*CELLS, "metres", cell=self.cell)
        if self.field is not None:
            require_path(field=self.field)

    name: ClassVar[str] = "fullwave"
    called: ClassVar[str] = "full wave"
    keeps_source: ClassVar[bool] = True
    knows_bands: ClassVar[bool] = True
    knows_frequencies: ClassVar[bool] = True

    def for_scene(self, scene: Scene, frequencies: Sequence[float] = ()) -> Self:
        from simulate.fullwave.gprmax import installed_gprmax
        from simulate.fullwave.run_plan import default_cell

        if self.field is not None:
            cell, solver = solver_of_field(Path(self.field), scene, frequencies)
            return replace(self, cell=cell, solver=solver)
        highest = scene.at_frequency(max(frequencies)) if frequencies else scene
        cell = default_cell(highest) if self.cell is None else self.cell
        solver = OURS
        if self.gpu or self.solver != OURS:
            solver = installed_gprmax("full wave on a GPU" if self.gpu else f"a field by {self.solver}")
        return replace(self, cell=cell, solver=solver)

    def metadata(self, setting: Setting) -> dict[str, Any]:
        planned = self._planned(setting)
        window = max(each.steps * each.grid.time_step for _, each in planned)
        runs = {"runs_hz": [group.frequencies for group, _ in planned]} if setting.further else {}
        return {
            "engine": self.name,
            "fullwave": {"cell": self.cell, "solver": self.solver}
            | {"window_ns": round(1e9 * window, 1), "antennas": "short dipoles"}
            | runs,
        }

    @classmethod
    def schema(cls) -> dict[str, Any]:
        return {"fullwave": Recorded}

    @classmethod
    def of(cls, metadata: Mapping[str, Any]) -> Self:
        return cls(cell=metadata["fullwave"]["cell"], solver=metadata["fullwave"]["solver"])

    def again(self, recorded: Engine) -> Engine:
        return replace(recorded, field=self.field, gpu=self.gpu) if isinstance(recorded, FullWave) else recorded

    def require(self, setting: Setting, folder: Path, machines: Machines) -> None:
        from simulate.fullwave.run_cost import require_memory

        if setting.band is not None and self.solver != OURS:
            raise ParameterError("bandwidth", f"expected none with {self.solver}; our own solver can (leave out gpu)")
        # Here workers are solver runs at a time, which need no Ray.
        super().require(setting, folder, replace(machines, workers=None))
        if self.field is not None:
            for scene in setting.scenes:
                kept_field(setting, scene, Path(self.field))
        elif self.solver == OURS and machines.ray is None and _damage(setting, setting.scenes, folder) is not None:
            for _, planned in self._planned(setting):
                require_memory(planned, machines.workers)

    def source(self, setting: Setting, folder: Path, machines: Machines, progress: Progress) -> ResponseSource:
        return self.sources([setting], folder, machines, progress)[0][0]

    def sources(
        self, settings: Sequence[Setting], folder: Path, machines: Machines, progress: Progress
    ) -> list[list[ResponseSource]]:
        """The stored field at each frequency; if missing or damaged, it is copied from ``field`` or solved anew."""
        (setting,) = settings
        several = bool(setting.further)
        if self.field is not None:
            for scene in setting.scenes:
                if _made_again(setting, [scene], folder, progress):
                    content = field_file(Path(self.field), scene, several).read_bytes()
                    write_atomically(field_file(folder, scene, several), content)
        else:
            planned = self._planned(setting)
            if several:
                runs = "; ".join(group.in_words for group, _ in planned)
                count = "one run" if len(planned) == 1 else f"{len(planned)} runs"
                frequencies = f"full wave at {len(setting.scenes)} frequencies in {count} for each element"
                progress.console.print(f"{frequencies}: {runs}", highlight=False, soft_wrap=True)
            for number, (group, plan) in enumerate(planned):
                scenes = group.scene, *group.further
                if _made_again(setting, scenes, folder, progress):
                    working = folder / "field" / (f"run-{number + 1}" if several else "")
                    field = self._solved(plan, working, machines, progress)
                    fields = field.by_frequency(plan.scene.frequency) if several else {plan.scene.frequency: field}
                    for scene in scenes:
                        fields[scene.frequency].write(field_file(folder, scene, several))
        shutil.rmtree(folder / "field", ignore_errors=True)
        kept = [kept_field(setting, scene, folder) for scene in setting.scenes]
        _say_errors(kept, progress)
        return [list(kept)]

    def is_whole(self, setting: Setting, folder: Path) -> bool:
        return _damage(setting, setting.scenes, folder) is None

    @classmethod
    def kept(cls, setting: Setting, folder: Path) -> StoredField:
        return kept_field(setting, setting.scene, folder)

    def _planned(self, setting: Setting) -> list[tuple[Group, Plan]]:
        """The frequencies that runs solve together, with the plans of these runs. The highest ones come first."""
        from simulate.fullwave.frequency_groups import frequency_groups
        from simulate.fullwave.run_plan import plan

        assert self.cell is not None
        return [
            (group, plan(group.scene, setting.region, group.cell, setting.band, group.further))
            for group in frequency_groups(setting.scenes, self.cell, alone=self.solver != OURS)
        ]

    def _solved(self, planned: Plan, working: Path, machines: Machines, progress: Progress) -> StoredField:
        """The field of some frequencies, from runs that are kept in a working folder until all have ended."""
        from simulate.fullwave.all_elements import stored_field
        from simulate.fullwave.run_cost import description, runs_at_once

        count = planned.scene.gateway.count
        at_once = machines.workers or runs_at_once(planned)
        ours_here = self.solver == OURS and machines.ray is None
        progress.console.print(description(planned, min(at_once, count) if ours_here else None))
        bar, done = progress.add_task("full wave", total=count), [0.0] * count

        def report(element: int, step: int) -> None:
            done[element] = step / planned.steps
            progress.update(bar, completed=sum(done))

        field = stored_field(planned, working, at_once, self.solver, self.gpu, machines.ray, report)
        progress.update(bar, completed=count)
        return field


def _damage(setting: Setting, scenes: Sequence[Scene], folder: Path) -> str | None:
    """A sentence on why a folder has no stored field of a scene that can be used; None if it has those of all."""
    for scene in scenes:
        try:
            kept_field(setting, scene, folder)
        except InputError as error:
            return str(error)
    return None


def _made_again(setting: Setting, scenes: Sequence[Scene], folder: Path, progress: Progress) -> bool:
    """Whether fields must be made, since one is missing or damaged. The user is told of a damaged one."""
    damage = _damage(setting, scenes, folder)
    if damage is not None and any(field_file(folder, scene, bool(setting.further)).exists() for scene in scenes):
        progress.console.print(f"{damage}; it is made again", markup=False, highlight=False, soft_wrap=True)
    return damage is not None


def _say_errors(fields: list[StoredField], progress: Progress) -> None:
    """Tell how far fields have settled, and the error of their interpolation; the largest ones if there are several."""
    import numpy as np

    from simulate.fullwave.solver import SETTLED
    from simulate.fullwave.stored_field import OF_POINTS

    unsettled = max(float(field.unsettled.max()) for field in fields)
    settled, error = 20 * np.log10(max(unsettled, 1e-9)), max(field.interpolation_error_db for field in fields)
    progress.console.print(
        f"stored field: settled to {settled:.0f} dB; interpolation error at most {error:.0f} dB "
        f"(root mean square over {OF_POINTS:.0%} of the points; it is larger near objects)"
    )
    if unsettled > SETTLED:
        progress.console.print("warning: the field has not settled to -60 dB; the scene may be a resonator")
