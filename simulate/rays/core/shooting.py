"""Rays that antennas shoot in random directions, to find the sequences of planes that can reflect waves.

Rays only tell where to look: the image method then solves each sequence exactly. So it suffices that one of many rays
passes near the place in question.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Float32, Int

from scenes.scene.description import conducting_objects
from simulate.parallel.compiled import compiled
from simulate.rays.core.ray_scene import NEAR, RayScene
from simulate.rays.core.ray_tracer import dr, mi
from simulate.rays.core.surfaces import Surfaces

PASSES = 8  # Most objects that a ray passes through, on the way there and back

SPREAD = 0.1
"""Radians. A ray stands for those around it up to this angle: it finds what is at most so far beside it."""


WEAKEST = 1e-4  # A ray ends when surfaces have left less than this of its amplitude


class Sequences:
    """Sequences of planes that reflect rays, each known by a number. Number 0 is the sequence without any plane."""

    def __init__(self) -> None:
        self._parents, self._planes = np.zeros(1, np.int64), np.full(1, -1)
        self._keys, self._numbers = np.zeros(0, np.int64), np.zeros(0, np.int64)  # of parent and plane, sorted

    def __len__(self) -> int:
        return len(self._parents)

    def extended(self, numbers: Int[np.ndarray, " n"], planes: Int[np.ndarray, " n"]) -> Int[np.ndarray, " n"]:
        """The numbers of some sequences with one plane more."""
        keys, inverse = np.unique(numbers << 32 | planes, return_inverse=True)
        new = np.setdiff1d(keys, self._keys, assume_unique=True)
        fresh = np.arange(len(self), len(self) + len(new))
        self._parents, self._planes = np.append(self._parents, new >> 32), np.append(self._planes, new & 0xFFFFFFFF)
        self._keys, self._numbers = np.append(self._keys, new), np.append(self._numbers, fresh)
        order = np.argsort(self._keys)
        self._keys, self._numbers = self._keys[order], self._numbers[order]
        return self._numbers[np.searchsorted(self._keys, keys)][inverse]

    def planes(self, numbers: Int[np.ndarray, " n"], most: int) -> Int[np.ndarray, "n most"]:
        """The planes of some sequences, from the antenna on; −1 after the last one."""
        backwards = np.full((len(numbers), most), -1)
        for column in range(most):
            backwards[:, column], numbers = self._planes[numbers], self._parents[numbers]
        return reversed_sequences(backwards)


def reversed_sequences(planes: Int[np.ndarray, "n most"]) -> Int[np.ndarray, "n most"]:
    """The sequences from the other end on."""
    count = (planes >= 0).sum(axis=1, keepdims=True)
    place = count - 1 - np.arange(planes.shape[1])
    return np.where(place >= 0, np.take_along_axis(planes, place.clip(0), axis=1), -1)


class Flights(NamedTuple):
    """The ways of all rays that still run, each from one surface to the next."""

    sequences: Int[np.ndarray, " rays"]  # number of the sequence that has reflected it
    reflections: Int[np.ndarray, " rays"]  # how often it was reflected
    starts: Float32[np.ndarray, "rays 3"]  # where it comes from, metres
    directions: Float32[np.ndarray, "rays 3"]  # where it goes, unit vectors
    travelled: Float32[np.ndarray, " rays"]  # on all flights before, metres
    # what surfaces have left of its amplitude, at most, for any polarisation
    strengths: Float32[np.ndarray, " rays"]
    lengths: Float32[np.ndarray, " rays"]  # of this flight, metres; infinite if it leaves the scene
    faces: Int[np.ndarray, " rays"]  # the triangle at the end of the flight; −1 if there is none


class Explored(NamedTuple):
    """The sequences of planes that rays from some antennas found, from the antennas on; −1 after the last plane."""

    arriving: Int[np.ndarray, "n depth"]  # after which a ray passes the box of the other antennas
    short: Int[np.ndarray, "m short"]  # all with few reflections
    numbers: Int[np.ndarray, " m"]  # numbers of these sequences in the flights that ``watch`` saw
    strengths: Float32[np.ndarray, " m"]  # what surfaces left of the amplitude of the strongest ray of each of these


def explore(
    ray_scene: RayScene,
    surfaces: Surfaces,
    antennas: Float[np.ndarray, "antennas 3"],
    others: Float[np.ndarray, "2 3"],
    short: int,
    generator: np.random.Generator,
    watch: Callable[[Flights], None],
) -> Explored:
    """Find the sequences of planes that reflect waves from some antennas, and those that reflect them into a box.

    Of the sequences with at most ``short`` reflections, all are found. ``watch`` sees all flights.
    """
    most = ray_scene.propagation.max_depth if ray_scene.propagation.specular else 0
    sequences, arriving, strengths = Sequences(), np.ones(1, bool), np.ones(1, np.float32)
    for flights in _shoot(ray_scene, surfaces, antennas, most, sequences, generator):
        arriving, strengths = (np.pad(each, (0, len(sequences) - len(each))) for each in (arriving, strengths))
        _look(flights, others, short, arriving, strengths)
        watch(flights)
    found, beginnings = np.flatnonzero(arriving), np.flatnonzero(strengths)
    arrived = sequences.planes(found, ray_scene.propagation.max_depth)
    return Explored(arrived, sequences.planes(beginnings, short), beginnings, strengths[beginnings])


def _shoot(
    ray_scene: RayScene,
    surfaces: Surfaces,
    origins: Float[np.ndarray, "origins 3"],
    most: int,
    sequences: Sequences,
    generator: np.random.Generator,
) -> Iterator[Flights]:
    """Shoot rays from antennas in random directions, and follow them through at most some number of reflections.

    A conductor reflects a ray. At other objects it is reflected or goes on.
    """
    propagation, planes = ray_scene.propagation, ray_scene.planes
    conducts = conducting_objects(ray_scene.description)[ray_scene.object_of_face]
    directions = generator.standard_normal((3, propagation.rays), np.float32)
    directions = np.ascontiguousarray((directions / np.linalg.norm(directions, axis=0)).T)
    starts = origins.astype(np.float32)[np.arange(propagation.rays) % len(origins)]
    numbers, reflections = np.zeros((2, propagation.rays), np.int64)
    travelled, strengths = np.zeros(propagation.rays, np.float32), np.ones(propagation.rays, np.float32)
    going = numbers, reflections, starts, directions, travelled, strengths
    for _ in range(most + PASSES + 1 if propagation.refraction else most + 1):
        lengths, faces, reflected, passed = _meet(surfaces, going[2], going[3])
        flights = Flights(*going, lengths, faces)
        yield flights
        draws, turning = generator.random(len(faces), np.float32), np.empty(len(faces), np.int64)
        surroundings = conducts, planes.of_face, planes.normals.astype(np.float32)
        count = _go_on(flights, reflected, passed, draws, most, propagation.refraction, *surroundings, turning)
        if not count:
            return
        going = tuple(each[:count] for each in going)
        turned = np.flatnonzero(turning[:count] >= 0)
        going[0][turned] = sequences.extended(going[0][turned], turning[turned])


@compiled(error_model="numpy")  # a ray along an axis may divide by 0
def _look(flights, box, short, arriving, strengths):
    """Mark the sequences that lead a ray past a box, and note the strongest ray of those that are short.

    A ray passes the box if it meets it, or flies beside it within ``SPREAD``.
    """
    middle = (box[0] + box[1]) / 2
    for ray in range(len(flights.faces)):
        number, start, way = flights.sequences[ray], flights.starts[ray], flights.directions[ray]
        if flights.reflections[ray] <= short:
            strengths[number] = max(strengths[number], flights.strengths[ray])
        begin, end = 0.0, flights.lengths[ray]
        x, y, z = middle[0] - start[0], middle[1] - start[1], middle[2] - start[2]
        margin = SPREAD * (flights.travelled[ray] + min(np.sqrt(x * x + y * y + z * z), end))
        for axis in range(3):
            first = (box[0, axis] - margin - start[axis]) / way[axis]
            second = (box[1, axis] + margin - start[axis]) / way[axis]
            begin, end = max(begin, min(first, second)), min(end, max(first, second))
        if begin <= end:
            arriving[number] = True


@compiled
def _go_on(flights, reflected, passed, draws, most, refraction, conducts, plane_of, normals, turning):
    """Take the rays behind the surfaces that they met, those that go on before all others, and count these.

    ``turning`` gets the plane that reflects each of them, −1 for a ray that goes through.
    """
    count = 0
    for ray in range(len(flights.faces)):
        face = flights.faces[ray]
        if face < 0:
            continue
        through = refraction and not conducts[face]
        turns = (not through or draws[ray] < 0.5) and flights.reflections[ray] < most
        strength = flights.strengths[ray] * (reflected[ray] if turns else passed[ray])
        if strength <= WEAKEST or not (turns or through):
            continue
        plane, start, way, length = plane_of[face], flights.starts[ray], flights.directions[ray], flights.lengths[ray]
        normal = normals[plane]
        twice = np.float32(2 * turns) * (way[0] * normal[0] + way[1] * normal[1] + way[2] * normal[2])
        for axis in range(3):
            end, direction = start[axis] + length * way[axis], way[axis] - twice * normal[axis]
            flights.starts[count, axis] = end + np.float32(NEAR) * direction
            flights.directions[count, axis] = direction
        flights.sequences[count] = flights.sequences[ray]
        flights.reflections[count] = flights.reflections[ray] + turns
        flights.travelled[count] = flights.travelled[ray] + length
        flights.strengths[count] = strength
        turning[count] = plane if turns else -1
        count += 1
    return count


def _meet(
    surfaces: Surfaces, starts: Float32[np.ndarray, "rays 3"], directions: Float32[np.ndarray, "rays 3"]
) -> tuple[
    Float32[np.ndarray, " rays"], Int[np.ndarray, " rays"], Float32[np.ndarray, " rays"], Float32[np.ndarray, " rays"]
]:
    """How far each ray flies, the triangle it meets (−1: none), and its largest reflection and transmission there."""
    start, way = (dr.unravel(mi.Vector3f, mi.Float(each.ravel())) for each in (starts, directions))
    hit = surfaces.scene.ray_intersect_preliminary(mi.Ray3f(mi.Point3f(start), way))
    valid = hit.is_valid()
    face = surfaces.face(hit, valid)
    r_te, r_tm, t_te, t_tm = (dr.abs(each) for each in surfaces.coefficients(face, way, valid))
    reflected, passed = dr.maximum(r_te, r_tm), dr.maximum(t_te, t_tm)
    dr.eval(hit.t, face, reflected, passed)
    faces = np.where(valid.numpy(), face.numpy().astype(np.int64), -1)
    return hit.t.numpy(), faces, reflected.numpy(), passed.numpy()
