"""The material at every edge of the cells, from a scene's slabs and conducting sheets.

An edge near the surface of a slab is partly in the slab. Let f be the fraction of a cell's width that is inside. Then

    ε̃ = 1 + f (ε̃_s − 1)        where the edge is along the surface (the field there is continuous),
    1/ε̃ = f/ε̃_s + (1 − f)      where it is across (the flux density is continuous),

with ε̃ = ε_r − jσ/ωε₀. So the surface is at its true place and not at the nearest edge, and a board thinner than a cell
acts as an equivalent sheet. [farjadpour2006] derives the same means for FDTD. A conductor consists of the faces between
the middles of cells on its two sides. Curved and oblique conductors become staircases, up to half a cell off.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, UInt8, UInt16

from scenes.scene.description import Scene
from scenes.scene.materials import VACUUM_PERMITTIVITY, RadioMaterial, relative_permittivity
from simulate.fullwave.yee_grid import YeeGrid, numerical_frequency, numerical_permittivity
from simulate.parallel.compiled import compiled
from simulate.rays.core.slabs import Slabs, conducting_triangles, dielectric_slabs

CONDUCTOR, AIR = 0, 1  # Indices of the first two materials

LEVELS = 40  # The fraction f is rounded to multiples of one over this number

CORNER = 0.06
"""Metres. The slab of an outer wall is continued from this far inside the edge of the scene to beyond it. So rooms are
closed at their corners, even if a pane sits a little behind its wall."""

TOUCH = 1e-6  # Barycentric tolerance, so that no line falls between two triangles of one surface

EVEN = 1e-6
"""Cells. Rounding of coordinates far from the origin does not decide how far the slab of an outer wall is continued."""


@dataclass(frozen=True)
class EdgeMaterials:
    """The material at the middle of every edge."""

    index: UInt16[np.ndarray, "3 nx+1 ny+1 nz+1"]  # index into the two tables, by axis of the edge and its place
    permittivity: Float[np.ndarray, " materials"]  # ε_r of each material
    conductivity: Float[np.ndarray, " materials"]  # σ of each material, S/m; infinite for ``CONDUCTOR``


def edge_materials(scene: Scene, grid: YeeGrid) -> EdgeMaterials:
    objects = dielectric_slabs(scene)
    materials = list(dict.fromkeys(slabs.material for slabs in objects))
    permittivity, conductivity = _tables(materials, scene, grid.cell)
    index = np.full((3, *(size + 1 for size in grid.shape)), AIR, np.uint16)
    room = scene.bounds + np.array([[CORNER], [-CORNER]])
    for slabs in objects:
        _lay(slabs, materials.index(slabs.material), index, permittivity, grid, room)
    for triangle in conducting_triangles(scene):
        corners = (triangle - np.asarray(grid.origin)) / grid.cell
        for axis in range(3):
            _cover(corners, axis, index)
    return EdgeMaterials(index, permittivity, conductivity)


def permittivity_on_grid(material: RadioMaterial, scene: Scene, cell: float) -> complex:
    """The complex relative permittivity with which a material acts on the grid as it does at the scene's frequency."""
    given = relative_permittivity(material, scene.frequency)
    return given * numerical_permittivity(given.real, scene.wavelength, cell) / given.real


def _tables(
    materials: list[RadioMaterial], scene: Scene, cell: float
) -> tuple[Float[np.ndarray, " m"], Float[np.ndarray, " m"]]:
    """ε_r and σ of the conductor, of air, and of every material at every fraction, along and across its surface."""
    fraction = np.arange(1, LEVELS + 1) / LEVELS
    complex_permittivity = [np.array([1.0, 1.0], complex)]
    for material in materials:
        slab = permittivity_on_grid(material, scene, cell)
        complex_permittivity += [1 + fraction * (slab - 1), 1 / (fraction / slab + 1 - fraction)]
    values = np.concatenate(complex_permittivity)
    frequency = numerical_frequency(scene.wavelength, cell)
    conductivity = -values.imag * 2 * np.pi * frequency * VACUUM_PERMITTIVITY
    conductivity[CONDUCTOR] = np.inf
    return values.real, conductivity


def _lay(
    slabs: Slabs,
    number: int,
    index: UInt16[np.ndarray, "3 nx+1 ny+1 nz+1"],
    permittivity: Float[np.ndarray, " m"],
    grid: YeeGrid,
    room: Float[np.ndarray, "2 3"],
) -> None:
    """Write the slabs of an object into the index. Where slabs overlap, the one with the larger permittivity counts."""
    origin, cell = np.asarray(grid.origin), grid.cell
    for triangle, normal, start, stop, outer in zip(
        slabs.triangles, slabs.normals, slabs.start, slabs.stop, slabs.outer, strict=True
    ):
        prism = np.concatenate([triangle + start * normal, triangle + stop * normal])
        low, high = prism.min(axis=0) - cell, prism.max(axis=0) + cell
        if outer:  # around the corners of the room, too
            reach = abs(stop) + CORNER
            low = np.where(low < room[0] + cell, low - reach, low)
            high = np.where(high > room[1] - cell, high + reach, high)
        first = np.clip(np.floor((low - origin) / cell + EVEN), 0, grid.shape).astype(int)
        last = np.clip(np.ceil((high - origin) / cell - EVEN), 0, grid.shape).astype(int)
        for axis in range(3):
            across = abs(normal[axis]) > np.sqrt(0.5)
            base = 2 + (2 * number + across) * LEVELS - 1
            _fill(
                index[axis], permittivity, base, triangle, normal, start, stop, bool(outer), room,
                origin + cell * grid.edge_offset(axis), cell, first, last,
            )  # fmt: skip


@compiled
def _fill(index, permittivity, base, triangle, normal, start, stop, outer, room, origin, cell, first, last):
    """Raise the index of the edges along one axis that are in the slab of one triangle."""
    a = triangle[0]
    u, v = triangle[1] - a, triangle[2] - a
    uu, uv, vv = (u * u).sum(), (u * v).sum(), (v * v).sum()
    area = uu * vv - uv * uv
    half = cell / 2 * np.abs(normal).sum()
    if area < 1e-18:
        return
    for i in range(first[0], last[0] + 1):
        for j in range(first[1], last[1] + 1):
            for k in range(first[2], last[2] + 1):
                p = origin + cell * np.array([i, j, k], dtype=np.float64)
                depth = ((p - a) * normal).sum()
                inside = (min(depth + half, stop) - max(depth - half, start)) / (2 * half)
                level = int(np.floor(inside * LEVELS + 0.5))
                if level < 1:
                    continue
                if outer:
                    p = np.minimum(np.maximum(p, room[0]), room[1])
                w = p - a
                wu, wv = (w * u).sum(), (w * v).sum()
                s, t = (wu * vv - wv * uv) / area, (wv * uu - wu * uv) / area
                if s < -TOUCH or t < -TOUCH or s + t > 1 + TOUCH:
                    continue
                if permittivity[base + level] > permittivity[index[i, j, k]]:
                    index[i, j, k] = base + level


@compiled
def _cover(corners, axis, index):
    """Make conducting those faces across an axis where a triangle separates the middles of cells; unit: a cell."""
    b, c = (axis + 1) % 3, (axis + 2) % 3
    ax, ay = corners[0, b], corners[0, c]
    ux, uy = corners[1, b] - ax, corners[1, c] - ay
    vx, vy = corners[2, b] - ax, corners[2, c] - ay
    area = ux * vy - uy * vx
    if abs(area) < 1e-12:
        return
    size = np.array(index.shape[1:]) - 1
    for i in range(max(0, int(np.floor(corners[:, b].min()))), min(size[b], int(np.ceil(corners[:, b].max())) + 1)):
        for j in range(max(0, int(np.floor(corners[:, c].min()))), min(size[c], int(np.ceil(corners[:, c].max())) + 1)):
            wx, wy = i + 0.5 - ax, j + 0.5 - ay
            s, t = (wx * vy - wy * vx) / area, (ux * wy - uy * wx) / area
            if s < -TOUCH or t < -TOUCH or s + t > 1 + TOUCH:
                continue
            height = corners[0, axis] + s * (corners[1, axis] - corners[0, axis])
            height += t * (corners[2, axis] - corners[0, axis])
            plane = int(np.floor(height + 0.5))
            if plane < 0 or plane > size[axis]:
                continue
            place = np.zeros(3, dtype=np.int64)
            place[axis] = plane
            for side in range(2):
                place[b], place[c] = i, j + side
                index[b, place[0], place[1], place[2]] = CONDUCTOR
                place[b], place[c] = i + side, j
                index[c, place[0], place[1], place[2]] = CONDUCTOR


SHEET = 1 / (math.sqrt(2) + 2 * 2**0.25 * math.cos(math.pi / 8) - 3)
BLOCK = 1 / ((2 ** (2 / 3) * math.sqrt(0.75) + 1.5 * 2 ** (1 / 3)) / math.sqrt(0.75) - 3)
PERMEABILITY = (1.0, SHEET, BLOCK)
"""μ_r of a magnetic component that is not beside an edge, beside the edge of a sheet, and beside that of a block."""


def beside_edges(conducting: Bool[np.ndarray, "3 nx+1 ny+1 nz+1"]) -> UInt8[np.ndarray, "3 nx+1 ny+1 nz+1"]:
    """Find the magnetic components beside edges of conductors, where differences between cells are wrong.

    The electric field along an edge grows with the distance r from it, like r^½ for a sheet and like r^⅔ for a block.
    Differences between cells assume a smooth field, so a conductor appears about a third of a cell too large. Consider
    the edges of cells next to the conductor's edge. The difference form of Laplace's equation, Σ (E_neighbour − E)/μ_r
    = 0, holds there for this static field if the difference towards the conductor's edge has the weight α = 1/μ_r
    [mur1981]:

        α = √2 + 2·2^¼ cos(π/8) − 3                  = 0.612 beside the edge of a sheet,
        α = (2^⅔ sin 60° + 2^⅓ (1 + ½)) / sin 60° − 3 = 0.770 beside the edge of a block.

    The field across the edge, which grows like r^−½, is not corrected. Corners of staircases count as edges of blocks.
    """
    faces = np.stack([_faces(conducting, axis) for axis in range(3)])
    found = np.zeros(conducting.shape, np.uint8)
    for axis in range(3):
        b, c = (axis + 1) % 3, (axis + 2) % 3
        # The four faces around an edge: two across b, on either side along c; two across c, on either side along b.
        around = [(b, faces[b]), (b, _moved(faces[b], c, 1)), (c, faces[c]), (c, _moved(faces[c], b, 1))]
        across_b, across_c = around[0][1] ^ around[1][1], around[2][1] ^ around[3][1]
        number = sum(face.astype(np.uint8) for _, face in around)
        of_sheet, of_block = number == 1, (number == 2) & across_b & across_c
        code = of_sheet.astype(np.uint8) + 2 * of_block.astype(np.uint8)
        for normal, other, side in ((b, c, 0), (b, c, -1), (c, b, 0), (c, b, -1)):
            beside = _moved(code, other, side)
            found[normal] = np.where(faces[normal], 0, np.maximum(found[normal], beside))
    return found


def _faces(conducting: Bool[np.ndarray, "3 nx+1 ny+1 nz+1"], axis: int) -> Bool[np.ndarray, "nx+1 ny+1 nz+1"]:
    """Whether each face across an axis is conducting, because all its four edges are."""
    b, c = (axis + 1) % 3, (axis + 2) % 3
    return conducting[b] & _moved(conducting[b], c, -1) & conducting[c] & _moved(conducting[c], b, -1)


def _moved(values: np.ndarray, axis: int, by: int) -> np.ndarray:
    """Values moved along an axis to higher (1) or lower (-1) indices, with zeros at the end; 0 leaves them in place."""
    if by == 0:
        return values
    result = np.zeros_like(values)
    to, source = np.moveaxis(result, axis, 0), np.moveaxis(values, axis, 0)
    if by > 0:
        to[1:] = source[:-1]
    else:
        to[:-1] = source[1:]
    return result
