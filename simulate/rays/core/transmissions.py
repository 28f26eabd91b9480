"""Where paths pass through objects, for those who look at single paths."""

from __future__ import annotations

import numpy as np

from simulate.rays.core.electric_field import NEAR
from simulate.rays.core.propagation import MOST_PASSES
from simulate.rays.core.ray_scene import RayScene, first_hits
from simulate.rays.core.terms import STRAIGHT, Interaction, Terms


def with_transmissions(ray_scene: RayScene, terms: Terms) -> Terms:
    """Paths with a vertex wherever they pass through an object."""
    count, columns = terms.kinds.shape
    # The place of a vertex along its path is its number. That of a passage is the number of the vertex before it plus
    # the share of the way to the next vertex.
    paths, places = [np.repeat(np.arange(count), columns)], [np.tile(np.arange(1.0, columns + 1), count)]
    points, objects, kinds = [terms.vertices[:, 1:-1].reshape(-1, 3)], [terms.objects.ravel()], [terms.kinds.ravel()]
    for number in range(columns + 1):
        start, step = terms.vertices[:, number], terms.vertices[:, number + 1] - terms.vertices[:, number]
        length = np.linalg.norm(step, axis=1)
        active, travelled = np.flatnonzero(length > 2 * NEAR), np.full(count, NEAR)
        for _ in range(MOST_PASSES):
            unit = step[active] / length[active, None]
            left = length[active] - NEAR - travelled[active]
            face, share = first_hits(
                ray_scene, start[active] + travelled[active, None] * unit, left[:, None] * unit, 1.0
            )
            hit = (face >= 0) & (left > 0)
            active, unit = active[hit], unit[hit]
            travelled[active] += (left * share)[hit]
            paths.append(active)
            places.append(number + travelled[active] / length[active])
            points.append(start[active] + travelled[active, None] * unit)
            objects.append(np.full(len(active), STRAIGHT))
            kinds.append(np.full(len(active), int(Interaction.TRANSMISSION)))
            travelled[active] += NEAR
    path, kind = np.concatenate(paths), np.concatenate(kinds)
    happened = kind != Interaction.NONE
    order = np.flatnonzero(happened)[np.lexsort((np.concatenate(places)[happened], path[happened]))]
    number_of = np.bincount(path[order], minlength=count)
    column = np.arange(len(order)) - np.repeat(np.cumsum(number_of) - number_of, number_of)
    most = max(1, int(number_of.max(initial=0)))
    vertices = np.repeat(terms.vertices[:, -1:], most + 2, axis=1)
    vertices[:, 0] = terms.vertices[:, 0]
    vertices[path[order], 1 + column] = np.concatenate(points)[order]
    new_objects, new_kinds = np.full((count, most), STRAIGHT), np.full((count, most), int(Interaction.NONE))
    new_objects[path[order], column], new_kinds[path[order], column] = np.concatenate(objects)[order], kind[order]
    return terms._replace(vertices=vertices, objects=new_objects, kinds=new_kinds)
