"""Make sheets of walls and boards that are drawn as solid bodies.

A triangle stands for a slab of its material. Where the slabs of two opposite faces of a body meet, rays pass both and
count the slab twice: one sheet as thick as the body is right. It lies where its slab fills the body: in the middle, or
on the inner face of an outer wall, whose slab is behind it.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from itertools import chain, count

import networkx as nx
import numpy as np
import trimesh
from jaxtyping import Float
from trimesh import Trimesh

from scenes.checks.enclosure import WALL_REACH, barycentric, beyond, outline
from scenes.scene.connected_parts import mesh_of, part_meshes
from scenes.scene.description import LONGEST_NAME, Scene, SceneObject
from scenes.scene.materials import is_conductor

SOLID = 2.0  # Thicknesses of the material's slab up to which a body is solid

DRAWN_THIN = 0.4
"""Thicknesses of the material's slab. A thinner body is drawn so only to have two sides, and keeps the material's."""

LEAST_TRIANGLES = 8  # Triangles of a box without its ends

WIDE = 2.0  # Thicknesses of a plate that its faces are wide at least. Columns and beams are narrower.

MOSTLY = 0.6  # Least share of a body's surface that the faces of its plates have. The rest is rims.

OPPOSITE = 0.8  # Least share of the smaller of two faces that lies opposite the larger one

PARALLEL = float(np.radians(1.0))
"""Largest angle between neighbouring triangles of a face, and between the two faces of a plate."""

UNEVEN = 0.02  # Largest deviation of a face from a plane, as a share of the plate's thickness

MOST_FACES = 1000  # Faces of a body, the largest ones, that are looked at. Time grows with their square.

SAMPLED = 16  # Triangles of a face, the largest ones, that are looked at to see what lies opposite

SAMPLES = np.array([[2, 2, 2], [4, 1, 1], [1, 4, 1], [1, 1, 4]]) / 6
"""Barycentric coordinates of the points of a triangle that are looked at."""


def walls_as_sheets(scene: Scene) -> tuple[Scene, dict[str, float]]:
    """Make each plate of a dielectric, at most twice as thick as its slab, one sheet.

    Other parts, and further thicknesses, become objects of their own, such as "walls, 0.12 m thick".
    """
    divided = {item.name: _divided(scene, item) for item in scene.objects}
    placed = _placed(scene, divided)
    names = {item.name for item in scene.objects}
    objects: list[SceneObject] = []
    sheets: dict[str, float] = {}
    for item in scene.objects:
        found, rest = divided[item.name]
        groups: dict[float, list[Float[np.ndarray, "k 3 3"]]] = {}
        for plate, sheet in zip(found, placed[item.name], strict=True):
            slab = scene.thickness(item)
            thickness = plate.thickness if plate.thickness >= DRAWN_THIN * slab else slab
            groups.setdefault(thickness, []).append(sheet)
        if len(rest):
            objects.append(replace(item, mesh=mesh_of(rest)) if groups else item)
        for thickness, parts in groups.items():
            name = item.name
            if len(rest) or len(groups) > 1:
                new = f"{item.name[: LONGEST_NAME - 30]}, {thickness:g} m thick"
                name = next(each for each in chain([new], (f"{new} {k}" for k in count(2))) if each not in names)
                names.add(name)
            sheets[name] = thickness
            objects.append(SceneObject(name, mesh_of(np.concatenate(parts)), item.material, thickness))
    return replace(scene, objects=tuple(objects)), sheets


def _divided(scene: Scene, item: SceneObject) -> tuple[list[MidSurface], Float[np.ndarray, "n 3 3"]]:
    """The plates of an object that count twice (a conductor's do not), and its other triangles, metres."""
    found: list[MidSurface] = []
    if is_conductor(scene.materials[item.material], scene.frequency) or len(item.mesh.faces) < LEAST_TRIANGLES:
        return found, item.mesh.triangles
    rest = [np.zeros((0, 3, 3))]
    for body in [*item.closed_parts, *part_meshes(item.mesh, item.parts, closed=False)]:
        of_body = mid_surfaces(body, SOLID * scene.thickness(item)) if len(body.faces) >= LEAST_TRIANGLES else []
        found += of_body
        rest += [] if of_body else [body.triangles]
    return found, np.concatenate(rest) if found else item.mesh.triangles


def _placed(
    scene: Scene, divided: dict[str, tuple[list[MidSurface], Float[np.ndarray, "n 3 3"]]]
) -> dict[str, list[Float[np.ndarray, "k 3 3"]]]:
    """Move the sheets of outer walls from the middle to the inner face. Outer walls are found among the sheets."""
    every = [plate for found, _ in divided.values() for plate in found]
    if not every:
        return {name: [] for name in divided}
    objects = []
    for item in scene.objects:
        found, rest = divided[item.name]
        mesh = mesh_of(np.concatenate([rest, *(plate.sheet for plate in found)])) if found else item.mesh
        objects.append(replace(item, mesh=mesh))
    around = outline(replace(scene, objects=tuple(objects)))
    normals, front, back = beyond(np.stack([plate.sheet[0] for plate in every]), around)
    half = np.array([plate.thickness / 2 for plate in every])
    inward = np.where(front > back, half, -half)
    moved = np.where(np.minimum(front, back) + half < WALL_REACH, inward, 0.0)
    sheets = iter([plate.sheet + move * normal for plate, move, normal in zip(every, moved, normals, strict=True)])
    return {name: [next(sheets) for _ in found] for name, (found, _) in divided.items()}


@dataclass(frozen=True)
class MidSurface:
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


def mid_surfaces(body: Trimesh, thickest: float) -> list[MidSurface]:
    """Divide a body into plates. They may be turned, have openings, meet in corners, and lack parts of their rims."""
    faces = flat_faces(body)
    pairs = plates(faces, thickest)
    groups = [
        (thickness, members)
        for thickness in dict.fromkeys(pairs.values())
        for members in nx.connected_components(nx.Graph(pair for pair, each in pairs.items() if each == thickness))
    ]
    uses = Counter(number for _, members in groups for number in members)
    if sum(faces[number].area for number in uses) < MOSTLY * body.area:
        return []
    found = []
    for thickness, members in groups:
        normal = faces[min(members)].normal
        sides = [
            [number for number in sorted(members) if sign * (faces[number].normal @ normal) > 0] for sign in (1, -1)
        ]
        # A long face may be opposite shorter ones at several distances. Then these are the sheets.
        side = max(
            sides, key=lambda side: (max(uses[number] for number in side) == 1, sum(faces[n].area for n in side))
        )
        inward = np.concatenate([np.tile(faces[n].normal * -thickness / 2, (len(faces[n].triangles), 1)) for n in side])
        triangles = np.concatenate([faces[number].triangles for number in side])
        found.append(MidSurface(triangles + inward[:, None], thickness))
    return found


def flat_faces(body: Trimesh) -> list[Face]:
    """The largest faces of a body."""
    flat = body.face_adjacency[body.face_adjacency_angles < PARALLEL]
    labels = trimesh.graph.connected_component_labels(flat, node_count=len(body.faces))
    areas, centres, normals = body.area_faces, body.triangles_center, body.face_normals
    middle = np.average(centres, axis=0, weights=areas)
    # Three times the volume, with the sign of the winding. It needs no closed body.
    outward = np.sign((areas * (normals * (centres - middle)).sum(axis=1)).sum()) or 1.0
    faces = []
    for label in np.sort(np.argsort(-np.bincount(labels, areas), kind="stable")[:MOST_FACES]):
        which = np.flatnonzero(labels == label)
        normal = outward * areas[which] @ normals[which]
        area = float(areas[which].sum())
        if np.linalg.norm(normal) > 0:
            centre = np.average(centres[which], axis=0, weights=areas[which])
            faces.append(Face(body.triangles[which], normal / np.linalg.norm(normal), area, centre))
    return faces


def plates(faces: list[Face], thickest: float) -> dict[tuple[int, int], float]:
    """The numbers of faces that are the two sides of a plate, and their distance, metres."""
    if len(faces) < 2:
        return {}
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
