"""The engine that solves Maxwell's equations."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

from msgspec import Meta, Struct
from tyro.conf import Suppress

from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError, ParameterError, require_path, require_within, shown
from scenes.files.json_file import read_json
from scenes.files.options import check_kinds
from scenes.files.schema import Positive, conform
from scenes.storage.scene_digest import scene_digest
from simulate.engines.engine import Engine, Machines, Setting
from simulate.fullwave import OURS

if TYPE_CHECKING:  # their imports take long, and the help of the command line does not need them
    from rich.progress import Progress

    from scenes.scene.description import Gateway, Scene
    from simulate.fullwave.stored_field import StoredField

FIELD = "field.npz"
"""File in a dataset folder that stores the field."""

CELLS = 1e-5, 10.0
"""Shortest and longest cells, metres. ``simulate.fullwave.run_plan`` finds the narrower range that suits a scene."""


@dataclass(frozen=True)
class Solver:
    """The options that the field of a scene depends on.

    Attributes:
        cell: side of the cells in full wave, metres. None: 1/7 of the shortest wavelength in a material, at most 1/16
            of the wavelength in air.
        solver: "bisplat" for our own solver, or gprMax and its version; the engine sets it from ``gpu``.

    Raises:
        ParameterError: ``cell`` is outside ``CELLS``.
    """

    cell: float | None = None
    solver: Annotated[str, Suppress] = OURS

    def __post_init__(self) -> None:
        check_kinds(self)
        if self.cell is not None:
            require_within(*CELLS, "metres", cell=self.cell)


class Recorded(Struct, forbid_unknown_fields=True, kw_only=True):
    """A ``Solver`` as metadata.json records it, with all its options, and what follows from them."""

    cell: Annotated[float, Meta(ge=CELLS[0], le=CELLS[1])]
    solver: str
    window_ns: Positive = 1.0
    antennas: str = ""


class Made(Struct):
    """What metadata.json of another folder says about its field."""

    engine: str = ""
    scene: str = ""
    scene_sha256: str = ""
    frequency_hz: float | None = None
    array: dict[str, Any] | None = None
    fullwave: Recorded | None = None


@dataclass(frozen=True)
class FullWave(Solver, Engine):
    """Engine that solves Maxwell's equations by finite differences in time (FDTD) [yee1966].

    By reciprocity one solver run for each element of the array gives the responses at every position of the
    transmitter's region. So a scene takes minutes to hours, whatever the number of spectra. The field is stored in the
    dataset folder, and spline interpolation gives the responses between its points. Elements and transmitters are short
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

    field: Path | None = None
    gpu: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.field is not None:
            require_path(field=self.field)

    name: ClassVar[str] = "fullwave"
    called: ClassVar[str] = "full wave"
    spreads_parts: ClassVar[bool] = False
    keeps_source: ClassVar[bool] = True

    def for_scene(self, scene: Scene) -> Self:
        from simulate.fullwave.gprmax import installed_gprmax
        from simulate.fullwave.run_plan import default_cell

        if self.field is not None:
            return replace(self, **asdict(_solver_of_field(Path(self.field), scene)))
        cell = default_cell(scene) if self.cell is None else self.cell
        solver = OURS
        if self.gpu or self.solver != OURS:
            solver = installed_gprmax("full wave on a GPU" if self.gpu else f"a field by {self.solver}")
        return replace(self, cell=cell, solver=solver)

    def metadata(self, setting: Setting) -> dict[str, Any]:
        from simulate.fullwave.run_plan import plan

        assert self.cell is not None
        planned = plan(setting.scene, setting.region, self.cell, setting.band)
        window = planned.steps * planned.grid.time_step
        return {
            "engine": self.name,
            "fullwave": {"cell": self.cell, "solver": self.solver}
            | {"window_ns": round(1e9 * window, 1), "antennas": "short dipoles"},
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
        from simulate.fullwave.memory import require_memory
        from simulate.fullwave.run_plan import plan

        if setting.band is not None and self.solver != OURS:
            raise ParameterError("bandwidth", f"expected none with {self.solver}; our own solver can (leave out gpu)")
        # Here workers are solver runs at a time, which need no Ray.
        super().require(setting, folder, replace(machines, workers=None))
        if self.field is not None:
            self.kept(setting, Path(self.field))
        elif self.solver == OURS and machines.ray is None and self._damage(setting, folder) is not None:
            assert self.cell is not None
            planned = plan(setting.scene, setting.region, self.cell, setting.band)
            require_memory(setting.scene, setting.region, planned, machines.workers)

    def source(self, setting: Setting, folder: Path, machines: Machines, progress: Progress) -> StoredField:
        """The field that is stored in the dataset folder.

        If it is missing or damaged, it is copied from the folder ``field`` or solved anew. Interrupted solver runs
        continue.

        Args:
            setting: the scene, the region of the transmitters, and the seed, which is not used here.
            folder: the dataset folder.
            machines: number of solver runs at a time, and the Ray cluster to run on.
            progress: shows the solver runs.

        Returns:
            The stored field, whose method ``responses`` takes positions [K, 3], metres, world frame, and returns
            element responses [K, elements].

        Raises:
            InputError: the solver failed.
        """
        import numpy as np

        from simulate.fullwave.settling import SETTLED
        from simulate.fullwave.stored_field import OF_POINTS

        path, damage = folder / FIELD, self._damage(setting, folder)
        if damage is not None and path.exists():
            progress.console.print(f"{damage}; it is made again", markup=False, highlight=False, soft_wrap=True)
        if damage is not None and self.field is not None:
            write_atomically(path, (Path(self.field) / FIELD).read_bytes())
        elif damage is not None:
            self._solved(setting, folder / "field", machines, progress).write(path)
        shutil.rmtree(folder / "field", ignore_errors=True)
        field = self.kept(setting, folder)
        settled, error = 20 * np.log10(max(field.unsettled.max(), 1e-9)), field.interpolation_error_db
        progress.console.print(
            f"stored field: settled to {settled:.0f} dB; interpolation error at most {error:.0f} dB "
            f"(root mean square over {OF_POINTS:.0%} of the points; it is larger near objects)"
        )
        if field.unsettled.max() > SETTLED:
            progress.console.print("warning: the field has not settled to -60 dB; the scene may be a resonator")
        return field

    def is_whole(self, setting: Setting, folder: Path) -> bool:
        return self._damage(setting, folder) is None

    @classmethod
    def kept(cls, setting: Setting, folder: Path) -> StoredField:
        import numpy as np

        from simulate.fullwave.stored_field import read_stored_field

        path, gateway = folder / FIELD, setting.scene.gateway
        field = read_stored_field(path)
        if len(field.values) != gateway.count:
            raise InputError(
                f"{path}: expected the field of the array of {_elements_of(gateway)} of "
                f"{setting.scene.name}, found that of {len(field.values)} elements"
            )
        if setting.band is not None:
            wanted = setting.band.frequencies(setting.scene.frequency)
            if field.band is None or not np.array_equal(field.band.frequencies, wanted):
                found = "that of the carrier alone" if field.band is None else "one over another band"
                raise InputError(
                    f"{path}: expected a field over {setting.band.bandwidth / 1e6:g} MHz with "
                    f"{setting.band.subcarriers} subcarriers, found {found}"
                )
        low, high = field.region
        if (setting.region[0] < low).any() or (setting.region[1] > high).any():
            raise InputError(
                f"{path}: expected a field that is known in the whole region of the transmitters, from "
                f"{setting.region[0].round(3).tolist()} to {setting.region[1].round(3).tolist()} m, found one from "
                f"{low.round(3).tolist()} to {high.round(3).tolist()} m"
            )
        return field

    def _damage(self, setting: Setting, folder: Path) -> str | None:
        """A sentence on why a folder has no stored field that can be used; None if it has one."""
        try:
            self.kept(setting, folder)
        except InputError as error:
            return str(error)
        return None

    def _solved(self, setting: Setting, folder: Path, machines: Machines, progress: Progress) -> StoredField:
        """The field from the solver, which stores its finished runs in a folder."""
        from simulate.fullwave.run_plan import plan
        from simulate.fullwave.solved_field import solve

        assert self.cell is not None
        planned = plan(setting.scene, setting.region, self.cell, setting.band)
        return solve(setting.scene, planned, folder, self.solver, machines.workers, machines.ray, self.gpu, progress)


def _solver_of_field(folder: Path, scene: Scene) -> Solver:
    """The solver that a folder's stored field was made with.

    Raises:
        InputError: the folder is not that of a finished full-wave simulation, or is that of another scene.
    """
    expected = "the folder of a finished simulation with --engine fullwave"
    path = folder / "metadata.json"
    made = conform(read_json(path, expected), Made, str(path))
    if made.engine != FullWave.name or made.fullwave is None or not (folder / FIELD).is_file():
        raise InputError(f"{folder}: expected {expected}, found none with its {FIELD}")
    if made.scene_sha256 != scene_digest(scene):
        raise InputError(
            f"{folder}: expected the field of the same scene, found that of {shown(made.scene)}, "
            f"{_difference(made, scene)}"
        )
    return Solver(made.fullwave.cell, made.fullwave.solver)


def _elements_of(gateway: Gateway) -> str:
    return f"{gateway.rows} × {gateway.columns} elements" if gateway.elements is None else f"{gateway.count} elements"


def _difference(made: Made, scene: Scene) -> str:
    """In what the scene of a field differs from another one."""
    from simulate.spectra.element_array import array_of

    array = array_of(scene.gateway, scene.frequency).stated()
    if made.frequency_hz not in (None, scene.frequency):
        return f"whose frequency is {made.frequency_hz:g} Hz instead of {scene.frequency:g} Hz"
    if made.array not in (None, array):
        return f"whose array is {shown(made.array)} instead of {shown(array)}"
    return "which differs in objects, materials, antennas or region"
