"""Pairs of places for spectra of which both ends move: drawn in the scene's region, or given by the user."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Float

from scenes.checks.occupancy import TOUCHING
from scenes.files.errors import InputError, ParameterError
from scenes.scene.description import Scene
from simulate.generation.simulation_options import MOST_TRANSMITTERS, Simulation
from simulate.positions.placement import all_the_same, free_places, free_positions, place


def chosen_pairs(
    scene: Scene, content: Simulation, offsets: Float[np.ndarray, "elements 3"]
) -> tuple[Float[np.ndarray, "K 3"], Float[np.ndarray, "K 3"], str]:
    """The places of transmitter and array that the options of a simulation ask for, and how they were chosen."""
    if content.positions is None or content.receivers is None:
        return _drawn(scene, content, offsets)
    transmitters = free_places(content.positions, scene).round(6)
    receivers = free_places(content.receivers, scene, offsets, "receivers").round(6)
    if len(receivers) != len(transmitters):
        row = f"expected a row for each of the {len(transmitters)} positions, found {len(receivers)}"
        if isinstance(content.receivers, str | Path):
            raise InputError(f"{content.receivers}: {row}")
        raise ParameterError("receivers", row)
    if all_the_same(np.hstack([transmitters, receivers])):
        raise ParameterError("positions", f"expected at least two different pairs, found {len(receivers)} alike")
    apart = np.linalg.norm(receivers[:, None] + offsets - transmitters[:, None], axis=-1).min(axis=1)
    if apart.min() < TOUCHING:
        raise ParameterError(
            "positions",
            f"expected transmitters apart from the array's elements, found one at an element in row "
            f"{int(apart.argmin())}",
        )
    count = len(np.unique(transmitters, axis=0))
    if count > MOST_TRANSMITTERS:
        raise ParameterError(
            "positions", f"expected at most {MOST_TRANSMITTERS} places of the transmitter, found {count}"
        )
    names = [Path(each).name for each in (content.positions, content.receivers) if isinstance(each, str | Path)]
    return transmitters, receivers, f"positions of {' and '.join(names)}" if len(names) == 2 else "given positions"


def _drawn(
    scene: Scene, content: Simulation, offsets: Float[np.ndarray, "elements 3"]
) -> tuple[Float[np.ndarray, "K 3"], Float[np.ndarray, "K 3"], str]:
    """Draw the array's places as those of any end that moves, and the transmitter's at random.

    Each of the transmitter's places is assigned to as many of the array's as the others, give or take one. The order is
    random: taken in turn, the places of a grid would meet the same transmitter in a whole column.
    """
    assert content.transmitters is not None
    receivers = place(scene, content.placement, content.n, content.seed, offsets)
    generator = np.random.default_rng([content.seed, 1])  # the array's places are drawn from the seed alone
    places = free_positions(scene, scene.transmitter.region, content.transmitters, generator)
    turns = generator.permutation(np.arange(len(receivers)) % content.transmitters)
    how = f"{content.placement}, {content.transmitters} transmitters, seed {content.seed}"
    return places[turns].round(6), receivers.round(6), how
