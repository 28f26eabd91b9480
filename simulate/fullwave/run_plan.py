"""The plan of full-wave runs: their cells, their time steps, and their cost."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import trimesh
from jaxtyping import Float, Int

from scenes.checks.enclosure import in_outer_wall, outline
from scenes.checks.occupancy import element_positions
from scenes.files.errors import ParameterError
from scenes.scene.description import SPEED_OF_LIGHT, Scene
from scenes.scene.materials import refractive_index
from scenes.scene.shapes import bounding_box
from simulate.fullwave.dipole import SOURCE_REACH
from simulate.fullwave.leapfrog import ABSORBER
from simulate.fullwave.pulse import Pulse
from simulate.fullwave.stored_field import MARGIN
from simulate.fullwave.yee_grid import YeeGrid, numerical_frequency
from simulate.rays.core.slabs import Slabs, conducting_triangles, dielectric_slabs
from simulate.spectra.band import Band, enough_frequencies

CELLS_PER_WAVELENGTH, CELLS_PER_WAVELENGTH_IN_AIR = 7, 16
"""Default number of cells for a wavelength in a material, and in air."""

FEWEST_CELLS_PER_WAVELENGTH = 4
"""Fewest cells for a wavelength in a material; for air there are more, in the same proportion. With fewer cells the
grid hardly carries the wave."""

CELLS_MOST = 1e10  # Largest number of cells. So many take 600 GB.

CELLS_OF_AIR = 1  # Cells of air between the scene's outermost slab and the absorbing boundary

THICKEST = 0.3
"""Metres. Thicker outer walls, and bodies behind them, extend into the absorbing boundary."""

FREQUENCIES_MORE = 8
"""Number of frequencies of a band beyond those that the duration needs. They make the interpolation's error small."""

DECAY = math.log(1e6)  # A run lasts until the energy in a room has fallen by 60 dB

BYTES_PER_CELL, BYTES_PER_SOURCE, BYTES_KEPT = 60, 30, 200
"""Bytes for each cell, for each cell and source, and for each source and cell of the box that is kept."""

BYTES_OF_FREQUENCY, BYTES_WATCHED = 40, 24
"""Bytes for each further frequency, source and cell of the box that is kept; and those more if it must settle."""

CELLS_PER_SECOND = 120e6
"""Cells times sources that one core advances in a second, estimated with some reserve (benchmarks/simulate/solvers.py).
"""


class BandPlan(NamedTuple):
    """The further frequencies of a run: those of a band, or single ones."""

    solved: Float[np.ndarray, " F"]  # frequencies at which the field is solved, Hz
    # frequencies of the subcarriers, to which it is interpolated, Hz; single ones are those of ``solved``
    frequencies: Float[np.ndarray, " subcarriers"]
    delay: float  # a typical delay of the field, seconds, which is taken out before the interpolation
    # number of frequencies, the plan's first, whose fields must have settled before a run ends. Those of a band are
    # so close together that the carrier's stands for all.
    watched: int = 1


@dataclass(frozen=True)
class Plan:
    """The runs for the elements of a scene."""

    scene: Scene  # the scene, at the frequency of the source
    region: Float[np.ndarray, "2 3"]  # the transmitters' box, metres, world frame
    grid: YeeGrid  # the cells
    frequency: float  # frequency of the source on the grid, hertz
    steps: int  # largest number of time steps
    # first cell, and the cell after the last one, of the box around the region, whose field is kept
    box: Int[np.ndarray, "2 3"]
    # number of time steps before which no field can have settled: those of the pulse, plus twice the time in which a
    # wave crosses the scene
    earliest: int = 0
    band: BandPlan | None = None  # further frequencies at which the field is wanted. None: only that of the source is.

    def memory(self, sources: int) -> int:
        """Bytes that a run with some sources takes."""
        kept = int(np.prod(self.box[1] - self.box[0]))
        each = BYTES_KEPT
        if self.band is not None:
            each += BYTES_OF_FREQUENCY * len(self.band.solved) + BYTES_WATCHED * (self.band.watched - 1)
        return (BYTES_PER_CELL + BYTES_PER_SOURCE * sources) * self.grid.cells + each * sources * kept

    @property
    def seconds(self) -> float:
        """Upper estimate of the seconds for one source on one core."""
        return self.grid.cells * self.steps / CELLS_PER_SECOND


def default_cell(scene: Scene) -> float:
    """The default cell: a seventh of the shortest wavelength in a slab, or a sixteenth of that in air if shorter."""
    return two_digits_down(_wavelength_to_resolve(scene, dielectric_slabs(scene)) / CELLS_PER_WAVELENGTH)


def two_digits_down(value: float) -> float:
    digits = 1 - math.floor(math.log10(value))
    return round(math.floor(value * 10**digits) / 10**digits, digits)


def coarsest_cell(scene: Scene) -> float:
    """The largest cell that ``plan`` takes for a scene, metres."""
    waves = _wavelength_to_resolve(scene, dielectric_slabs(scene)) / FEWEST_CELLS_PER_WAVELENGTH
    elements = element_positions(scene.gateway, scene.wavelength)
    return min([waves, *(each / SOURCE_REACH for each in _to_conductors(elements, conducting_triangles(scene)))])


def _wavelength_to_resolve(scene: Scene, objects: list[Slabs]) -> float:
    """The wavelength that sets the cells, metres: the shortest in a thick slab, or 7/16 of that in air if shorter."""
    thick = scene.wavelength / CELLS_PER_WAVELENGTH / 4
    slabs = [each for each in objects if float((each.stop - each.start).max()) > thick]
    indices = [refractive_index(each.material, scene.frequency).real for each in slabs]
    return scene.wavelength / max([*indices, CELLS_PER_WAVELENGTH_IN_AIR / CELLS_PER_WAVELENGTH])


def plan(
    scene: Scene,
    region: Float[np.ndarray, "2 3"],
    cell: float,
    band: Band | None = None,
    further: Sequence[Scene] = (),
) -> Plan:
    """Choose the cells and the number of time steps for a scene."""
    slabs, conductors = dielectric_slabs(scene), conducting_triangles(scene)
    shortest = min([scene, *further], key=lambda each: each.wavelength)
    to_resolve = slabs if shortest is scene else dielectric_slabs(shortest)
    largest = _wavelength_to_resolve(shortest, to_resolve) / FEWEST_CELLS_PER_WAVELENGTH
    if cell > largest:
        raise ParameterError(
            "cell", f"expected at most {largest:.3g} m, for wavelengths in these materials and in air, found {cell}"
        )
    elements = element_positions(scene.gateway, scene.wavelength)
    reach = cell * SOURCE_REACH * np.array([[-1.0], [1.0]])
    _check_distance(elements, conductors, cell)
    inner = bounding_box(np.vstack([scene.bounds, region, bounding_box(elements) + reach]))
    kept = region + MARGIN * cell * np.array([[-1], [1]])
    low, high = bounding_box(np.vstack([inner, kept, *(_behind(each) for each in slabs)]))
    # Whole cells from the scene's lowest corner. Faces at multiples of the cell from there are then faces of cells.
    before = np.ceil((inner[0] - low) / cell - 1e-6) + CELLS_OF_AIR + ABSORBER
    origin = inner[0] - before * cell
    if np.prod((high - low) / cell + 1) > CELLS_MOST:
        least = (np.prod(high - low) / CELLS_MOST) ** (1 / 3)
        raise ParameterError("cell", f"expected at least {least:.2g} m, for {CELLS_MOST:g} cells, found {cell}")
    nx, ny, nz = (int(size) for size in np.ceil((high - origin) / cell - 1e-6).astype(int) + CELLS_OF_AIR + ABSORBER)
    grid = YeeGrid((float(origin[0]), float(origin[1]), float(origin[2])), cell, (nx, ny, nz))
    box = np.stack([np.floor((region[0] - origin) / cell) - MARGIN, np.ceil((region[1] - origin) / cell) + MARGIN])
    frequency = numerical_frequency(scene.wavelength, cell)
    crossing = 2 * float(np.linalg.norm(inner[1] - inner[0])) / SPEED_OF_LIGHT
    earliest = Pulse(frequency).duration + crossing
    steps = math.ceil((earliest + _decay_time(scene, slabs, conductors)) / grid.time_step)
    solved = None if band is None else _band_plan(band, scene.frequency, steps * grid.time_step)
    if further:
        others = np.array([each.frequency for each in further])
        solved = BandPlan(others, others, 0.0, 1 + len(others))
    return Plan(scene, region, grid, frequency, steps, box.astype(int), math.ceil(earliest / grid.time_step), solved)


def _band_plan(band: Band, carrier: float, duration: float) -> BandPlan:
    """The frequencies to solve for a band: the subcarriers, or fewer if they tell as much of a field that ends."""
    frequencies = band.frequencies(carrier)
    solved = enough_frequencies(frequencies, duration, FREQUENCIES_MORE)
    return BandPlan(solved, frequencies, duration / 2)


def _check_distance(
    elements: Float[np.ndarray, "elements 3"], conductors: Float[np.ndarray, "n 3 3"], cell: float
) -> None:
    """Refuse a source that would be spread over conducting edges or both sides of a sheet, and so radiate wrongly."""
    for number, distance in enumerate(_to_conductors(elements, conductors)):
        if distance < SOURCE_REACH * cell:
            raise ParameterError(
                "cell",
                f"expected at most {distance / SOURCE_REACH:.3g} m, since element {number + 1} is {distance:.3g} m "
                f"from a conductor, found {cell}",
            )


def _to_conductors(
    elements: Float[np.ndarray, "elements 3"], conductors: Float[np.ndarray, "n 3 3"]
) -> Iterator[float]:
    """The distance of each element from the nearest conductor, metres."""
    for element in elements:
        nearest = trimesh.triangles.closest_point(conductors, np.tile(element, (len(conductors), 1)))
        yield float(np.linalg.norm(nearest - element, axis=1).min(initial=np.inf))


def _behind(slabs: Slabs) -> Float[np.ndarray, "n 3"]:
    """Corners of the backs of outer walls, metres, unless they extend into the absorbing boundary."""
    depth = np.minimum(slabs.stop[slabs.outer], THICKEST)[:, None, None]
    return (slabs.triangles[slabs.outer] + depth * slabs.normals[slabs.outer][:, None]).reshape(-1, 3)


def _decay_time(scene: Scene, slabs: list[Slabs], conductors: Float[np.ndarray, "n 3 3"]) -> float:
    """Time in which the energy in a scene falls by 60 dB (Sabine): 4V/cA · ln 10⁶.

    A is the sum of the absorbing surfaces. An outer wall counts with the share 1 − |R|² of its area, for normal
    incidence on a half-space. Openings count fully. Boards within the room count with the share that they absorb of
    waves that pass through them.
    """
    extent = np.ptp(scene.extent, axis=0)
    volume = float(np.prod(extent))
    surface = 2 * float(extent[0] * extent[1] + extent[1] * extent[2] + extent[2] * extent[0])
    absorbing, closed = 0.0, 0.0
    for each in slabs:
        area = trimesh.triangles.area(each.triangles)
        index = refractive_index(each.material, scene.frequency)
        reflected = abs((index - 1) / (index + 1)) ** 2
        outer = float(area[each.outer].sum())
        closed += outer
        absorbing += (1 - reflected) * outer
        depth = -4 * np.pi / scene.wavelength * index.imag * (each.stop - each.start)
        absorbing += 2 * float(((1 - np.exp(-depth)) * area)[~each.outer].sum())
    closed += float(trimesh.triangles.area(conductors)[in_outer_wall(conductors, outline(scene))].sum())
    open_surface = max(surface - closed, 0.02 * surface)  # at least 2 %, since even metal rooms have gaps
    return 4 * volume / (SPEED_OF_LIGHT * (absorbing + open_surface)) * DECAY
