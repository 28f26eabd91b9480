"""Doors in a floor plan: which parts of a section are closed leaves, and how they are drawn open."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import cKDTree
from trimesh.graph import connected_component_labels

LEAF = (0.5, 1.4)  # m, width of a leaf
THICKEST = 0.15  # m, of a leaf
WIDEST = 2 * LEAF[1]  # m; a wider door than one leaf has two
TOUCH = 0.1  # m; lines of a section that are nearer to each other are of one leaf: its two faces, its frame and glass
WALL = 0.25  # m, from the ends of a closed leaf to a wall


class Leaf(NamedTuple):
    """A closed leaf in a horizontal section."""

    hinge: Float[np.ndarray, " 2"]  # the end about which it is drawn open, (x, y), metres
    free: Float[np.ndarray, " 2"]  # the other end
    opened: Float[np.ndarray, " 2"]  # where the other end is when the door stands open by 90°
    lines: Int[np.ndarray, " n"]  # indices of the lines of the section that it replaces

    def swing(self) -> Float[np.ndarray, "25 2"]:
        """Return the quarter arc from the closed to the open end, metres."""
        angle = np.linspace(0, np.pi / 2, 25)[:, None]
        return self.hinge + np.cos(angle) * (self.free - self.hinge) + np.sin(angle) * (self.opened - self.hinge)


def is_door(name: str) -> bool:
    words = re.findall(r"[A-ZÄÖÜ]?[a-zäöü]+|[A-ZÄÖÜ]+", name)
    return not {word.lower() for word in words}.isdisjoint({"door", "doors", "tür", "türen"})


def closed_doors(
    names: Sequence[str], sections: Sequence[Float[np.ndarray, "n 2 2"]], away: Float[np.ndarray, " 2"]
) -> dict[int, list[Leaf]]:
    """Return the closed leaves of the objects that are named doors, by the numbers of the objects."""
    found = {}
    every = np.concatenate(sections) if len(sections) else np.zeros((0, 2, 2))
    owner = np.repeat(np.arange(len(sections)), [len(each) for each in sections])
    for index, name in enumerate(names):
        if is_door(name) and len(sections[index]):
            others = every[owner != index]
            leaves = closed_leaves(sections[index], others, away) if len(others) else []
            if leaves:
                found[index] = leaves
    return found


def closed_leaves(
    lines: Float[np.ndarray, "n 2 2"], others: Float[np.ndarray, "m 2 2"], away: Float[np.ndarray, " 2"]
) -> list[Leaf]:
    """Find the closed leaves in the section of a door: narrow, as wide as one or two leaves, a wall at both ends.

    No file says where the hinges are. Each leaf opens away from a point, so that it is not drawn over a room; a single
    one turns about the end that is farther from there.
    """
    leaves = []
    for chosen in _pieces(lines):
        ends = _narrow(lines[chosen].reshape(-1, 2))
        if ends is None or not _in_a_wall(ends, others):
            continue
        left, right = sorted(ends, key=lambda end: -float(np.linalg.norm(end - away)))
        middle = (left + right) / 2
        single = np.linalg.norm(right - left) <= LEAF[1]
        for hinge, free in ((left, right),) if single else ((left, middle), (right, middle)):
            x, y = free - hinge
            turned = np.array([-y, x])
            opened = hinge + turned * (1 if turned @ (middle - away) >= 0 else -1)
            leaves.append(Leaf(hinge, free, opened, chosen))
    return leaves


def _pieces(lines: Float[np.ndarray, "n 2 2"]) -> list[Int[np.ndarray, " n"]]:
    pairs = cKDTree(lines.reshape(-1, 2)).query_pairs(TOUCH, output_type="ndarray") // 2
    piece = connected_component_labels(pairs, node_count=len(lines))
    return [np.flatnonzero(piece == number) for number in np.unique(piece)]


def _narrow(points: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "2 2"] | None:
    """Return the ends of the middle line of a narrow piece that is as wide as a door; None for any other."""
    centre = points.mean(axis=0)
    _, _, (along, across) = np.linalg.svd(points - centre, full_matrices=False)
    length, thickness = (points - centre) @ along, (points - centre) @ across
    if np.ptp(thickness) > THICKEST or not LEAF[0] <= np.ptp(length) <= WIDEST:
        return None
    middle = centre + (thickness.min() + thickness.max()) / 2 * across
    return middle + np.array([[length.min()], [length.max()]]) * along


def _in_a_wall(ends: Float[np.ndarray, "2 2"], others: Float[np.ndarray, "m 2 2"]) -> bool:
    """Whether something of the section is near both ends, as of a closed leaf. One that stands open has a free end."""
    start, along = others[:, 0], others[:, 1] - others[:, 0]
    squared = (along**2).sum(axis=1).clip(1e-12)
    for end in ends:
        share = (((end - start) * along).sum(axis=1) / squared).clip(0, 1)
        distance = np.linalg.norm(start + share[:, None] * along - end, axis=1)
        if not (distance < WALL).any():
            return False
    return True
