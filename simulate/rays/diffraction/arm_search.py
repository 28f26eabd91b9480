"""Find the arms that lead from some antennas to edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from simulate.rays.core.electric_field import surviving
from simulate.rays.core.image_method import Combination, Mirrors, batches, mirrored, on_device
from simulate.rays.core.planes import Planes
from simulate.rays.core.ray_tracer import dr, mi
from simulate.rays.core.shooting import Explored
from simulate.rays.core.sionna_scene import Antennas
from simulate.rays.core.surfaces import Surfaces
from simulate.rays.diffraction.arms import Arms, Images
from simulate.rays.diffraction.beams import in_beams, promise_of
from simulate.rays.diffraction.diffraction_points import Wedge
from simulate.rays.diffraction.edges import Edges
from simulate.rays.diffraction.passing_rays import PassingRays
from simulate.spectra.spectrum import evenly

POINTS, FEWEST = 16, 2
"""Number of points of an edge at which an arm is tried, from all antennas together and at least from each."""

MOST, LEAST = 40_000_000, 8
"""Most ways along which arms are tried, from all antennas together, and the least number of antennas."""

TRACED = 4  # One of so many ways is traced. If none of these is open, the others are.

MOST_ARMS = 100_000  # Most arms that are tried from either end

LIKELY = 10  # How much stronger a wave must promise to be, as an amplitude, if no ray passed its edge


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
    wedges: Wedge,
    explored: Explored,
    antennas: Antennas,
    others: Antennas,
    rays: PassingRays,
    least: float,
) -> FoundArms:
    """The arms from some antennas to the edges, of which ``others`` are at the other end of the chains."""
    tried = _promising(surfaces.wavelength, mirrors.planes, edges, explored, antennas, others, rays, least)
    if not len(tried):
        return FoundArms(tried, np.zeros(0), np.zeros(0))
    fewer = MOST // len(tried)
    chosen = antennas.positions[evenly(np.arange(len(antennas)), max(LEAST, fewer // FEWEST))]
    # Antennas take turns at the points: the first one has every fourth, the second one those beside them, and so on.
    count = min(max(FEWEST, fewer // len(chosen)), POINTS)
    turns, firsts = -(-POINTS // count), mi.UInt(np.arange(count) * POINTS // count)
    strengths, lengths = dr.zeros(mi.Float, len(tried)), dr.full(mi.Float, np.inf, len(tried))
    points = on_device(edges.points((np.arange(POINTS) + 0.5) / POINTS))
    for reflections in np.unique(tried.reflections):
        number = np.flatnonzero(tried.reflections == reflections)
        for start, stop in batches(len(number), len(chosen), count):
            arms, index = tried.subset(number[start:stop]), mi.UInt(number[start:stop])
            images = Images(mirrors, wedges, arms, chosen)

            def way(lane: mi.UInt, images: Images = images) -> tuple:
                arm, antenna, turn = Combination.of(lane, len(chosen), count)
                point = images.edge(arm) * POINTS + dr.gather(mi.UInt, firsts, turn) + antenna % turns
                return arm, *images.ways(antenna, arm, dr.gather(mi.Point3d, points, point))

            every = mi.UInt(dr.compress(way(dr.arange(mi.UInt, len(arms) * len(chosen) * count))[1]))
            if not dr.width(every):
                continue
            few = dr.arange(mi.UInt, dr.width(every)) % TRACED == 0
            of = dr.gather(mi.UInt, index, Combination.of(every, len(chosen), count).target)
            for again in (False, True):
                some = dr.gather(mi.Float, strengths, of) == 0 if again else few
                lane = dr.gather(mi.UInt, every, mi.UInt(dr.compress(some)))
                if dr.width(lane):
                    arm, _, corners, faces, length = way(lane)
                    strength, traced = surviving(surfaces, corners, faces), dr.gather(mi.UInt, index, arm)
                    dr.scatter_reduce(dr.ReduceOp.Max, strengths, strength, traced)
                    dr.scatter_reduce(dr.ReduceOp.Min, lengths, length, traced, strength > 0)
    strong = strengths.numpy()
    kept = strong > 0
    return FoundArms(tried.subset(kept), strong[kept], lengths.numpy()[kept])


def _promising(
    wavelength: float,
    planes: Planes,
    edges: Edges,
    explored: Explored,
    antennas: Antennas,
    others: Antennas,
    rays: PassingRays,
    least: float,
) -> Arms:
    """The arms that promise a wave of at least ``least``, or of ``LIKELY`` times this if no ray passed the edge.

    If there are too many, those where a ray passed come first, then those that promise the strongest waves.
    """
    middle = edges.points(np.array([0.5]))[:, 0]
    behind = np.linalg.norm(middle[:, None] - others.positions[:: -(-len(others) // LEAST)], axis=2).min(axis=1)
    number, edge = rays.arms(explored)
    images = mirrored(planes, explored.short, antennas.positions.mean(axis=0, keepdims=True))[-1, 0]
    before = np.linalg.norm(images[number] - middle[edge], axis=1) - edges.lengths[edge] / 2
    strong = explored.strengths[number] * promise_of(wavelength, before, behind[edge]) >= least
    number, edge = number[strong], edge[strong]
    others_too = in_beams(wavelength, planes, edges, explored, images, antennas.positions, behind, LIKELY * least)
    promise = np.append(np.full(len(number), np.inf), others_too[2])
    number, edge = np.append(number, others_too[0]), np.append(edge, others_too[1])
    _, first = np.unique(number * len(edges) + edge, return_index=True)  # the first is the one of a ray
    first = first[np.sort(np.argsort(-promise[first], kind="stable")[:MOST_ARMS])]
    return Arms(explored.short[number[first]], edge[first])
