"""Rays that antennas shoot in random directions, to find the sequences of planes that can reflect waves.

Rays only tell where to look: the image method then solves each sequence exactly. So it suffices that one of many rays
passes near the place in question.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Float32, Int

from scenes.scene.description import conducting_objects
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
    starts: Float32[np.ndarray, "3 rays"]  # where it comes from, metres
    directions: Float32[np.ndarray, "3 rays"]  # where it goes, unit vectors
    lengths: Float32[np.ndarray, " rays"]  # of this flight, metres; infinite if it leaves the scene
    travelled: Float32[np.ndarray, " rays"]  # on all flights before, metres
    # what surfaces have left of its amplitude, at most, for any polarisation
    strengths: Float32[np.ndarray, " rays"]
    faces: Int[np.ndarray, " rays"]  # the triangle at the end of the flight; −1 if there is none

    def subset(self, index: Int[np.ndarray, " k"] | Bool[np.ndarray, " rays"]) -> Flights:
        """The flights with these indices, or those that a mask selects."""
        return Flights(*(each[..., index] for each in self))

    def near(self, box: Float[np.ndarray, "2 3"]) -> Bool[np.ndarray, " rays"]:
        """Whether each flight passes a box, or beside it within ``SPREAD``."""
        middle = box.mean(axis=0).astype(np.float32)[:, None]
        way = np.minimum(np.linalg.norm(middle - self.starts, axis=0), self.lengths)
        margin = SPREAD * (self.travelled + way)
        with np.errstate(divide="ignore", invalid="ignore"):  # a ray along an axis
            ends = [
                (corner[:, None].astype(np.float32) - self.starts + side * margin) / self.directions
                for corner, side in zip(box, (-1, 1), strict=True)
            ]
        begin, end = np.fmin(*ends).max(axis=0), np.fmax(*ends).min(axis=0)
        return (begin <= end) & (end >= 0) & (begin <= self.lengths)


class Explored(NamedTuple):
    """The sequences of planes that rays from some antennas found, from the antennas on; −1 after the last plane."""

    arriving: Int[np.ndarray, "n depth"]  # after which a ray passes the box of the other antennas
    short: Int[np.ndarray, "m short"]  # all with few reflections
    numbers: Int[np.ndarray, " m"]  # numbers of these sequences in the flights that ``watch`` saw
    strengths: Float32[np.ndarray, " m"]  # what surfaces left of the amplitude of the strongest ray of each of these

    def shorter(self, most: int) -> Explored:
        """Without the short sequences of more than some number of reflections."""
        kept = (self.short >= 0).sum(axis=1) <= most
        return self._replace(short=self.short[kept], numbers=self.numbers[kept], strengths=self.strengths[kept])


def explore(
    ray_scene: RayScene,
    surfaces: Surfaces,
    antennas: Float[np.ndarray, "antennas 3"],
    others: Float[np.ndarray, "2 3"],
    short: int,
    generator: np.random.Generator,
    watch: Callable[[Flights], None] = lambda flights: None,
) -> Explored:
    """Find the sequences of planes that reflect waves from some antennas, and those that reflect them into a box.

    ``watch`` sees the flights of rays with few reflections that end at surfaces.
    """
    most = ray_scene.propagation.max_depth if ray_scene.propagation.specular else 0
    sequences, arriving, strengths = Sequences(), [], np.ones(1, np.float32)
    for flights in _shoot(ray_scene, surfaces, antennas, most, sequences, generator):
        arriving.append(np.unique(flights.sequences[flights.near(others)]))
        strengths = np.pad(strengths, (0, len(sequences) - len(strengths)))
        few = flights.reflections <= short
        np.maximum.at(strengths, flights.sequences[few], flights.strengths[few])
        watch(flights.subset(few & (flights.faces >= 0)))
    found, beginnings = np.unique(np.concatenate([[0], *arriving])), np.flatnonzero(strengths)
    depth = ray_scene.propagation.max_depth
    return Explored(
        sequences.planes(found, depth),
        sequences.planes(beginnings, min(most, short)),
        beginnings,
        strengths[beginnings],
    )


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
    directions /= np.linalg.norm(directions, axis=0)
    nothing, zero = np.zeros(propagation.rays, np.int64), np.zeros(propagation.rays, np.float32)
    starts = np.ascontiguousarray(origins.T[:, np.arange(propagation.rays) % len(origins)], np.float32)
    flights = Flights(nothing, nothing, starts, directions, zero, zero, zero + 1, nothing)
    for _ in range(most + PASSES + 1 if propagation.refraction else most + 1):
        lengths, faces, reflected, passed = _meet(surfaces, flights.starts, flights.directions)
        flights = flights._replace(lengths=lengths, faces=faces)
        yield flights
        turns = conducts[faces] | (not propagation.refraction) | (generator.random(len(faces), np.float32) < 0.5)
        turns &= flights.reflections < most
        strengths = flights.strengths * np.where(turns, reflected, passed)
        goes = (faces >= 0) & (turns | ~conducts[faces] & propagation.refraction) & (strengths > WEAKEST)
        turns, strengths = turns[goes], strengths[goes]
        flights = flights.subset(goes)
        ends = flights.starts + flights.lengths * flights.directions
        plane, directions = planes.of_face[flights.faces[turns]], flights.directions
        normals = planes.normals[plane].T.astype(np.float32)
        directions[:, turns] -= 2 * (directions[:, turns] * normals).sum(axis=0) * normals
        numbers = flights.sequences.copy()
        numbers[turns] = sequences.extended(numbers[turns], plane)
        flights = flights._replace(
            sequences=numbers,
            reflections=flights.reflections + turns,
            starts=ends + NEAR * directions,
            travelled=flights.travelled + flights.lengths,
            strengths=strengths,
        )
        if not len(strengths):
            return


def _meet(
    surfaces: Surfaces, starts: Float32[np.ndarray, "3 rays"], directions: Float32[np.ndarray, "3 rays"]
) -> tuple[
    Float32[np.ndarray, " rays"], Int[np.ndarray, " rays"], Float32[np.ndarray, " rays"], Float32[np.ndarray, " rays"]
]:
    """How far each ray flies, the triangle it meets (−1: none), and its largest reflection and transmission there."""
    way = mi.Vector3f(directions)
    hit = surfaces.scene.ray_intersect_preliminary(mi.Ray3f(mi.Point3f(starts), way))
    valid = hit.is_valid()
    face = surfaces.face(hit, valid)
    r_te, r_tm, t_te, t_tm = (dr.abs(each) for each in surfaces.coefficients(face, way, valid))
    reflected, passed = dr.maximum(r_te, r_tm), dr.maximum(t_te, t_tm)
    dr.eval(hit.t, face, reflected, passed)
    faces = np.where(valid.numpy(), face.numpy().astype(np.int64), -1)
    return hit.t.numpy(), faces, reflected.numpy(), passed.numpy()
