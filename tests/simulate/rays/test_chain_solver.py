"""What one search found serves every tracer that would search for the same."""

from dataclasses import replace

import numpy as np

from simulate.rays import chain_solver
from simulate.rays.core.propagation import Propagation
from simulate.rays.tracer import Tracer
from tests.small_scene import CABINET, small_scene

POSITIONS = np.random.default_rng(0).uniform((2.0, -0.5, 1.0), (3.0, 0.5, 1.6), (5, 3))
FEW = Propagation(max_depth=1, rays=20_000)


def test_the_same_search_is_made_once_and_any_other_one_anew(monkeypatch):
    monkeypatch.setattr(chain_solver, "LATEST", 3)
    place = small_scene(CABINET)
    told: list[str] = []

    def traced(scene, propagation=FEW, region=None, seed=1):
        return Tracer(scene, propagation, region, seed, told.append)

    first = traced(place)
    searched = len(told)
    assert searched
    again = traced(small_scene(CABINET))
    assert len(told) == searched
    np.testing.assert_array_equal(again.responses(POSITIONS), first.responses(POSITIONS))
    wider = replace(place.transmitter, region_max=(3.0, 0.5, 1.7))
    others = [
        (replace(place, transmitter=wider),),
        (place, replace(FEW, rays=20_001)),
        (place, FEW, place.transmitter.region + 0.1),
        (place, FEW, None, 2),
    ]
    for number, other in enumerate(others, start=2):
        traced(*other)
        assert len(told) == number * searched
    traced(place)  # the search was too long ago
    assert len(told) == 6 * searched
