"""The fields that several sources produce in a box, at one frequency or at many, and whether they have settled."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float, Float32, Int

from scenes.scene.description import SPEED_OF_LIGHT
from scenes.scene.materials import VACUUM_PERMEABILITY
from simulate.fullwave.dipole import Source
from simulate.fullwave.leapfrog import Cells, advance
from simulate.fullwave.pulse import FourierSums, Pulse, spectrum
from simulate.fullwave.yee_grid import YeeGrid

SETTLED = 1e-3
"""A field has settled if the estimated change still to come is below this share of it, 60 dB down."""

LOOKS = 20  # Number of parts of a run. The field is examined at the end of each part.

SLOWEST = 0.95
"""Largest ratio of two changes that is trusted. With a larger one the rest would be estimated from noise."""


def looks(steps: int) -> list[int]:
    """Numbers of time steps after which the field is examined, in a run with a largest number of steps."""
    return [steps * look // LOOKS for look in range(1, LOOKS + 1)]


def still_to_come(
    before_last: Complex[np.ndarray, "..."], last: Complex[np.ndarray, "..."], now: Complex[np.ndarray, "..."]
) -> float:
    """Estimated change of a field that is still to come, relative to the field.

    The phasors at three equally spaced moments change by d₁ and then by d₂. If the changes continue to shrink by the
    ratio q = d₂/d₁, the change still to come is d₂ q/(1 − q).
    """
    size = float(np.linalg.norm(now))
    if size == 0:
        return float("inf")
    change_before, change = float(np.linalg.norm(last - before_last)), float(np.linalg.norm(now - last))
    ratio = min(change / max(change_before, 1e-300), SLOWEST)
    return change / size * ratio / (1 - ratio)


FREE_SPACE_IMPEDANCE = VACUUM_PERMEABILITY * SPEED_OF_LIGHT  # η₀, ohms


@dataclass(frozen=True)
class SourceField:
    """The field of a source of one ampere-metre."""

    # electric field along x, y, z at the middles of the cells of a box, V/m, for each frequency
    phasors: Complex[np.ndarray, "F 3 nx ny nz"]
    # estimated change that is still to come, relative to the field; the largest of those of the watched frequencies
    unsettled: float
    steps: int  # number of time steps


def solve(
    cells: Cells,
    grid: YeeGrid,
    sources: Sequence[Source],
    frequencies: Float[np.ndarray, " F"],
    axes: Sequence[int],
    box: Int[np.ndarray, "2 3"],
    steps: int,
    earliest: int = 0,
    watched: int = 1,
    report: Callable[[int], None] = lambda done: None,
) -> list[SourceField]:
    """Advance the fields of some sources until each has settled at the first frequencies, those that are watched.

    The fields do not depend on one another. They are wanted along some axes, and zero along the others.
    """
    pulse, time_step = Pulse(sources[0].frequency), grid.time_step
    current = pulse.current(time_step * (np.arange(steps) + 0.5))
    scale = (FREE_SPACE_IMPEDANCE / spectrum(current, frequencies, time_step))[:, None].astype(np.complex64)
    driven = [
        each for number, source in enumerate(sources) for each in driven_by(cells, grid, source, number, len(sources))
    ]
    shape = tuple(box[1] - box[0])
    every = pulse.samples_every(time_step, float(frequencies.max()))
    sums = FourierSums(frequencies, (len(sources), len(axes) * int(np.prod(shape))), time_step, every)
    ends = [end for end in looks(steps) if end >= earliest or end in looks(steps)[-3:]]
    seen: list[list[np.ndarray]] = [[] for _ in sources]
    found: dict[int, SourceField] = {}
    for step in range(1, steps + 1):
        advance(cells, 0)
        if current[step - 1]:
            for component, where, amount in driven:
                cells.fields[component, where] -= amount * np.float32(current[step - 1])
        if step % every == 0:
            sums.add(step, in_box(cells.fields, grid, box, len(sources), axes).reshape(len(sources), -1))
        if step in ends:
            total = sums.total()
            for number in set(range(len(sources))) - set(found):
                seen[number] = [*seen[number][-2:], total[number, :watched]]
                if len(seen[number]) == 3:
                    rest = max(still_to_come(*each) for each in zip(*seen[number], strict=True))
                    if rest < SETTLED or step == steps:
                        phasors = np.zeros((len(frequencies), 3, *shape), np.complex64)
                        phasors[:, list(axes)] = (scale * total[number]).reshape(len(frequencies), len(axes), *shape)
                        found[number] = SourceField(phasors, rest, step)
            if len(found) == len(sources):
                break
        advance(cells, 1)
        report(step)
    report(steps)
    return [found[number] for number in range(len(sources))]


def driven_by(
    cells: Cells, grid: YeeGrid, source: Source, number: int, sources: int
) -> list[tuple[int, Int[np.ndarray, " n"], Float32[np.ndarray, " n"]]]:
    """Components, places and amounts by which sources of one ampere-metre change the field in a time step.

    A current I over a length ℓ in a cell is a current density Iℓ/Δ³, which takes the place of H/Δ.
    """
    points = np.array(grid.shape) + 1
    driven = []
    for axis, places, shares in source.edges(grid):
        x, y, z = places.T
        where = ((x * points[1] + y) * points[2] + z) * sources + number
        drive = cells.drive[cells.row[axis, x, y], z * sources]
        driven.append((axis, where, (drive * shares / grid.cell**2).astype(np.float32)))
    return driven


def in_box(
    fields: Float32[np.ndarray, "6 points*sources"],
    grid: YeeGrid,
    box: Int[np.ndarray, "2 3"],
    sources: int,
    axes: Sequence[int],
) -> Float32[np.ndarray, "sources axes nx ny nz"]:
    """The electric field along some axes at the middles of cells, which is the mean over four edges of a cell."""
    electric = fields[:3].reshape(3, *(size + 1 for size in grid.shape), sources)
    (x, y, z), (end_x, end_y, end_z) = box
    electric = np.moveaxis(electric[:, x : end_x + 1, y : end_y + 1, z : end_z + 1], -1, 0)
    middles = []
    for axis in axes:
        mean = electric[:, axis]
        for other in range(3):
            low, high = [slice(None)] * 4, [slice(None)] * 4
            low[other + 1], high[other + 1] = slice(None, -1), slice(1, None)
            mean = mean[tuple(low)] if other == axis else (mean[tuple(low)] + mean[tuple(high)]) / 2
        middles.append(mean)
    return np.stack(middles, axis=1)
