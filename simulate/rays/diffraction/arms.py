"""Arms: the ways from an antenna to an edge, straight or with reflections, and the images of antennas by them."""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import cKDTree

from simulate.parallel.compiled import ONE_KERNEL, compiled
from simulate.rays.core.electric_field import surviving
from simulate.rays.core.image_method import AT_ONCE, Combination, Mirrors, batches, mirrored, on_device
from simulate.rays.core.planes import Planes
from simulate.rays.core.ray_tracer import dr, mi
from simulate.rays.core.shooting import SPREAD, Explored, Flights
from simulate.rays.core.sionna_scene import Antennas
from simulate.rays.core.surfaces import Surfaces
from simulate.rays.diffraction.diffraction_points import TOO_NEAR, Wedge
from simulate.rays.diffraction.edges import Edges
from simulate.spectra.spectrum import evenly


@dataclass(frozen=True)
class Arms:
    """Sequences of reflections between an antenna and an edge."""

    planes: Int[np.ndarray, "arms most"]  # planes of the reflections, from the antenna on; −1 after the last one
    edges: Int[np.ndarray, " arms"]  # index of each arm's edge

    def __len__(self) -> int:
        return len(self.edges)

    def subset(self, index: Int[np.ndarray, " k"] | Bool[np.ndarray, " arms"]) -> Arms:
        """The arms with these indices, or those that a mask selects."""
        return Arms(self.planes[index], self.edges[index])

    @property
    def reflections(self) -> Int[np.ndarray, " arms"]:
        """Number of reflections of each arm."""
        return (self.planes >= 0).sum(axis=1)


POINTS = 16  # Number of points of an edge at which an arm is tried

MOST, LEAST = 40_000_000, 8
"""Most ways along which arms are tried, all antennas and points of edges together, and the least number of antennas."""

TRACED = 4  # One of so many ways is traced. If none of these is open, the others are.

MOST_ARMS = 100_000  # Most arms that are tried from either end

LIKELY = 10  # How much stronger a wave must promise to be, as an amplitude, if no ray passed its edge


class Ends:
    """The images of antennas by arms with equal numbers of reflections, seen from the arms' edges.

    The images are numbered through the arms of the first antenna, those of the second one, and so on.
    """

    def __init__(self, mirrors: Mirrors, wedges: Wedge, arms: Arms, antennas: Float[np.ndarray, "antennas 3"]):
        planes = mirrors.planes
        normals, offsets = on_device(planes.normals), mi.Float64(planes.offsets)
        self._mirrors, self._arms = mirrors, len(arms)
        self._planes = [mi.UInt(plane) for plane in arms.planes.T[: int(arms.reflections.max(initial=0))]]
        antenna, arm, _ = Combination.of(dr.arange(mi.UInt, len(antennas) * len(arms)), len(arms), 1)
        self._images = [dr.gather(mi.Point3d, on_device(antennas), antenna)]
        for each in self._planes:
            plane, image = dr.gather(mi.UInt, each, arm), self._images[-1]
            normal = dr.gather(mi.Point3d, normals, plane)
            distance = dr.dot(normal, image) - dr.gather(mi.Float64, offsets, plane)
            self._images.append(mi.Point3d(image - 2 * distance * normal))
        own = wedges.gathered(dr.gather(mi.UInt, mi.UInt(arms.edges), arm))
        self._z, self._rho = own.about(self._images[-1])
        self._angle = own.angle_about(self._images[-1])
        # whether the direction of the last image is in the open space around the edge
        self._open = (self._angle > TOO_NEAR) & (self._angle < own.exterior - TOO_NEAR) & (self._rho > TOO_NEAR)
        dr.eval(self._images, self._z, self._rho, self._angle, self._open)

    def number(self, antenna: mi.UInt, arm: mi.UInt) -> mi.UInt:
        """The number of an antenna's last image."""
        return antenna * dr.opaque(mi.UInt, self._arms) + arm

    def open(self, number: mi.UInt) -> mi.Bool:
        """Whether the direction of an image is in the open space around the edge."""
        return dr.gather(mi.Bool, self._open, number)

    def place(self, number: mi.UInt) -> mi.Point3d:
        """Where an image is, metres."""
        return dr.gather(mi.Point3d, self._images[-1], number)

    def about(self, number: mi.UInt) -> tuple[mi.Float64, mi.Float64]:
        """Cylindrical coordinates of an image about the edge: z from the edge's start along it, and ρ, metres."""
        return dr.gather(mi.Float64, self._z, number), dr.gather(mi.Float64, self._rho, number)

    def angle(self, number: mi.UInt) -> mi.Float64:
        """φ of an image about the edge, from face 0 on, radians."""
        return dr.gather(mi.Float64, self._angle, number)

    def follow(
        self, number: mi.UInt, arm: mi.UInt, point: mi.Point3d, active: mi.Bool
    ) -> tuple[mi.Bool, list[mi.Point3d], list[mi.UInt]]:
        """Follow an arm from a point on its edge: whether all reflections are on surfaces, their places and triangles.

        The places are in the order from the antenna on.
        """
        places: list[mi.Point3d] = []
        faces: list[mi.UInt] = []
        for k in range(len(self._planes) - 1, -1, -1):
            plane = dr.gather(mi.UInt, self._planes[k], arm)
            image = dr.gather(mi.Point3d, self._images[k + 1], number)
            # An edge is not on a plane whose reflection it sees.
            active, face, point = self._mirrors.reflection(plane, image, point, TOO_NEAR, active)
            places.insert(0, point)
            faces.insert(0, face)
        return active, places, faces


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
def _squared_distance(point, start, direction, length):
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
            if _squared_distance(point, starts[edge], directions[edge], lengths[edge]) < reach**2:
                if len(found):
                    found[count] = flights.sequences[ray] * len(starts) + edge
                count += 1
    return count


@dataclass(frozen=True)
class FoundArms:
    """Arms that lead from some antenna to some point of their edges, and are not blocked by conductors."""

    arms: Arms
    strengths: Float[np.ndarray, " arms"]  # what surfaces leave of the amplitude, at most
    lengths: Float[np.ndarray, " arms"]  # of the shortest way, metres


def find_arms(
    surfaces: Surfaces,
    mirrors: Mirrors,
    edges: Edges,
    explored: Explored,
    antennas: Antennas,
    others: Antennas,
    rays: PassingRays,
    least: float,
) -> FoundArms:
    """The arms from some antennas to the edges, of which ``others`` are at the other end of the chains.

    An arm whose wave promises to be weaker than ``least`` is left out, even at ``LIKELY`` times this if no ray passed
    the edge. If there are too many, those where a ray passed come first, then those that promise the strongest waves.
    """
    middle = edges.points(np.array([0.5]))[:, 0]
    behind = np.linalg.norm(middle[:, None] - others.positions[:: -(-len(others) // LEAST)], axis=2).min(axis=1)
    wavelength, planes = surfaces.wavelength, mirrors.planes
    number, edge = rays.arms(explored)
    images = mirrored(planes, explored.short, antennas.positions.mean(axis=0, keepdims=True))[-1, 0]
    before = np.linalg.norm(images[number] - middle[edge], axis=1) - edges.lengths[edge] / 2
    strong = explored.strengths[number] * promise_of(wavelength, before, behind[edge]) >= least
    number, edge = number[strong], edge[strong]
    others_too = _in_beams(wavelength, planes, edges, explored, images, antennas.positions, behind, LIKELY * least)
    promise = np.append(np.full(len(number), np.inf), others_too[2])
    number, edge = np.append(number, others_too[0]), np.append(edge, others_too[1])
    _, first = np.unique(number * len(edges) + edge, return_index=True)  # the first is the one of a ray
    first = first[np.sort(np.argsort(-promise[first], kind="stable")[:MOST_ARMS])]
    tried = Arms(explored.short[number[first]], edge[first])
    if not len(tried):
        return FoundArms(tried, np.zeros(0), np.zeros(0))
    fewer = max(LEAST, MOST // (POINTS * max(1, len(tried))))
    chosen = antennas.positions[evenly(np.arange(len(antennas)), fewer)]
    strengths, lengths = dr.zeros(mi.Float, len(tried)), dr.full(mi.Float, np.inf, len(tried))
    wedges, places = Wedge.of(edges), on_device(chosen)
    points = on_device(edges.points((np.arange(POINTS) + 0.5) / POINTS))
    for count in np.unique(tried.reflections):
        number = np.flatnonzero(tried.reflections == count)
        for start, stop in batches(len(number), len(chosen), POINTS):
            arms = tried.subset(number[start:stop])
            ends, edge, index = Ends(mirrors, wedges, arms, chosen), mi.UInt(arms.edges), mi.UInt(number[start:stop])

            def way(lane: mi.UInt, ends: Ends = ends, edge: mi.UInt = edge) -> tuple:
                arm, antenna, point = Combination.of(lane, len(chosen), POINTS)
                image = ends.number(antenna, arm)
                place = dr.gather(mi.Point3d, points, dr.gather(mi.UInt, edge, arm) * POINTS + point)
                found, vertices, faces = ends.follow(image, arm, place, ends.open(image))
                corners = dr.gather(mi.Point3d, places, antenna), *vertices, place
                return arm, found, corners, faces, mi.Float(dr.norm(ends.place(image) - place))

            every = dr.compress(way(dr.arange(mi.UInt, len(arms) * len(chosen) * POINTS))[1])
            if not dr.width(every):
                continue
            arm, antenna, point = Combination.of(every, len(chosen), POINTS)
            of = dr.gather(mi.UInt, index, arm)
            for again in (False, True):
                some = dr.gather(mi.Float, strengths, of) == 0 if again else (antenna + point) % TRACED == 0
                lane = dr.gather(mi.UInt, every, dr.compress(some))
                if dr.width(lane):
                    arm, _, corners, faces, length = way(lane)
                    strength = surviving(surfaces, [mi.Point3f(each) for each in corners], faces)
                    traced = dr.gather(mi.UInt, index, arm)
                    dr.scatter_reduce(dr.ReduceOp.Max, strengths, strength, traced)
                    dr.scatter_reduce(dr.ReduceOp.Min, lengths, length, traced, strength > 0)
    strong = strengths.numpy()
    kept = strong > 0
    return FoundArms(tried.subset(kept), strong[kept], lengths.numpy()[kept])


@compiled
def promise_of(wavelength, before, behind):
    """About how strong a wave is behind an edge, at given distances (metres) from it, over λ/4π.

    It is about √λ/2π / √(d₁ d₂ (d₁ + d₂)) with the edge's distances d₁ and d₂ from the antennas.
    """
    first, second = np.maximum(before, wavelength), np.maximum(behind, wavelength)
    return np.sqrt(wavelength / (first * second * (first + second))) / (2 * np.pi)


def _in_beams(
    wavelength: float,
    planes: Planes,
    edges: Edges,
    explored: Explored,
    images: Float[np.ndarray, "sequences 3"],
    antennas: Float[np.ndarray, "antennas 3"],
    behind: Float[np.ndarray, " edges"],
    least: float,
) -> tuple[Int[np.ndarray, " arms"], Int[np.ndarray, " arms"], Float[np.ndarray, " arms"]]:
    """The sequences and edges for which some antenna's wave, off the box of the last plane, may meet the edge.

    ``images`` are those of the antennas' middle. With the arms comes how strong their waves promise to be.
    """
    sequences = explored.short
    radius = float(np.linalg.norm(antennas - antennas.mean(axis=0), axis=1).max())
    padded = np.column_stack([np.full(len(sequences), -1), sequences])
    plane = padded[np.arange(len(sequences)), (sequences >= 0).sum(axis=1)]
    mirrors = planes.normals, planes.offsets, planes.low, planes.high
    ends = edges.starts, edges.starts + edges.lengths[:, None] * edges.directions, edges.directions, edges.lengths
    size = AT_ONCE // max(1, len(edges)) + 1
    places, found = [np.zeros(0, np.int64)], [np.zeros(0, np.float32)]
    for start in range(0, len(sequences), size):
        some = images[start : start + size], plane[start : start + size], explored.strengths[start : start + size]
        promises = np.zeros((len(some[0]), len(edges)), np.float32)
        with ONE_KERNEL:
            _meet_beams(some, radius, mirrors, ends, behind, wavelength, least, promises)
        places.append(start * len(edges) + np.flatnonzero(promises))
        found.append(promises[promises > 0])
    return *np.divmod(np.concatenate(places), max(1, len(edges))), np.concatenate(found)


@compiled(parallel=True, error_model="numpy")
def _meet_beams(beams, radius, mirrors, ends, behind, wavelength, least, promises):
    """Write how strong the wave of each beam promises to be behind each edge that it may meet."""
    images, planes, strengths = beams
    normals, offsets, low, high = mirrors
    starts, stops, directions, lengths = ends
    for beam in numba.prange(len(images)):
        # The promise is less than strength √(λ/d₂) / (2π d₁).
        bound = strengths[beam] * np.sqrt(wavelength) / (2 * np.pi * least)
        for edge in range(len(starts)):
            squared = _squared_distance(images[beam], starts[edge], directions[edge], lengths[edge])
            if squared > (radius + bound / np.sqrt(behind[edge])) ** 2:
                continue
            promise = strengths[beam] * promise_of(wavelength, max(np.sqrt(squared) - radius, 0.0), behind[edge])
            plane = planes[beam]
            mirror = normals[plane], offsets[plane], low[plane], high[plane]
            if promise >= least and (plane < 0 or _in_beam(mirror, starts[edge], stops[edge], images[beam], radius)):
                promises[beam, edge] = promise


@compiled
def _in_beam(mirror, start, end, image, radius):
    """Whether the triangle of an image and an edge meets the box of a plane, enlarged by the antennas' radius."""
    normal, offset, low, high = mirror
    nx, ny, nz = normal[0], normal[1], normal[2]
    image_side = nx * image[0] + ny * image[1] + nz * image[2] - offset
    side = 1.0 if image_side > 0 else -1.0
    depth = abs(image_side)
    first = -side * (nx * start[0] + ny * start[1] + nz * start[2] - offset)
    second = -side * (nx * end[0] + ny * end[1] + nz * end[2] - offset)
    if depth <= radius:  # the plane is between the antennas
        return True
    if first < TOO_NEAR and second < TOO_NEAR:  # behind the mirror
        return False
    far = 0.0
    for axis in range(3):
        far = max(far, abs(start[axis] - image[axis]), abs(end[axis] - image[axis]))
    # How far the other antennas' waves meet the plane from that of their middle, at most.
    margin = TOO_NEAR + radius * (1 + 2 * far / (depth - radius + max(min(first, second), 0.0)))
    for axis in range(3):
        a, b = start[axis], end[axis]
        # The part of the edge that is before the mirror.
        if first < 0:
            a = b + (a - b) * second / (second - first)
        elif second < 0:
            b = a + (b - a) * first / (first - second)
        a = image[axis] + (a - image[axis]) * depth / (depth + max(first, 0.0))
        b = image[axis] + (b - image[axis]) * depth / (depth + max(second, 0.0))
        if max(a, b) < low[axis] - margin or min(a, b) > high[axis] + margin:
            return False
    return True
