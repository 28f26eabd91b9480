"""What correlation of rays with full wave to expect in a scene, from the rays' own paths.

Rays are right about a wave that nothing disturbs, less right about a reflected one, and least about a diffracted one.
If the paths of kind k alone make a field with the share s_k of the whole field's power, and the rays' error has the
share w_k of that, then the correlation c of rays and full wave is about 1 − c² = w_0 + Σ w_k s_k. The weights w are
fitted to random furnished rooms that were solved in full wave: ``benchmarks/simulate/random_rooms.py`` writes
expected_correlation.json.
"""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jaxtyping import Float

from simulate.positions.placement import free_positions
from simulate.rays.core.propagation import Propagation

if TYPE_CHECKING:
    from scenes.scene.description import Scene
    from simulate.rays.tracer import Tracer

FILE = Path(__file__).with_suffix(".json")

POSITIONS = 100  # Positions at which the paths are followed

BELIEVED = 0.95  # Expected correlation below which full wave is recommended


class PowerShares(NamedTuple):
    """Power of the field that the paths of one kind make, over the power of the whole field."""

    reflected: float  # of paths with reflections only
    at_sheets: float  # of paths diffracted at edges of dielectric sheets only
    at_conductors: float  # of paths diffracted at an edge of a conductor


class Expected(NamedTuple):
    """Correlation of rays and full wave to expect: the whole field of one element, 0 to 1."""

    low: float  # nine of ten rooms are better
    middle: float  # half of the rooms are
    high: float  # one of ten is


class Weights(NamedTuple):
    """The content of expected_correlation.json."""

    constant: float  # w_0
    of_shares: tuple[float, float, float]  # w_k for each of ``PowerShares``
    # the tenth, fiftieth and ninetieth percentile of 1 − c² over its fit, among the rooms of the fit
    factors: tuple[float, float, float]

    def expected(self, shares: PowerShares) -> Expected:
        """The correlation to expect where the power has some shares."""
        error = self.constant + float(np.dot(self.of_shares, shares))
        high, middle, low = (float(np.sqrt(max(0.0, 1 - factor * error))) for factor in self.factors)
        return Expected(low, middle, high)


@cache
def weights() -> Weights:
    """The weights that were fitted."""
    found = json.loads(FILE.read_text())
    return Weights(found["constant"], tuple(found["of_shares"]), tuple(found["factors"]))


def power_shares(tracer: Tracer, positions: Float[np.ndarray, "K 3"]) -> PowerShares:
    """The power that each kind of path carries to the array's middle element."""
    responses = tracer.middle_by_chain(positions)
    reflected, diffracted, _ = tracer.found
    assert reflected is not None
    at_sheets = np.zeros(0, np.bool_)
    if diffracted is not None and tracer.edges is not None:
        at_sheets = tracer.edges.sheets[diffracted.edges].all(axis=1)
    geometric, edges = np.split(responses, [len(reflected)], axis=1)
    fields = geometric[:, (reflected >= 0).any(axis=1)], edges[:, at_sheets], edges[:, ~at_sheets]
    power = [float((np.abs(each.sum(axis=1)) ** 2).sum()) for each in (*fields, responses)]
    with np.errstate(divide="ignore", invalid="ignore"):
        return PowerShares(*(np.array(power[:-1]) / power[-1]).tolist())


def expected_correlation(tracer: Tracer, scene: Scene, region: Float[np.ndarray, "2 3"]) -> Expected | None:
    """The correlation to expect in a region; None if the mechanisms are not the default ones or no power arrives."""
    used, default = tracer.ray_scene.propagation, Propagation()
    if replace(used, rays=default.rays, patches=default.patches) != default:
        return None
    shares = power_shares(tracer, free_positions(scene, region, POSITIONS, np.random.default_rng(0)))
    return weights().expected(shares) if np.isfinite(shares).all() else None


def sentence(expected: Expected, transmitters: int = 1) -> str:
    """What to expect, in words, and what to do if that is too little; of several transmitters, of the worst one."""
    low, middle, high = expected
    told = f"rays and full wave are expected to correlate at {middle:.2f} ({low:.2f} to {high:.2f})"
    use = "--engine fullwave"
    if transmitters > 1:
        told = f"{told} for the worst of {transmitters} transmitters"
        use = f"{use} --moving receiver for one transmitter at a time"
    return told if middle >= BELIEVED else f"{told}; for spectra that must be right, use {use}"


def expectation(scene: Scene) -> str:
    """What to expect of rays with the default mechanisms in a scene of one gateway, in words."""
    from simulate.rays.tracer import Tracer

    expected = expected_correlation(Tracer(scene, Propagation()), scene, scene.transmitter.region)
    return "no power arrives by rays" if expected is None else sentence(expected)
