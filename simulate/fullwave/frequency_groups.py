"""Which frequencies one run solves together.

A run's pulse has power over a range of frequencies, so one run gives the field at all of them. Two things limit the
range. The pulse must have enough power at each frequency. And a material has one permittivity and one conductivity in
the time domain, while its conductivity grows with the frequency in ITU-R P.2040, and the grid delays short waves more.
So in the run its refractive index is right at one frequency, and nearly right around it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scenes.scene.description import Scene, conducting_objects
from simulate.fullwave.cells import permittivity_on_grid
from simulate.fullwave.pulse import Pulse
from simulate.fullwave.run_plan import coarsest_cell, two_digits_down
from simulate.fullwave.yee_grid import numerical_frequency

LARGEST_DIFFERENCE = 0.008
"""Largest relative difference between a material's complex refractive index in a run and its own one. In a closed box
of five materials the error of the responses is then 40 dB below them (benchmarks/simulate/quantities.py)."""

LEAST_LEVEL = 0.1
"""Least spectrum of the pulse at a frequency, relative to that at its carrier: 20 dB less."""


@dataclass(frozen=True)
class Group:
    """Frequencies that one run solves together."""

    scene: Scene  # the scene at the frequency of the run's source. The run has the materials of this scene.
    further: tuple[Scene, ...]  # the scene at the other frequencies, rising
    cell: float  # side of the cells, metres
    # largest relative difference between a material's complex refractive index in the run and its own
    difference: float

    @property
    def frequencies(self) -> list[float]:
        """All frequencies of the run, rising, Hz."""
        return sorted(each.frequency for each in (self.scene, *self.further))

    @property
    def in_words(self) -> str:
        """The frequencies and what is common to them, for the user."""
        listed = [f"{each / 1e6:.9g}" for each in self.frequencies]
        if not self.further:
            return f"{listed[0]} MHz"
        return (
            f"{', '.join(listed[:-1])} and {listed[-1]} MHz together, with the materials of "
            f"{self.scene.frequency / 1e6:.9g} MHz, whose refractive indices differ by at most "
            f"{100 * self.difference:.2g} %"
        )


def frequency_groups(scenes: Sequence[Scene], cell: float, alone: bool = False) -> list[Group]:
    """Divide frequencies into as few runs as serve them, the highest ones first."""
    rest, groups = list(scenes), []
    while rest:
        highest = rest.pop()
        own = cell
        if highest is not scenes[-1]:
            own = two_digits_down(min(cell * scenes[-1].frequency / highest.frequency, coarsest_cell(highest)))
        group = Group(highest, (), own, 0.0)
        while rest and not alone:
            wider = _group([rest[-1], *sorted((group.scene, *group.further), key=lambda each: each.frequency)], own)
            if wider is None:
                break
            rest.pop()
            group = wider
        groups.append(group)
    return groups


def _group(scenes: list[Scene], cell: float) -> Group | None:
    """A run of some frequencies; None if they are too far apart for one."""
    middle = (scenes[0].frequency + scenes[-1].frequency) / 2
    own = min(scenes, key=lambda each: abs(each.frequency - middle))
    further = tuple(each for each in scenes if each is not own)
    pulse = Pulse(own.frequency)
    if min(pulse.level(each.frequency) for each in further) < LEAST_LEVEL:
        return None
    if any((conducting_objects(each) != conducting_objects(own)).any() for each in further):
        return None
    difference = max(index_difference(own, each, cell) for each in further)
    return Group(own, further, cell, difference) if difference <= LARGEST_DIFFERENCE else None


def index_difference(own: Scene, other: Scene, cell: float) -> float:
    """Largest relative difference of a dielectric's complex refractive index in a run from its own one."""
    conducting = conducting_objects(own)
    names = {item.material for item, conducts in zip(own.objects, conducting, strict=True) if not conducts}
    ratio = numerical_frequency(own.wavelength, cell) / numerical_frequency(other.wavelength, cell)
    largest = 0.0
    for name in names:
        there = permittivity_on_grid(own.materials[name], own, cell)
        found = there.real + 1j * ratio * there.imag  # the conductivity stays the same
        wanted = permittivity_on_grid(other.materials[name], other, cell)
        largest = max(largest, float(abs(np.sqrt(found / wanted) - 1)))
    return largest
