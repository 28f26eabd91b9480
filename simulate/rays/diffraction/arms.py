"""Arms: the ways from an antenna to an edge, straight or with reflections, and the images of antennas by them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from simulate.rays.core.image_method import Combination, Mirrors, on_device
from simulate.rays.core.ray_tracer import dr, mi
from simulate.rays.diffraction.diffraction_points import TOO_NEAR, Wedge


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


class Images:
    """The images of antennas by arms with equal numbers of reflections, computed where they are needed."""

    def __init__(self, mirrors: Mirrors, wedges: Wedge, arms: Arms, antennas: Float[np.ndarray, "antennas 3"]):
        self._mirrors, self._wedges, self._edges = mirrors, wedges, mi.UInt(arms.edges)
        self._planes = [mi.UInt(plane) for plane in arms.planes.T[: int(arms.reflections.max(initial=0))]]
        self._antennas = on_device(antennas)

    def of(self, antenna: mi.UInt, arm: mi.UInt) -> list[mi.Point3d]:
        """An antenna and its images, metres."""
        images = [dr.gather(mi.Point3d, self._antennas, antenna)]
        for each in self._planes:
            images.append(self._mirrors.image(dr.gather(mi.UInt, each, arm), images[-1]))
        return images

    def edge(self, arm: mi.UInt) -> mi.UInt:
        """Index of an arm's edge."""
        return dr.gather(mi.UInt, self._edges, arm)

    def ways(
        self, antenna: mi.UInt, arm: mi.UInt, point: mi.Point3d
    ) -> tuple[mi.Bool, list[mi.Point3f], list[mi.UInt], mi.Float]:
        """The ways from antennas to points on the arms' edges: whether there are any, corners, triangles, lengths."""
        images = self.of(antenna, arm)
        is_open = in_the_open(self._wedges.gathered(self.edge(arm)), images[-1])
        found, vertices, faces = self.follow(images, arm, point, is_open)
        corners = [mi.Point3f(each) for each in (images[0], *vertices, point)]
        return found, corners, faces, mi.Float(dr.norm(images[-1] - point))

    def follow(
        self, images: list[mi.Point3d], arm: mi.UInt, point: mi.Point3d, active: mi.Bool
    ) -> tuple[mi.Bool, list[mi.Point3d], list[mi.UInt]]:
        """Follow an arm from a point on its edge: whether all reflections are on surfaces, their places and triangles.

        The places are in the order from the antenna on.
        """
        places: list[mi.Point3d] = []
        faces: list[mi.UInt] = []
        for k in range(len(self._planes) - 1, -1, -1):
            plane = dr.gather(mi.UInt, self._planes[k], arm)
            # An edge is not on a plane whose reflection it sees.
            active, face, point = self._mirrors.reflection(plane, images[k + 1], point, TOO_NEAR, active)
            places.insert(0, point)
            faces.insert(0, face)
        return active, places, faces


def in_the_open(edge: Wedge, image: mi.Point3d) -> mi.Bool:
    """Whether the direction of an image is in the open space around an edge."""
    angle, (_, rho) = edge.angle_about(image), edge.about(image)
    return (angle > TOO_NEAR) & (angle < edge.exterior - TOO_NEAR) & (rho > TOO_NEAR)


class Ends:
    """The images of antennas by arms, seen from the arms' edges, kept for many ways.

    The images are numbered through the arms of the first antenna, those of the second one, and so on.
    """

    def __init__(self, mirrors: Mirrors, wedges: Wedge, arms: Arms, antennas: Float[np.ndarray, "antennas 3"]):
        self._computed, self._arms = Images(mirrors, wedges, arms, antennas), len(arms)
        antenna, arm, _ = Combination.of(dr.arange(mi.UInt, len(antennas) * len(arms)), len(arms), 1)
        self._images, own = self._computed.of(antenna, arm), wedges.gathered(self._computed.edge(arm))
        self._z, self._rho = own.about(self._images[-1])
        self._angle = own.angle_about(self._images[-1])
        self._open = in_the_open(own, self._images[-1])
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
        """``Images.follow`` of an image."""
        images = [dr.gather(mi.Point3d, each, number) for each in self._images]
        return self._computed.follow(images, arm, point, active)
