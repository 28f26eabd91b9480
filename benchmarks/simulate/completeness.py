"""Which paths does ``bisplat simulate`` miss in the lab, and which does a search for one transmitter miss?

python -m benchmarks.simulate.completeness --json

At each transmitter position, two shares of the power of all paths are measured, in percent: that of the paths which
only the search for this transmitter found, and that of the paths which only ``bisplat simulate`` found.

The search for one transmitter is Sionna's own ``PathSolver``, from the transmitter to the true element positions. It
has four million rays, and as many candidate paths as its memory allows. Two paths are the same if they end at the same
element and are reflected at the same planes. Sionna's search counts passages through objects as depth, ours does not.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import numpy as np
import tyro

from benchmarks.ledger.printing import print_figures
from scenes.places.built_in import lab
from simulate.positions.placement import place
from simulate.rays.core.planes import Planes
from simulate.rays.core.propagation import Propagation
from simulate.rays.core.reflection_chains import reflected
from simulate.rays.core.sionna_scene import transmitter_antennas
from simulate.rays.core.surfaces import Surfaces
from simulate.rays.sionna_solver import SPECULAR, interactions_of, path_responses, refine, shoot
from simulate.rays.tracer import Tracer

RAYS, SEED, CANDIDATES = 4_000_000, 42, 1_500_007
"""Rays of the search, their seed, and the number of candidate paths that it has memory for."""

Contributions = dict[tuple, complex]


def named(planes: np.ndarray, elements: np.ndarray, responses: np.ndarray) -> Contributions:
    """The responses of paths by element and planes, from the gateway on."""
    return {
        (int(element), *(int(each) for each in plane if each >= 0)): complex(response)
        for plane, element, response in zip(planes, elements, responses, strict=True)
    }


def reflecting_planes(planes: Planes, buffer) -> np.ndarray:
    """Plane of each specular reflection on Sionna's paths, −1 for other interactions."""
    hit = interactions_of(buffer)
    result = np.full(hit.types.shape, -1)
    specular = hit.types == SPECULAR
    result[specular] = planes.of(hit.shapes[specular], hit.triangles[specular])
    return result


def main(
    positions: int = 5, smallest: bool = False, json_output: Annotated[bool, tyro.conf.arg(name="json")] = False
) -> None:
    """Compare the paths that two searches find, at positions of the lab."""
    scene = lab()
    usual, candidates = Propagation(max_depth=5, diffraction=False), CANDIDATES
    effort = replace(usual, rays=RAYS)
    if smallest:
        positions, candidates = 1, 20_011
        effort = usual = Propagation(max_depth=1, rays=10_000, diffraction=False)
    tracer = Tracer(scene, usual)
    ray_scene, chains, sources = tracer.ray_scene, tracer.found.reflected, tracer.elements
    assert chains is not None
    search = replace(ray_scene, propagation=effort)
    targets = transmitter_antennas(scene, place(scene, "uniform", 50, 7)[:positions])
    lacking, extra = [], []
    for index in range(positions):
        target = targets.subset(np.array([index]))
        ours: Contributions = {}
        for solution in reflected(ray_scene, chains, sources, target, [Surfaces(ray_scene)]):
            chain, paths = solution.arriving()
            ours |= named(chains[chain], paths.sources, paths.responses)
        buffer = refine(search, shoot(search, target, sources, SEED, candidates), target, sources)
        buffer.discard_invalid()
        paths = path_responses(search, buffer, target, sources)
        theirs = named(reflecting_planes(ray_scene.planes, buffer)[:, ::-1], paths.targets, paths.responses)
        power = sum(abs(value) ** 2 for value in (ours | theirs).values())
        lacking.append(sum(abs(value) ** 2 for path, value in theirs.items() if path not in ours) / power)
        extra.append(sum(abs(value) ** 2 for path, value in ours.items() if path not in theirs) / power)
    result = {
        "power_only_the_search_found_percent": [round(100 * float(share), 3) for share in lacking],
        "power_only_our_chains_found_percent": [round(100 * float(share), 3) for share in extra],
        "rays_of_the_search": effort.rays,
    }
    print_figures(result, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
