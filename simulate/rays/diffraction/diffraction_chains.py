"""Chains with diffractions: an arm from the source to an edge, perhaps a link to another edge, an arm to the target.

Objects that a path passes through are not part of the chain. They are found when the path is solved.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from simulate.rays.core.ray_scene import RayScene, first_hits
from simulate.rays.diffraction.arms import Arms
from simulate.rays.diffraction.edges import Edges

NO_LINK = -1


@dataclass(frozen=True)
class DiffractedChains:
    """Pairs of arms that meet at an edge, or at the two edges of a link."""

    near: Arms  # the arms from the sources
    far: Arms  # the arms from the targets
    links: Links  # the links between edges
    pairs: Int[np.ndarray, "chains 2"]  # index of each chain's near arm and far arm
    link: Int[np.ndarray, " chains"]  # index of each chain's link, or ``NO_LINK``

    def __len__(self) -> int:
        return len(self.pairs)

    def subset(self, index: Int[np.ndarray, " k"] | Bool[np.ndarray, " chains"]) -> DiffractedChains:
        """The chains with these indices, or those that a mask selects, with the arms and links that they need."""
        near, near_index = np.unique(self.pairs[index, 0], return_inverse=True)
        far, far_index = np.unique(self.pairs[index, 1], return_inverse=True)
        link = self.link[index]
        linked, link_index = np.unique(link[link != NO_LINK], return_inverse=True)
        renumbered = np.full(len(link), NO_LINK)
        renumbered[link != NO_LINK] = link_index
        pairs = np.column_stack([near_index, far_index])
        return DiffractedChains(
            self.near.subset(near), self.far.subset(far), self.links.subset(linked), pairs, renumbered
        )

    @property
    def edges(self) -> Int[np.ndarray, "chains 2"]:
        """Indices of the two edges of each chain; without a link, one edge twice."""
        return np.column_stack([self.near.edges[self.pairs[:, 0]], self.far.edges[self.pairs[:, 1]]])

    @property
    def shapes(self) -> Int[np.ndarray, "chains 3"]:
        """Numbers of reflections before each chain's edges, of diffractions, and of reflections after its edges."""
        before, after = self.near.reflections[self.pairs[:, 0]], self.far.reflections[self.pairs[:, 1]]
        return np.column_stack([before, 1 + (self.link != NO_LINK), after])


def chains_of(near: Arms, far: Arms, links: Links, most_reflections: tuple[int, int]) -> DiffractedChains:
    """All chains up to a number of reflections: pairs of arms at an edge, then pairs at the ends of a link."""
    edges = np.intersect1d(near.edges, far.edges)
    once, _ = _pairs(near, far, np.column_stack([edges, edges]), most_reflections[0])
    twice, link = _pairs(near, far, links.edges, most_reflections[1])
    numbers = np.concatenate([np.full(len(once), NO_LINK), link])
    return DiffractedChains(near, far, links, np.concatenate([once, twice]), numbers)


def _pairs(
    near: Arms, far: Arms, edges: Int[np.ndarray, "n 2"], most_reflections: int
) -> tuple[Int[np.ndarray, "pairs 2"], Int[np.ndarray, " pairs"]]:
    """Pairs of arms at some pairs of edges, in lexical order, and the pair of edges that each belongs to."""
    found, links = [np.zeros((0, 2), np.int64)], [np.zeros(0, np.int64)]
    for reflections in range(most_reflections + 1):
        begins = np.flatnonzero(near.reflections == reflections)
        ends = np.flatnonzero(far.reflections <= most_reflections - reflections)
        which, first = _joined(edges[:, 0], near.edges[begins])
        of_first, second = _joined(edges[which, 1], far.edges[ends])
        found.append(np.column_stack([begins[first[of_first]], ends[second]]))
        links.append(which[of_first])
    pairs, which = np.concatenate(found), np.concatenate(links)
    order = np.lexsort((which, pairs[:, 1], pairs[:, 0]))
    return pairs[order], which[order]


def _joined(
    values: Int[np.ndarray, " n"], others: Int[np.ndarray, " m"]
) -> tuple[Int[np.ndarray, " pairs"], Int[np.ndarray, " pairs"]]:
    """Indices of all pairs of equal numbers."""
    order = np.argsort(others, kind="stable")
    begin, end = (np.searchsorted(others[order], values, side) for side in ("left", "right"))
    index = np.repeat(np.arange(len(values)), end - begin)
    place = np.arange(len(index)) - np.repeat(np.cumsum(end - begin) - (end - begin), end - begin)
    return index, order[begin[index] + place]


THROUGH_SPACE = -1  # Stands for the face of a link that runs along no face

LIFT = 1e-3  # Distance of a way along a face from the face, metres

POINTS = 6  # Number of points of an edge at which a link is tried

FLAT = 1e-3  # Tolerance of distances (metres), of angles (radians), and of the cosine between normals

PAIRS_AT_ONCE = 50_000
"""Pairs of edges examined at a time, with ``POINTS``² rays each. This bounds the memory."""


@dataclass(frozen=True)
class Links:
    """Ordered pairs of edges."""

    edges: Int[np.ndarray, "links 2"]  # indices of the edges where each link begins and ends
    # the face along which it runs, as numbered at each of the two edges: 0, or 1 for face n; or ``THROUGH_SPACE``
    faces: Int[np.ndarray, "links 2"]

    def __len__(self) -> int:
        return len(self.edges)

    def subset(self, index: Int[np.ndarray, " k"] | Bool[np.ndarray, " links"]) -> Links:
        """The links with these indices, or those that a mask selects."""
        return Links(self.edges[index], self.faces[index])


NO_LINKS = Links(np.zeros((0, 2), np.int64), np.zeros((0, 2), np.int64))


def links_between(edges: Edges, some: Int[np.ndarray, " k"], ray_scene: RayScene) -> Links:
    """The links between some conductors' edges that see each other at some point."""
    found = [NO_LINKS]
    conductors = some[~edges.sheets[some]]
    block = max(1, PAIRS_AT_ONCE // max(1, len(conductors)))
    for start in range(0, len(conductors), block):
        begins = conductors[start : start + block]
        first, second = (index.ravel() for index in np.meshgrid(begins, conductors, indexing="ij"))
        other = first != second
        found += _open_links(edges, first[other], second[other], ray_scene)
    return Links(np.concatenate([links.edges for links in found]), np.concatenate([links.faces for links in found]))


def lift_of(edges: Edges, faces: Int[np.ndarray, " k"]) -> Float[np.ndarray, "k 3"]:
    """Distance from each of some edges at which a way along its face begins, metres; 0 for ``THROUGH_SPACE``."""
    normal = np.where((faces == 1)[:, None], _face(edges, 1)[0], edges.normals)
    return np.where((faces == THROUGH_SPACE)[:, None], 0.0, LIFT * normal)


def _open_links(
    edges: Edges, first: Int[np.ndarray, " k"], second: Int[np.ndarray, " k"], ray_scene: RayScene
) -> list[Links]:
    """The links between first and second edges that nothing blocks, first those through space, then along faces."""
    pairs = np.column_stack([first, second])
    candidates = [Links(pairs, np.full(pairs.shape, THROUGH_SPACE))]
    for face in (0, 1):
        for other in (0, 1):
            shared = pairs[_bound_one_face(edges, first, second, face, other)]
            candidates.append(Links(shared, np.broadcast_to([face, other], shared.shape)))
    return [links.subset(_sees(edges, links, ray_scene)) for links in candidates]


def _bound_one_face(
    edges: Edges, first: Int[np.ndarray, " k"], second: Int[np.ndarray, " k"], face: int, other: int
) -> Bool[np.ndarray, " k"]:
    """Whether ``face`` of each first edge and ``other`` of the second edge lie in one plane and face each other."""
    normal, tangent = _face(edges, face)
    other_normal, other_tangent = _face(edges, other)
    ends = edges.points(np.array([0.0, 1.0]))
    forth, back = ends[second] - edges.starts[first][:, None], ends[first] - edges.starts[second][:, None]
    return (
        ((normal[first] * other_normal[second]).sum(axis=1) > 1 - FLAT)
        & (np.abs((forth * normal[first][:, None]).sum(axis=2)) < FLAT).all(axis=1)
        & ((forth * tangent[first][:, None]).sum(axis=2) > FLAT).any(axis=1)
        & ((back * other_tangent[second][:, None]).sum(axis=2) > FLAT).any(axis=1)
    )


def _face(edges: Edges, face: int) -> tuple[Float[np.ndarray, "edges 3"], Float[np.ndarray, "edges 3"]]:
    """Unit normal of a face of every edge, and the direction along the face away from the edge."""
    if face == 0:
        return edges.normals, edges.tangents
    return edges.around(edges.exterior[:, None] - np.pi / 2)[:, 0], edges.around(edges.exterior[:, None])[:, 0]


def _sees(edges: Edges, links: Links, ray_scene: RayScene) -> Bool[np.ndarray, " links"]:
    """Whether a straight line between some points of each link's two edges meets nothing."""
    shares = (np.arange(POINTS) + 0.5) / POINTS
    points = edges.points(shares)
    begin, end = edges.subset(links.edges[:, 0]), edges.subset(links.edges[:, 1])
    starts = points[links.edges[:, 0]] + lift_of(begin, links.faces[:, 0])[:, None]
    stops = points[links.edges[:, 1]] + lift_of(end, links.faces[:, 1])[:, None]
    shape = (len(links), POINTS, POINTS, 3)
    starts, stops = np.broadcast_to(starts[:, :, None], shape), np.broadcast_to(stops[:, None], shape)
    clear = np.zeros(len(links), bool)
    ways = stops - starts
    open_ways = (links.faces[:, 0] != THROUGH_SPACE)[:, None, None] | (
        _in_open_space(begin, ways) & _in_open_space(end, -ways)
    )
    which = np.nonzero(open_ways)
    # From a little behind the first edge to a little before the second.
    face, _ = first_hits(ray_scene, (starts + 1e-3 * ways)[which], 0.998 * ways[which], 1.0)
    clear[which[0][face < 0]] = True
    return clear


def _in_open_space(edges: Edges, ways: Float[np.ndarray, "edges p q 3"]) -> Bool[np.ndarray, "edges p q"]:
    """Whether ways from each edge lead into the open space around it."""
    x, y = (np.einsum("epqi,ei->epq", ways, axis) for axis in (edges.tangents, edges.normals))
    angle = np.arctan2(y, x) % (2 * np.pi)
    return (angle > FLAT) & (angle < edges.exterior[:, None, None] - FLAT) & (np.hypot(x, y) > FLAT)
