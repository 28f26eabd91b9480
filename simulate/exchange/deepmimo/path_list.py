"""Paths between one element of the gateway and many positions as DeepMIMO counts them, one after another."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Int

from scenes.scene.description import SPEED_OF_LIGHT
from simulate.rays.core.terms import Interaction, Terms

DIGITS = {
    Interaction.REFLECTION: 1,
    Interaction.DIFFRACTION: 2,
    Interaction.SCATTERING: 3,
    Interaction.TRANSMISSION: 4,
}
"""DeepMIMO's code of each interaction."""

MOST_INTERACTIONS = 15
"""On a path: so many digits of a number are exact in double precision."""


class PathList(NamedTuple):
    """Paths from an element, DeepMIMO's transmitter, to positions, its receivers.

    Attributes:
        receivers: index of each path's position.
        responses: a e^{−j2πfτ}.
        delays: τ, seconds.
        departures: where the path leaves the element to; not of unit length, world frame.
        arrivals: where it comes to the position from; not of unit length, world frame.
        codes: DeepMIMO's codes of its interactions, from the element on, as the digits of one number; 0: line of sight.
        points: where the interactions are, metres, world frame; not a number after the last one.
    """

    receivers: Int[np.ndarray, " paths"]
    responses: Complex[np.ndarray, " paths"]
    delays: Float[np.ndarray, " paths"]
    departures: Float[np.ndarray, "paths 3"]
    arrivals: Float[np.ndarray, "paths 3"]
    codes: Float[np.ndarray, " paths"]
    points: Float[np.ndarray, "paths depth 3"]


def path_list(terms: Terms, depth: int) -> PathList:
    """A batch of traced paths, without those that contribute nothing.

    Args:
        terms: paths between one element and positions.
        depth: largest number of interactions of any batch.
    """
    carrying = terms.responses != 0
    terms = Terms(*(each[carrying] for each in terms))
    happened = terms.kinds != Interaction.NONE
    last = np.arange(len(terms.targets)), happened.sum(axis=1)  # of the vertices before the position
    table = np.zeros(max(DIGITS) + 1)
    table[list(DIGITS)] = list(DIGITS.values())
    codes = np.zeros(len(terms.targets))
    points = np.full((len(terms.targets), depth, 3), np.nan, np.float32)
    for number, kinds in enumerate(terms.kinds.T):
        codes = np.where(happened[:, number], 10 * codes + table[kinds], codes)
        points[happened[:, number], number] = terms.vertices[happened[:, number], 1 + number]
    return PathList(
        receivers=terms.targets,
        responses=terms.responses,
        delays=terms.lengths() / SPEED_OF_LIGHT,
        departures=terms.vertices[:, 1] - terms.vertices[:, 0],
        arrivals=terms.vertices[last] - terms.vertices[:, -1],
        codes=codes,
        points=points,
    )


def joined(parts: Iterable[PathList], depth: int) -> PathList:
    """Several lists, or none, as one.

    Args:
        parts: the lists.
        depth: largest number of interactions on a path.
    """
    places = np.zeros((0, 3))
    nothing = PathList(
        np.zeros(0, int), np.zeros(0, complex), np.zeros(0), places, places, np.zeros(0), np.zeros((0, depth, 3), "f4")
    )
    return PathList(*(np.concatenate(each) for each in zip(nothing, *parts, strict=True)))


def sorted_by_receiver(paths: PathList) -> PathList:
    """The paths in DeepMIMO's order: by receiver, line of sight first, the others by falling power.

    DeepMIMO takes a receiver to be in sight if its first path is the line of sight.
    """
    order = np.lexsort((-np.abs(paths.responses), paths.codes != 0, paths.receivers))
    return PathList(*(each[order] for each in paths))
