"""Which paths does ``bisplat simulate`` miss in the lab, and which does a search for one transmitter miss?

python benchmarks/completeness.py --json

At each transmitter position, two shares of the power of all paths are measured, in percent: that of the paths which
only the search for this transmitter found, and that of the paths which only ``bisplat simulate`` found.

The search for one transmitter is Sionna's own ``PathSolver``, from the transmitter to the true element positions. It
has four million rays, and as many candidate paths as its memory allows. Two paths are the same if they end at the same
element and have the same interactions at the same planes.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace
from typing import Annotated

import numpy as np
import tyro
from ledger.printing import print_figures

from scenes.places.lab import lab
from simulate.positions.placement import place
from simulate.rays.core.propagation import Propagation
from simulate.rays.core.reflection_chains import reflecting_planes, solve_chains
from simulate.rays.core.sionna_paths import NONE, Interactions, fields, interactions_of, refine, shoot
from simulate.rays.core.sionna_scene import transmitter_antennas
from simulate.rays.tracer import Tracer

RAYS, SEED, CANDIDATES = 4_000_000, 42, 1_500_007
"""Rays of the search, their seed, and the number of candidate paths that it has memory for."""

Contributions = dict[tuple, complex]


def named(interactions: Interactions, planes: np.ndarray, elements: np.ndarray, responses: np.ndarray) -> Contributions:
    """Sums of the responses of paths with the same key: element, interactions and planes, from the gateway on."""
    found: Contributions = defaultdict(complex)
    for types, plane, element, response in zip(interactions.types, planes, elements, responses, strict=True):
        chain = tuple((int(t), int(p)) for t, p in zip(types, plane, strict=True) if t != NONE)
        found[(int(element), chain)] += complex(response)
    return found


def main(
    positions: int = 5, smallest: bool = False, json_output: Annotated[bool, tyro.conf.arg(name="json")] = False
) -> None:
    """Compare the paths that two searches find, at positions of the lab.

    Args:
        positions: number of transmitter positions.
        smallest: only test the benchmark, in seconds; its figures mean nothing.
        json_output: print one JSON object.
    """
    scene = lab()
    usual, candidates = Propagation(max_depth=5, diffraction=False), CANDIDATES
    effort = replace(usual, rays=RAYS)
    if smallest:
        positions, candidates = 1, 20_011
        effort = usual = Propagation(max_depth=1, rays=10_000, diffraction=False)
    tracer = Tracer(scene, usual)
    ray_scene, chains, sources = tracer.ray_scene, tracer._chains, tracer.elements
    search = replace(ray_scene, propagation=effort)
    targets = transmitter_antennas(scene, place(scene, "uniform", 50, 7)[:positions])
    lacking, extra = [], []
    for index in range(positions):
        target = targets.subset(np.array([index]))
        ours: Contributions = {}
        for chain, solution in solve_chains(ray_scene, chains, sources, target):
            solved, paths = chains.subset(chain), fields(ray_scene, solution, sources, target)
            ours |= named(solved.interactions, solved.planes, paths.sources, paths.responses)
        buffer = refine(search, shoot(search, target, sources, SEED, candidates), target, sources)
        buffer.discard_invalid()
        backwards = interactions_of(buffer)
        plane = reflecting_planes(ray_scene.planes, backwards)
        # From the gateway to the transmitter, so from the last interaction to the first.
        turned = Interactions(*(part[:, ::-1] for part in (backwards.types, backwards.shapes, backwards.triangles)))
        paths = fields(search, buffer, target, sources)
        theirs = named(turned, plane[:, ::-1], paths.targets, paths.responses)
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
