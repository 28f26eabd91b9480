"""The edges that rays pass."""

from __future__ import annotations

import numpy as np
from jaxtyping import Int
from scipy.spatial import cKDTree

from simulate.parallel.compiled import compiled
from simulate.rays.core.planes import Planes
from simulate.rays.core.shooting import SPREAD, Explored, Flights
from simulate.rays.diffraction.edges import Edges


class PassingRays:
    """The edges that rays pass, for each sequence of at most ``short`` planes that reflected the rays.

    A ray passes an edge if it meets one of its two faces within ``SPREAD`` of the edge.
    """

    def __init__(self, planes: Planes, edges: Edges, short: int):
        self._planes, self._edges, self._short = planes, edges, short
        self._found = [np.zeros(0, np.int64)]
        # The planes of both faces of every edge. A sheet has one.
        tangents = edges.around(edges.exterior[:, None])[:, 0]
        normals = np.cross(tangents, edges.directions)
        offsets = (normals * edges.starts).sum(axis=1)
        tree = cKDTree(np.column_stack([planes.normals, planes.offsets]))
        ways = [tree.query(sign * np.column_stack([normals, offsets])) for sign in (1, -1)]
        other = np.where(ways[0][0] < ways[1][0], ways[0][1], ways[1][1])
        plane = np.concatenate([planes.of_face[edges.faces], other])
        order = np.argsort(plane, kind="stable")
        self._of_plane = np.searchsorted(plane[order], np.arange(len(planes.normals) + 1))
        self._edge = order % max(1, len(edges))

    def see(self, flights: Flights) -> None:
        """Add the edges that some flights pass."""
        edges = self._edges.starts, self._edges.directions, self._edges.lengths
        given = flights, self._short, self._planes.of_face, self._of_plane, self._edge, *edges
        found = np.empty(_passed(*given, np.zeros(0, np.int64)), np.int64)
        _passed(*given, found)
        self._found.append(np.unique(found))

    def arms(self, explored: Explored) -> tuple[Int[np.ndarray, " arms"], Int[np.ndarray, " arms"]]:
        """Places of the sequences among the short ones of ``explored``, and the edges that their rays passed."""
        number, edge = np.divmod(np.unique(np.concatenate(self._found)), max(1, len(self._edges)))
        place = np.searchsorted(explored.numbers, number).clip(0, len(explored.numbers) - 1)
        known = explored.numbers[place] == number
        return place[known], edge[known]


@compiled(inline="always")
def squared_distance(point, start, direction, length):
    """Square of the distance of a point from an edge."""
    x, y, z = point[0] - start[0], point[1] - start[1], point[2] - start[2]
    along = x * direction[0] + y * direction[1] + z * direction[2]
    beyond = along - min(max(along, 0.0), length)
    return max(x * x + y * y + z * z - along * along, 0.0) + beyond * beyond


@compiled
def _passed(flights, short, plane_of, of_plane, edge_of, starts, directions, lengths, found):
    """Count the edges near which flights end; write number of sequence × edges + edge into ``found`` if not empty."""
    count = 0
    for ray in range(len(flights.faces)):
        if flights.faces[ray] < 0 or flights.reflections[ray] > short:
            continue
        plane, start, way, flown = (
            plane_of[flights.faces[ray]],
            flights.starts[ray],
            flights.directions[ray],
            flights.lengths[ray],
        )
        reach = SPREAD * (flights.travelled[ray] + flown)
        point = (start[0] + flown * way[0], start[1] + flown * way[1], start[2] + flown * way[2])
        for place in range(of_plane[plane], of_plane[plane + 1]):
            edge = edge_of[place]
            if squared_distance(point, starts[edge], directions[edge], lengths[edge]) < reach**2:
                if len(found):
                    found[count] = flights.sequences[ray] * len(starts) + edge
                count += 1
    return count
