"""Divide bodies such as the walls of a house into plates: parts between two parallel faces."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
import trimesh
from jaxtyping import Float
from trimesh import Trimesh

from scenes.checks.depth_buffer import barycentric

WIDE = 2.0
"""Thicknesses of a plate that its faces are wide at least. Columns and beams are narrower."""

MOSTLY = 0.6
"""Least share of a body's surface that the faces of its plates have. The rest is rims."""

OPPOSITE = 0.8
"""Least share of the smaller of two faces that lies opposite the larger one."""

PARALLEL = float(np.radians(1.0))
"""Largest angle between neighbouring triangles of a face, and between the two faces of a plate."""

UNEVEN = 0.02
"""Largest deviation of a face from a plane, as a share of the plate's thickness."""

MOST_FACES = 1000
"""Most faces of a body that is divided. Time grows with their square, and terrain has no plates."""

SAMPLED = 16
"""Triangles of a face, the largest ones, that are looked at to see what lies opposite."""

SAMPLES = np.array([[2, 2, 2], [4, 1, 1], [1, 4, 1], [1, 1, 4]]) / 6
"""Barycentric coordinates of the points of a triangle that are looked at."""


@dataclass(frozen=True)
class Plate:
    """A part of a body between two parallel faces."""

    sheet: Float[np.ndarray, "k 3 3"]  # the triangles of its larger side, moved to the middle, metres
    thickness: float  # distance of the two sides, metres, to a tenth of a millimetre


@dataclass(frozen=True)
class Face:
    """Connected triangles of a body in one plane."""

    triangles: Float[np.ndarray, "k 3 3"]  # corners of the triangles, metres
    normal: Float[np.ndarray, " 3"]  # unit normal that points out of the body
    area: float  # square metres
    centre: Float[np.ndarray, " 3"]  # centre of the area, metres


def plates(body: Trimesh, thickest: float) -> list[Plate]:
    """Divide a body into plates. They may be turned, have openings, meet in corners, and lack parts of their rims.

    >>> from scenes.scene.shapes import box
    >>> [plate.thickness for plate in plates(box((0, 0, 0), (4, 0.2, 3)), thickest=0.4)]
    [0.2]
    >>> plates(box((0, 0, 0), (0.3, 0.3, 3)), thickest=0.4)  # a column
    []
    """
    faces = _faces(body)
    pairs = _pairs(faces, thickest) if 2 <= len(faces) <= MOST_FACES else {}
    groups = [
        (thickness, members)
        for thickness in dict.fromkeys(pairs.values())
        for members in _connected([pair for pair, each in pairs.items() if each == thickness], len(faces))
    ]
    uses = Counter(number for _, members in groups for number in members)
    if sum(faces[number].area for number in uses) < MOSTLY * body.area:
        return []
    found = []
    for thickness, members in groups:
        normal = faces[members[0]].normal
        sides = [[number for number in members if sign * (faces[number].normal @ normal) > 0] for sign in (1, -1)]
        # A long face may be opposite shorter ones at several distances. Then these are the sheets.
        side = max(sides, key=lambda side: (max(uses[number] for number in side) == 1, _area(faces, side)))
        inward = np.concatenate([np.tile(faces[n].normal * -thickness / 2, (len(faces[n].triangles), 1)) for n in side])
        triangles = np.concatenate([faces[number].triangles for number in side])
        found.append(Plate(triangles + inward[:, None], thickness))
    return found


def _area(faces: list[Face], numbers: list[int]) -> float:
    return sum(faces[number].area for number in numbers)


def _connected(pairs: list[tuple[int, int]], count: int) -> list[list[int]]:
    """The numbers below ``count`` that are in pairs, divided into those that pairs connect."""
    labels = trimesh.graph.connected_component_labels(np.array(pairs), node_count=count)
    members = sorted({number for pair in pairs for number in pair})
    return [[n for n in members if labels[n] == label] for label in dict.fromkeys(labels[members].tolist())]


def _faces(body: Trimesh) -> list[Face]:
    flat = body.face_adjacency[body.face_adjacency_angles < PARALLEL]
    labels = trimesh.graph.connected_component_labels(flat, node_count=len(body.faces))
    areas, centres, normals = body.area_faces, body.triangles_center, body.face_normals
    middle = np.average(centres, axis=0, weights=areas)
    # Three times the volume, with the sign of the winding. It needs no closed body.
    outward = np.sign((areas * (normals * (centres - middle)).sum(axis=1)).sum())
    order = np.argsort(labels, kind="stable")
    faces = []
    for which in np.split(order, np.flatnonzero(np.diff(labels[order])) + 1):
        normal = outward * areas[which] @ normals[which]
        area = float(areas[which].sum())
        if np.linalg.norm(normal) > 0:
            centre = np.average(centres[which], axis=0, weights=areas[which])
            faces.append(Face(body.triangles[which], normal / np.linalg.norm(normal), area, centre))
    return faces


def _pairs(faces: list[Face], thickest: float) -> dict[tuple[int, int], float]:
    """The numbers of faces that are the two sides of a plate, and their distance, metres."""
    normals = np.array([face.normal for face in faces])
    centres = np.array([face.centre for face in faces])
    heights = normals @ centres.T
    depths = np.diag(heights)[:, None] - heights  # of the centre of each face under each other one
    near = (depths > 0) & (depths < (1 + UNEVEN) * thickest)
    candidates = np.triu(near & near.T & (normals @ normals.T < -np.cos(PARALLEL)))
    pairs = {}
    for first, second in np.argwhere(candidates).tolist():
        smaller, larger = sorted((faces[first], faces[second]), key=lambda face: face.area)
        thickness = float((larger.centre - smaller.centre) @ larger.normal)
        length = np.linalg.norm(np.ptp(smaller.triangles, axis=(0, 1)))
        uneven = max(np.ptp(face.triangles @ larger.normal) for face in (smaller, larger))
        if smaller.area > WIDE * thickness * length and uneven < UNEVEN * thickness and _opposite(smaller, larger):
            pairs[first, second] = round(thickness, 4)
    return pairs


def _opposite(smaller: Face, larger: Face) -> bool:
    """Whether most of a face lies opposite another one."""
    size = trimesh.triangles.area(smaller.triangles)
    largest = np.argsort(-size)[:SAMPLED]
    points = (SAMPLES @ smaller.triangles[largest]).reshape(-1, 3)
    axes = np.linalg.svd(larger.normal[None])[2][1:]  # two directions in the plane
    corners = (larger.triangles[None] - points[:, None, None]) @ axes.T
    _, covered = barycentric(*np.moveaxis(corners.reshape(-1, 3, 2), 1, 0))
    weights = np.repeat(size[largest], len(SAMPLES))
    return bool(np.average(covered.reshape(len(points), -1).any(axis=1), weights=weights) > OPPOSITE)
