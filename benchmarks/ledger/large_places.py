"""Large scenes of any size, as files for an import: a street of houses, and the scan of a room."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh


def write_street(folder: Path, houses: int) -> Path:
    """Write a scene XML as Blender does: a ground, and rows of L-shaped houses with brick walls and metal roofs."""
    generator, side = np.random.default_rng(0), int(np.ceil(np.sqrt(houses)))
    (folder / "meshes").mkdir(parents=True)
    shapes, corner = [], np.arange(6)
    walls = np.concatenate(
        [np.column_stack([corner, (corner + 1) % 6, ends]) for ends in (6 + (corner + 1) % 6, 6 + corner)]
    )
    walls[6:, 1] += 6
    for number in range(houses):
        place = (number % side - side // 2 + 0.5) * 35, (number // side - side // 2 + 0.5) * 30
        width, depth, height = generator.uniform((12, 10, 6), (24, 18, 30))
        angle = generator.uniform(-0.1, 0.1)
        plan = np.array([[-1, -1], [1, -1], [1, 1], [0, 1], [0, 0.3], [-1, 0.3]]) * (width / 2, depth / 2)
        turned = plan @ [[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]] + place
        corners = np.concatenate([np.pad(turned, ((0, 0), (0, 1)), constant_values=z) for z in (0, height)])
        shapes.append((f"house_{number}-walls", corners, walls, "brick"))
        shapes.append((f"house_{number}-roof", corners, [[6, 7, 10], [7, 8, 10], [8, 9, 10], [6, 10, 11]], "metal"))
    edge = 20 * side
    ground = [[-edge, -edge, 0], [edge, -edge, 0], [edge, edge, 0], [-edge, edge, 0]]
    shapes.append(("ground", np.array(ground), [[0, 1, 2], [0, 2, 3]], "concrete"))
    lines = ['<scene version="2.1.0">']
    lines += [f'<bsdf type="diffuse" id="mat-itu_{name}"/>' for name in ("brick", "metal", "concrete")]
    for name, corners, faces, material in shapes:
        trimesh.Trimesh(corners, faces, process=False).export(folder / "meshes" / f"{name}.ply")
        file = f'<string name="filename" value="meshes/{name}.ply"/>'
        lines.append(f'<shape type="ply" id="{name}">{file}<ref id="mat-itu_{material}" name="bsdf"/></shape>')
    path = folder / "street.xml"
    path.write_text("\n".join([*lines, "</scene>"]))
    return path


def write_scan(path: Path, triangles: int) -> Path:
    """Write a room of 6 × 4 × 2.7 m with three boxes as a scanner sees it: one body, noise, holes."""
    generator, edge, sheets = np.random.default_rng(0), np.sqrt(240 / triangles), []
    boxes = [((0, 0, 0), (6, 4, 2.7)), ((0.5, 2.9, 0), (2, 3.5, 0.75))]
    boxes += [((4.8, 0.2, 0), (5.6, 0.7, 1.9)), ((2.5, 0.3, 0), (4.2, 1.1, 0.8))]
    for number, (low, high) in enumerate(boxes):
        for axis in range(3):
            across = [(axis + 1) % 3, (axis + 2) % 3]
            counts = np.maximum(1, np.round((np.array(high) - low)[across] / edge)).astype(int)
            a, b = np.meshgrid(*(np.linspace(0, 1, count + 1) for count in counts), indexing="ij")
            first = (np.arange(counts[0])[:, None] * (counts[1] + 1) + np.arange(counts[1])).ravel()
            second, third, last = first + counts[1] + 1, first + counts[1] + 2, first + 1
            faces = np.concatenate([np.c_[first, second, third], np.c_[first, third, last]])
            for end in (0, 1):
                unit = np.empty((a.size, 3))
                unit[:, axis], unit[:, across] = end, np.column_stack([a.ravel(), b.ravel()])
                outwards = (end == 1) != (number == 0)  # the first box is the room, seen from inside
                sheets.append(trimesh.Trimesh(low + unit * np.subtract(high, low), faces[:, :: 1 if outwards else -1]))
    mesh = trimesh.util.concatenate(sheets)
    mesh.merge_vertices()
    middles = mesh.triangles_center
    for hole in generator.choice(middles, 60, replace=False):
        mesh.update_faces(np.linalg.norm(mesh.triangles_center - hole, axis=1) > generator.uniform(0.03, 0.2))
    mesh.remove_unreferenced_vertices()
    mesh.vertices = mesh.vertices + generator.normal(0, 0.006, mesh.vertices.shape)
    mesh.export(path)
    return path
