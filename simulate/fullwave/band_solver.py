"""The fields that several sources produce in a box at many frequencies, in one run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float, Int

from simulate.fullwave.leapfrog import Cells, advance
from simulate.fullwave.pulse import FourierSums, Pulse, spectrum
from simulate.fullwave.settling import SETTLED, looks, still_to_come
from simulate.fullwave.solver import FREE_SPACE_IMPEDANCE, driven_by, in_box
from simulate.fullwave.source import Source
from simulate.fullwave.yee_grid import YeeGrid


@dataclass(frozen=True)
class BandField:
    """The field of a source of one ampere-metre."""

    # electric field along one direction at the middles of the cells of a box, V/m, for each frequency
    phasors: Complex[np.ndarray, "F 3 nx ny nz"]
    # estimated change that is still to come, relative to the field; the largest of those of the watched frequencies
    unsettled: float
    steps: int  # number of time steps


def solve_band(
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
) -> list[BandField]:
    """Advance the fields of some sources until all of them have settled."""
    pulse, time_step = Pulse(sources[0].frequency), grid.time_step
    current = pulse.current(time_step * (np.arange(steps) + 0.5))
    scale = FREE_SPACE_IMPEDANCE / spectrum(current, frequencies, time_step)
    driven = [
        each for number, source in enumerate(sources) for each in driven_by(cells, grid, source, number, len(sources))
    ]
    shape = (len(sources), len(axes), *(box[1] - box[0]))
    every = pulse.samples_every(time_step, float(frequencies.max()))
    sums = FourierSums(frequencies, int(np.prod(shape)), time_step, every)
    ends = [end for end in looks(steps) if end >= earliest or end in looks(steps)[-3:]]
    seen: list[np.ndarray] = []
    rest = np.full(len(sources), np.inf)
    step = 0
    for step in range(1, steps + 1):
        advance(cells, 0)
        if current[step - 1]:
            for component, where, amount in driven:
                cells.fields[component, where] -= amount * np.float32(current[step - 1])
        if step % every == 0:
            sums.add(step, in_box(cells.fields, grid, box, len(sources), axes).reshape(-1))
        if step in ends:
            seen = [*seen[-2:], sums.total()[:watched].reshape(watched * len(sources), -1)]
            if len(seen) == 3:
                each_rest = [still_to_come(*each) for each in zip(*seen, strict=True)]
                rest = np.reshape(each_rest, (watched, len(sources))).max(axis=0)
                if (rest < SETTLED).all():
                    break
        advance(cells, 1)
        report(step)
    report(steps)
    total = (scale[:, None].astype(np.complex64) * sums.total()).reshape(len(frequencies), *shape)
    found = []
    for number in range(len(sources)):
        phasors = np.zeros((len(frequencies), 3, *shape[2:]), np.complex64)
        phasors[:, list(axes)] = total[:, number]
        found.append(BandField(phasors, float(rest[number]), step))
    return found
