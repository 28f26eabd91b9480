"""Signs of folders from other programs that look like a dataset of this format but are not."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int, UInt8

from simulate.spectra.identification import Identification
from simulate.spectra.spectrum import evenly

EXAMINED = 200
"""Number of pictures that are examined."""


ALIKE = 0.5
"""Pictures of one position are alike if they differ less than this, relative to those of different positions."""


@dataclass
class Oddities:
    """What is odd about a folder whose files can all be read."""

    problems: list[str] = field(default_factory=list)  # a sentence for each error that makes the folder unusable
    warnings: list[str] = field(default_factory=list)  # a sentence for each oddity that does not


def oddities(
    positions: Float[np.ndarray, "K coordinates"],
    pictures: UInt8[np.ndarray, "K 90 360"],
    identification: Identification,
    folder: Path,
) -> Oddities:
    """Look for positions that several different pictures share, and for upside-down pictures."""
    found = Oddities()
    _look_for_shared_positions(positions, pictures, folder / "tx_pos.csv", found)
    _look_for_upside_down_pictures(pictures, identification, folder / "spectrum", found)
    return found


def _look_for_shared_positions(
    positions: Float[np.ndarray, "K coordinates"], pictures: UInt8[np.ndarray, "K 90 360"], path: Path, found: Oddities
) -> None:
    """Look for positions with several pictures. If these differ, a model cannot learn which of them to predict."""
    count = len(positions)
    places, place_of, pictures_there = np.unique(positions, axis=0, return_inverse=True, return_counts=True)
    sharing = int(pictures_there[pictures_there > 1].sum())
    if count > 1 and len(places) == 1:
        found.problems.append(f"{path}: expected positions that differ, found {places[0].tolist()} for all {count}")
    elif sharing > count / 2 and _differ_at_a_place(place_of.ravel(), pictures):
        found.problems.append(
            f"{path}: expected one picture for each position, found {count} pictures of {len(places)} positions; does "
            "the folder mix frequencies or gateways? bisplat convert --one-per-position 1 keeps the first of each"
        )
    elif sharing:
        found.warnings.append(f"{sharing} of {count} pictures share their position with another picture")


def _differ_at_a_place(place_of: Int[np.ndarray, " K"], pictures: UInt8[np.ndarray, "K 90 360"]) -> bool:
    """Whether pictures of one position differ nearly as much as those of others; repeated measurements do not."""
    order = np.argsort(place_of, kind="stable")
    same = np.diff(place_of[order]) == 0
    both = pictures[order[:-1]], pictures[order[1:]]
    within, between = (evenly(np.flatnonzero(pairs), EXAMINED) for pairs in (same, ~same))
    unlike = [np.abs(both[0][pairs].astype(int) - both[1][pairs]).mean() for pairs in (within, between)]
    return bool(unlike[0] > ALIKE * unlike[1])


def _look_for_upside_down_pictures(
    pictures: UInt8[np.ndarray, "K 90 360"], identification: Identification, path: Path, found: Oddities
) -> None:
    grid = identification.beamformer.grid
    spread = pictures[:EXAMINED].std(axis=2).mean(axis=0)  # of each row, along azimuth
    if grid.elevation_step_deg < 0:
        found.problems.append(
            f"{path}: expected row 0 at the horizon, found upside-down pictures with elevation "
            f"{grid.elevation_first_deg:.0f}° in row 0 (an array explains them in this way to "
            f"{identification.residual:.2f} grey levels); bisplat convert turns them over"
        )
    elif identification.source == "assumed" and spread[0] < 0.25 * spread.mean() < spread[-1]:
        found.warnings.append(
            "row 0 is nearly the same at all azimuths, as only the row near the boresight should be: are the pictures "
            "upside down? bisplat convert --flip-elevation True turns them over"
        )
