"""The edges of a scene that diffract: wedges and free edges of conductors, and edges of dielectric sheets.

Two triangles of one plane have no edge between them. Neither have facets of a curved surface, whose normals differ by
less than ``SMOOTH``. An edge ends where another body touches it (a cabinet on the floor, a panel against a wall), since
there is no open space around it.

Waves pass through a sheet, so the whole space surrounds its edge. If two sheets meet at an angle, each is a half-plane
of its own. The outer walls have edges at their openings only, since their slabs continue around the corners of the
scene. An edge inside the slab of another object does not diffract, such as that of a door that overlaps its wall.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from scenes.checks.enclosure import outline
from scenes.scene.connected_parts import connected, half_edges, shared_corners
from scenes.scene.description import conducting_objects
from scenes.scene.shapes import union
from simulate.rays.core.ray_scene import RayScene, first_hits

SMOOTH = np.radians(20)  # Faces whose normals differ by less than this are parts of a curved surface

TOUCHING = 1 / 50  # Wavelengths. Another body that is nearer to an edge than this touches it.

SHORTEST = 1 / 4  # Wavelengths. Shorter edges are left out.

BEYOND = 0.1
"""Metres. Where a scene reaches no further than this beyond a face and its edge, the edge is a corner of the scene."""

PIECES = 16  # Number of pieces of an edge, each of which is tested for a body that touches it

AT_ONCE = 10_000  # Edges tested at a time, with 128 rays each. This bounds the memory.


@dataclass(frozen=True)
class Edges:
    """Straight edges, each with the open space around it from one face (0) to the other (n)."""

    starts: Float[np.ndarray, "edges 3"]  # one end of each edge, metres, world frame
    directions: Float[np.ndarray, "edges 3"]  # unit vectors from there along the edge
    lengths: Float[np.ndarray, " edges"]  # metres
    # angle of the open space, radians: 2π at the edge of a sheet, 3π/2 at the edge of a box
    exterior: Float[np.ndarray, " edges"]
    normals: Float[np.ndarray, "edges 3"]  # unit normals of face 0, towards the open space
    tangents: Float[np.ndarray, "edges 3"]  # unit vectors from the edge along face 0, perpendicular to the edge
    faces: Int[np.ndarray, " edges"]  # number of a triangle of face 0, counted through the scene's objects
    sheets: Bool[np.ndarray, " edges"]  # whether the edge belongs to a dielectric sheet

    def __len__(self) -> int:
        return len(self.lengths)

    def subset(self, index: Int[np.ndarray, " k"] | Bool[np.ndarray, " edges"]) -> Edges:
        """The edges with these indices, or those that a mask selects."""
        return Edges(**{name: values[index] for name, values in vars(self).items()})

    def points(self, share: Float[np.ndarray, " k"]) -> Float[np.ndarray, "edges k 3"]:
        """Points of the edges at some shares of their lengths, from the start, metres."""
        return self.starts[:, None] + (self.lengths[:, None] * share)[..., None] * self.directions[:, None]

    def around(self, angles: Float[np.ndarray, "edges k"]) -> Float[np.ndarray, "edges k 3"]:
        """Unit vectors perpendicular to each edge, at some angles from its face 0 on, radians."""
        cosine, sine = np.cos(angles)[..., None], np.sin(angles)[..., None]
        return cosine * self.tangents[:, None] + sine * self.normals[:, None]


def diffracting_edges(ray_scene: RayScene) -> Edges:
    """The edges of the scene's conductors, then those of its dielectric sheets."""
    scene = ray_scene.description
    conducts, around, of_face = conducting_objects(scene), outline(scene), ray_scene.object_of_face
    mesh, metal = union(*(item.mesh for item in scene.objects)), conducts[of_face]
    # Conductors that touch have common corners, and are one body. Sheets are each for themselves.
    apart = np.repeat(np.where(conducts, -1, np.arange(len(conducts))), [len(i.mesh.vertices) for i in scene.objects])
    corners = shared_corners(np.column_stack([mesh.vertices, apart]), 4)[mesh.faces]
    body_of_face = -1 - of_face
    body_of_face[metal] = connected(half_edges(corners[metal]))
    sheets = _edges_of(np.asarray(mesh.vertices), corners, np.flatnonzero(~metal), sheets=True)
    outer = ray_scene.slabs.outer[sheets.faces]
    left_out = np.zeros(len(sheets), bool)
    left_out[outer] = _at_outline(sheets.subset(outer), around)
    in_order = np.lexsort((outer, of_face[sheets.faces]))
    sheets = sheets.subset(in_order[~left_out[in_order]])
    found = _edges_of(np.asarray(mesh.vertices), corners, np.flatnonzero(metal), sheets=False), sheets
    edges = _joined(_together(*found), body_of_face)
    shortest = SHORTEST * scene.wavelength
    edges = _in_the_open(edges.subset(edges.lengths >= shortest), body_of_face, ray_scene)
    return edges.subset(edges.lengths >= shortest)


def _at_outline(edges: Edges, around: Float[np.ndarray, "points 3"]) -> Bool[np.ndarray, " edges"]:
    """Whether the scene does not reach beyond each edge by more than ``BEYOND``, nor beyond its face on one side."""

    def reach(axes: Float[np.ndarray, "edges 3"]) -> Float[np.ndarray, "edges points"]:
        return axes @ around.T - (axes * edges.starts).sum(axis=1, keepdims=True)

    across = reach(edges.normals)
    outermost = np.minimum(across.max(axis=1), -across.min(axis=1)) < BEYOND
    return outermost & (reach(edges.tangents).min(axis=1) > -BEYOND)


def _together(*pieces: Edges) -> Edges:
    """Join several sets of edges into one."""
    return Edges(**{name: np.concatenate([getattr(each, name) for each in pieces]) for name in vars(pieces[0])})


def _edges_of(
    vertices: Float[np.ndarray, "n 3"],
    corners: Int[np.ndarray, "faces 3"],
    numbers: Int[np.ndarray, " k"],
    sheets: bool,
) -> Edges:
    """Every edge of one triangle, or of two at an angle, among those with some numbers.

    Triangles are given by their vertices. If one sheet stands on another, no angle exceeds 180°.
    """
    halves = half_edges(corners[numbers])
    first, count, faces = halves.first, halves.faces, numbers[halves.order // 3]
    one, two = halves.starts[halves.order], halves.ends[halves.order]
    third = corners[faces].sum(axis=1) - one - two  # the triangle's other corner
    starts, ends = vertices[np.minimum(one, two)[first]], vertices[np.maximum(one, two)[first]]
    lengths = np.linalg.norm(ends - starts, axis=1)
    directions = (ends - starts) / lengths[:, None].clip(1e-12)

    def inwards(which: Int[np.ndarray, " k"], of: Int[np.ndarray, " k"]) -> Float[np.ndarray, "k 3"]:
        """Unit vectors perpendicular to the edges ``of``, along the triangles ``faces[which]``."""
        towards = vertices[third[which]] - starts[of]
        towards = towards - (towards * directions[of]).sum(1, keepdims=True) * directions[of]
        return towards / np.linalg.norm(towards, axis=1, keepdims=True).clip(1e-12)

    free, shared = np.nonzero(count == 1)[0], np.nonzero(count == 2)[0]
    along, across = inwards(first[shared], shared), inwards(first[shared] + 1, shared)
    interior = np.arccos(np.clip((along * across).sum(axis=1), -1, 1))
    sharp = interior < np.pi - SMOOTH
    shared, along, across, interior = shared[sharp], along[sharp], across[sharp], interior[sharp]
    # Half-planes: free edges, and both faces of the shared edges of sheets.
    of = np.concatenate([free, shared, shared]) if sheets else free
    which = np.concatenate([first[free], first[shared], first[shared] + 1]) if sheets else first[free]
    tangents = inwards(which, of)
    planes = Edges(
        starts[of],
        directions[of],
        lengths[of],
        np.full(len(of), 2 * np.pi),
        np.cross(tangents, directions[of]),
        tangents,
        faces[which],
        np.full(len(of), sheets),
    )
    if sheets:
        return planes.subset(planes.lengths > 0)
    # The normal of face 0 that points away from the other face.
    normals = np.cross(along, directions[shared])
    normals *= np.where((normals * across).sum(axis=1) > 0, -1, 1)[:, None]
    wedges = Edges(
        starts[shared],
        directions[shared],
        lengths[shared],
        2 * np.pi - interior,
        normals,
        along,
        faces[first[shared]],
        np.full(len(shared), False),
    )
    both = _together(planes, wedges)
    return both.subset(both.lengths > 0)


def _joined(edges: Edges, body_of_face: Int[np.ndarray, " faces"]) -> Edges:
    """Join edges of one body that continue one another in a line between the same faces."""
    if not len(edges):
        return edges
    largest = np.abs(edges.directions).argmax(axis=1)
    sign = np.sign(edges.directions[np.arange(len(edges)), largest])
    directions = edges.directions * sign[:, None]
    along = (edges.starts * directions).sum(axis=1)
    feet = edges.starts - along[:, None] * directions
    first = np.where(sign > 0, along, along - edges.lengths)
    middle = edges.around(edges.exterior[:, None] / 2)[:, 0]  # the same whichever face is face 0
    key = np.column_stack([directions, feet, middle, edges.exterior, body_of_face[edges.faces]]).round(3)
    line = np.unique(key, axis=0, return_inverse=True)[1].ravel()
    order = np.lexsort([first, line])
    line, first, last = line[order], first[order], (first + edges.lengths)[order]
    begins = np.r_[True, (np.diff(line) != 0) | (first[1:] > last[:-1] + 1e-4)]
    ends = np.r_[begins[1:], True]
    kept = order[begins]
    starts, lengths = feet[kept] + first[begins][:, None] * directions[kept], last[ends] - first[begins]
    joined = replace(edges.subset(kept), starts=starts, directions=directions[kept], lengths=lengths)
    return joined.subset(kept.argsort())  # in the given order, which does not depend on where objects are


def _in_the_open(edges: Edges, body_of_face: Int[np.ndarray, " faces"], ray_scene: RayScene) -> Edges:
    """The stretches of edges in no other body's slab, and to which no other body is nearer than ``TOUCHING``."""
    if (body_of_face == body_of_face[0]).all():  # as in a scan
        return edges
    touched = [np.zeros((0, PIECES), bool)]
    for start in range(0, len(edges), AT_ONCE):
        some = edges.subset(np.arange(start, min(start + AT_ONCE, len(edges))))
        touched.append(_touched(some, body_of_face, ray_scene) | _in_a_slab(some, body_of_face, ray_scene))
    # The beginning and the end of each stretch of untouched pieces.
    change = np.diff(np.pad(~np.concatenate(touched), ((0, 0), (1, 1))).astype(int), axis=1)
    edge, begin = np.nonzero(change == 1)
    end = np.nonzero(change == -1)[1]
    chosen = edges.subset(edge)
    piece = chosen.lengths / PIECES
    return replace(
        chosen, starts=chosen.starts + (begin * piece)[:, None] * chosen.directions, lengths=(end - begin) * piece
    )


def _touched(
    edges: Edges, body_of_face: Int[np.ndarray, " faces"], ray_scene: RayScene
) -> Bool[np.ndarray, "edges pieces"]:
    """Whether another body is nearer to each piece of some edges than ``TOUCHING``.

    The test draws a polygon around each piece, from near face 0 to near face n. Its sides must not meet another body.
    """
    shares = (np.arange(PIECES) + 0.5) / PIECES
    around = edges.around(edges.exterior[:, None] * np.linspace(0.05, 0.95, 9))
    corners = edges.points(shares)[:, :, None] + TOUCHING * ray_scene.description.wavelength * around[:, None]
    starts, sides = corners[:, :, :-1], np.diff(corners, axis=2)
    face, _ = first_hits(ray_scene, starts.reshape(-1, 3), sides.reshape(-1, 3), 1.0)
    face = face.reshape(starts.shape[:3])
    return ((face >= 0) & (body_of_face[face] != body_of_face[edges.faces][:, None, None])).any(axis=2)


def _in_a_slab(
    edges: Edges, body_of_face: Int[np.ndarray, " faces"], ray_scene: RayScene
) -> Bool[np.ndarray, "edges pieces"]:
    """Whether each piece of some edges is in the slab of another body, such as the frame of a door in its wall."""
    points = edges.points((np.arange(PIECES) + 0.5) / PIECES)
    own, result = body_of_face[edges.faces][:, None], np.zeros(points.shape[:2], bool)
    for side in (1, -1):
        steps = np.broadcast_to(side * edges.normals[:, None], points.shape)
        face, distance = first_hits(ray_scene, (points + 1e-4 * steps).reshape(-1, 3), steps.reshape(-1, 3), np.inf)
        face, distance = face.reshape(result.shape), distance.reshape(result.shape)
        along = (ray_scene.normals[face] * steps).sum(axis=2)
        reach = np.where(along < 0, *ray_scene.slabs.fronts[face].transpose(2, 0, 1)) / np.abs(along).clip(1e-9)
        result |= (face >= 0) & (body_of_face[face] != own) & (distance < reach)
    return result
