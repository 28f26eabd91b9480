"""The paths between one element of the gateway and many positions, in DeepMIMO's terms, as one list."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Int

from scenes.scene.description import SPEED_OF_LIGHT
from simulate.rays.core.multipath import Interaction, Multipath

DIGITS = {
    Interaction.REFLECTION: 1,
    Interaction.DIFFRACTION: 2,
    Interaction.SCATTERING: 3,
    Interaction.TRANSMISSION: 4,
}
"""DeepMIMO's code for each interaction."""

MOST_INTERACTIONS = 15
"""Most interactions of a path that are listed, one digit each: so many digits are exact in double precision."""


class PathList(NamedTuple):
    """Paths from an element, DeepMIMO's transmitter, to positions, its receivers."""

    receivers: Int[np.ndarray, " paths"]  # index of each path's position
    responses: Complex[np.ndarray, " paths"]  # a e^{−j2πfτ}
    delays: Float[np.ndarray, " paths"]  # τ, seconds
    # direction in which the path leaves the element, world frame; not of unit length
    departures: Float[np.ndarray, "paths 3"]
    # direction from which the path reaches the position, world frame; not of unit length
    arrivals: Float[np.ndarray, "paths 3"]
    # DeepMIMO's codes of the interactions, from the element on, as the digits of one number; 0 for the line of sight
    codes: Float[np.ndarray, " paths"]
    # places of the interactions, metres, world frame; not a number after the last one
    points: Float[np.ndarray, "paths depth 3"]


def path_list(terms: Multipath) -> PathList:
    """The paths of a batch that contribute to a response, with their first ``MOST_INTERACTIONS`` interactions."""
    carrying = terms.responses != 0
    terms = Multipath(*(each[carrying] for each in terms))
    happened = terms.kinds != Interaction.NONE
    last = np.arange(len(terms.targets)), happened.sum(axis=1)  # index of the last vertex before the position
    table = np.zeros(max(DIGITS) + 1)
    table[list(DIGITS)] = list(DIGITS.values())
    codes = np.zeros(len(terms.targets))
    points = np.full((len(terms.targets), min(MOST_INTERACTIONS, terms.kinds.shape[1]), 3), np.nan, np.float32)
    for number, kinds in enumerate(terms.kinds.T[:MOST_INTERACTIONS]):
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


def joined(parts: Iterable[PathList]) -> PathList:
    """Join several lists, or none, into one."""
    places = np.zeros((0, 3))
    nothing = PathList(
        np.zeros(0, int), np.zeros(0, complex), np.zeros(0), places, places, np.zeros(0), np.zeros((0, 1, 3), "f4")
    )
    lists = [nothing, *parts]
    depth = max(each.points.shape[1] for each in lists)
    wide = [
        each._replace(
            points=np.pad(each.points, ((0, 0), (0, depth - each.points.shape[1]), (0, 0)), constant_values=np.nan)
        )
        for each in lists
    ]
    return PathList(*(np.concatenate(each) for each in zip(*wide, strict=True)))


def sorted_by_receiver(paths: PathList) -> PathList:
    """Sort the paths as DeepMIMO needs them: by receiver, then line of sight first, then by falling power.

    DeepMIMO assumes that a receiver is in sight if its first path is the line of sight.
    """
    order = np.lexsort((-np.abs(paths.responses), paths.codes != 0, paths.receivers))
    return PathList(*(each[order] for each in paths))
