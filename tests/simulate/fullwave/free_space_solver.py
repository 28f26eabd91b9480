"""In place of our solver, the field in free space; small scenes and domains for both."""

import numpy as np

from benchmarks.ledger.exact_fields import free_space_response
from scenes.scene.antennas import Gateway, Transmitter
from scenes.scene.description import SPEED_OF_LIGHT, Scene, SceneObject
from scenes.scene.materials import VACUUM_PERMEABILITY, RadioMaterial, p2040_materials
from scenes.scene.orientation import facing
from scenes.scene.shapes import sheet
from simulate.fullwave.dipole import GAIN
from simulate.fullwave.run_plan import BandPlan, Plan
from simulate.fullwave.solver import SourceField
from simulate.fullwave.stored_field import MARGIN
from simulate.fullwave.yee_grid import YeeGrid, numerical_frequency

FREQUENCIES = 905e6, 915e6, 925e6, 1.8e9


def floor_and_two_elements() -> Scene:
    """A floor, an array of two elements and a small region."""
    floor = SceneObject("floor", sheet((0, 0, 0), (1.2, 0, 0), (0, 1.0, 0)), "concrete")
    gateway = Gateway((1.0, 0.5, 0.5), facing((-1, 0, 0)), rows=2, columns=1, pattern="dipole")
    region = Transmitter((0.35, 0.3, 0.3), (0.6, 0.7, 0.6), pattern="dipole")
    return Scene("small", 915e6, gateway, region, (floor,), p2040_materials(["concrete"], 915e6))


def free_scene(rows: int, low: tuple, high: tuple) -> Scene:
    """Dipoles in free space, the elements around the origin. A scene needs an object, which is far away."""
    gateway = Gateway((0.0, 0.0, 0.0), facing((-1, 0, 0)), rows=rows, columns=1, pattern="dipole")
    far = SceneObject("far", sheet((-50, 0, 0), (0, 1, 0), (0, 0, 1)), "metal")
    metal = {"metal": RadioMaterial("metal", 1.0, 1e7, 0.002)}
    return Scene("free", 915e6, gateway, Transmitter(low, high, pattern="dipole"), (far,), metal)


def planned_run(scene: Scene, grid: YeeGrid, steps: int, earliest: int = 0, band: BandPlan | None = None) -> Plan:
    """A run on given cells, which keeps the field around the scene's region."""
    low, high = ((np.array(corner) - grid.origin) / grid.cell for corner in scene.transmitter.region)
    box = np.stack([np.floor(low) - MARGIN, np.ceil(high) + MARGIN]).astype(int)
    return Plan(
        scene,
        np.array(scene.transmitter.region),
        grid,
        numerical_frequency(scene.wavelength, grid.cell),
        steps,
        box,
        earliest,
        band,
    )


class FreeSpaceSolver:
    """Takes the place of ``solve``, and keeps what was to be solved."""

    def __init__(self) -> None:
        self.sources: list[np.ndarray] = []  # their positions
        self.runs: list[list[int]] = []  # frequencies on the grid of each run, MHz
        self.interrupted_at: int | None = None  # number of runs after which Ctrl-C is pressed

    def solve(self, cells, grid, sources, frequencies, axes, box, steps, earliest, watched, report):
        if len(self.runs) == self.interrupted_at:
            raise KeyboardInterrupt
        assert watched == len(frequencies)
        self.runs.append(sorted((frequencies / 1e6).round(-1).astype(int).tolist()))
        self.sources += [source.position for source in sources]
        report(steps)
        index = np.stack(np.meshgrid(*(np.arange(*span) for span in box.T), indexing="ij"), axis=-1)
        points = np.asarray(grid.origin) + grid.cell * (index.reshape(-1, 3) + 0.5)
        on_grid = {numerical_frequency(SPEED_OF_LIGHT / each, grid.cell): each for each in FREQUENCIES}

        def field(source, driven):
            """The engine multiplies by a factor, which is taken out here."""
            frequency = on_grid[driven]
            factor = GAIN * SPEED_OF_LIGHT / frequency / (-2j * np.pi * driven * VACUUM_PERMEABILITY)
            ends = source.position, source.direction, points
            along = [free_space_response(*ends, axis, frequency) for axis in np.eye(3)]
            return np.stack(along).reshape(3, *index.shape[:3]) / factor

        return [SourceField(np.stack([field(each, driven) for driven in frequencies]), 1e-4, steps) for each in sources]


def replace_solver(monkeypatch) -> FreeSpaceSolver:
    """Let the free-space field take the solver's place in runs, each of one element."""
    from simulate.fullwave import element_fields

    instead = FreeSpaceSolver()
    monkeypatch.setattr(element_fields, "solve", instead.solve)
    monkeypatch.setattr(element_fields, "MOST_AT_ONCE", 1)
    return instead
