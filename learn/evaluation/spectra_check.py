"""What the check of a folder of spectra says: of the array, the directions, and how much a split leaks."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Complex, Float

from learn.data.expected_score import Spacing, expectation, facts
from learn.data.split_distances import Leakage, SplitDistances, leakage
from learn.data.splits import PARTS, Split, SplitKind
from scenes.scene.orientation import boresight_of
from simulate.dataset.bearings import bearing_of
from simulate.dataset.dataset import Dataset
from simulate.positions.positions import box_in_words
from simulate.spectra.array import Array, PlanarArray
from simulate.spectra.band import Band, delay_spread
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.element_array import uniform
from simulate.spectra.identification import tells_little

# how the frequency, the array and the grid are known, for the user
SOURCES = {"metadata": "metadata.json", "fitted": "from the pictures", "freq.txt": "freq.txt", "assumed": "assumed"}

UNTOLD = "too few, or too near to one another, to tell their spacing"


@dataclass(frozen=True)
class SpectraSplit:
    """A split of spectra: the one that was asked for, or the folder's own."""

    dataset: Dataset
    kind: SplitKind | None  # the name of the split that was asked for. None: the folder's own.
    parts: Split | None  # the split that was asked for

    @cached_property
    def leakage(self) -> Leakage | None:
        """How near and how similar the test spectra are to known ones. None: no spectra are known or tested, or both
        ends move."""
        return None if self.dataset.moving == "both" else leakage(self.dataset, self.parts)

    @property
    def spacing(self) -> Spacing | None:
        """How densely the known positions lie. None: too few to tell, or both ends move."""
        if self.dataset.moving == "both":
            return None
        known = self.dataset.train if self.parts is None else self.parts.known
        return Spacing.between(self.dataset.positions[known], self.dataset.wavelength)

    @property
    def distances(self) -> SplitDistances | None:
        """Distances of the split. None: no spectra are known or tested."""
        if self.leakage is None:
            return None
        positions, parts = self.dataset.positions, self.parts
        known, test = (self.dataset.train, self.dataset.test) if parts is None else (parts.known, parts.test)
        return SplitDistances.between(positions[known], positions[test], self.dataset.wavelength)

    def warnings(self) -> list[str]:
        """A sentence if the split leaks, or leaves test spectra near known ones."""
        if self.leakage is not None and self.leakage.leaks:
            return [self.leakage.warning(self.kind)]
        near = None if self.parts is None or self.distances is None else self.distances.warning()
        return [near] if near else []

    def described(self) -> dict[str, str]:
        """The split in words."""
        name: dict[str, str] = {"split": self.kind or "the folder's own"}
        if self.dataset.moving == "both":  # how near two pairs are to one another is not one distance
            return name
        array, recorded = self.dataset.array, "response" in self.dataset.values
        return {
            **name,
            "known positions": UNTOLD if (spacing := self.spacing) is None else expectation(spacing, array, recorded),
            "copying the nearest": self.leakage.similarity() if self.leakage is not None else "none",
            "test positions": "none" if self.distances is None else self.distances.sentence(),
        }

    def figures(self) -> dict[str, Any]:
        """The split in numbers."""
        parts: Dataset | Split = self.parts or self.dataset
        sizes = {part: len(getattr(parts, part)) for part in PARTS if hasattr(parts, part)}
        distances = self.distances.facts() if self.distances else {}
        recorded = "response" in self.dataset.values
        spacing = facts(self.spacing, self.dataset.array, recorded) if self.spacing else {}
        return {"kind": self.kind or "files", **sizes, **distances, **spacing}


def describe_spectra(dataset: Dataset) -> dict[str, str]:
    """What ``bisplat check`` prints of spectra alone, but for their split."""
    array, grid, bearing = dataset.array, dataset.grid, bearing_of(dataset).error
    known, residual = dataset.identification, dataset.identification.residual
    # The pictures of an array show the azimuth of column 0 only up to turns by which the array looks the same.
    azimuths = "metadata" if known.grid_source == "metadata" else "assumed"
    responses = "yes" if "response" in dataset.values else "no"
    if "retrieved" in dataset.values:
        recorded = dataset.phases_recorded_per_position
        responses = f"{'yes' if recorded else 'found behind the pictures'}, each with a phase of its own"
    return {
        "spectra": str(len(dataset)),
        "array": _in_words(array, SOURCES[known.source]),
        "rows (elevation)": _angles(grid.elevations_deg, SOURCES[known.grid_source]),
        "columns (azimuth)": _angles(grid.azimuths_deg, SOURCES[azimuths]),
        "strongest directions": (
            f"{bearing:.0f}° from those of the transmitters (median)" if np.isfinite(bearing) else "none"
        ),
        "order": "by number, taken for the order of measurement",
        "left unexplained": _left(known.beamformer, residual),
        "complex responses": responses,
        **({} if dataset.band is None else {"band": _band(dataset.band, dataset.band_responses)}),
    }


def figures_of_spectra(dataset: Dataset) -> dict[str, Any]:
    """What ``bisplat check --json`` prints of spectra alone, but for their split. ``source``: how each is known."""
    known = dataset.identification
    return {
        "spectra": len(dataset),
        "frequency": asdict(dataset.frequency),
        "array": {**known.beamformer.array.stated(), "source": known.source},
        "grid": {**asdict(known.beamformer.grid), "source": known.grid_source},
        "fit_residual_grey_levels": None if known.residual is None else round(known.residual, 3),
    }


def ends_of_spectra(dataset: Dataset) -> dict[str, str]:
    """Which end moves, and where the ends are."""
    box = box_in_words(dataset.positions)
    stands = str(dataset.gateway_position.round(3).tolist())
    boresight = str(boresight_of(dataset.gateway_orientation).round(3).tolist())
    if dataset.moving == "both":
        places = len(np.unique(dataset.positions, axis=0))
        return {
            "moving": f"both ends: the transmitter, among {places} places, and the receiver, with its array",
            "transmitters (m)": box,
            "receivers (m)": box_in_words(dataset.receivers),
            "array looks along": boresight,
        }
    if dataset.moving == "receiver":
        told, fixed, turned = {"moving": "the receiver, with its array"}, "transmitter", "array"
    else:
        told, fixed, turned = {}, "gateway", "gateway"
        made_here = str(dataset.metadata.get("made_by", "")).startswith("bisplat-wrf")
        if "moving" not in dataset.metadata and not made_here:
            told = {"moving": "the transmitter (assumed; if it was the array: bisplat dataset --moving receiver)"}
    return {**told, "positions (m)": box, f"{fixed} at (m)": stands, f"{turned} looks along": boresight}


def _band(band: Band, responses: Complex[np.ndarray, "K elements subcarriers"]) -> str:
    """The subcarriers, and the delay spread of the responses."""
    spread = 1e9 * np.median(delay_spread(responses, band.bandwidth))
    return (
        f"{band.subcarriers} subcarriers over {band.bandwidth / 1e6:g} MHz around the carrier; delay spread "
        f"{spread:.0f} ns (median; delays are told apart from {1e9 / band.bandwidth:.0f} ns on)"
    )


def _left(beamformer: Beamformer, residual: float | None) -> str:
    if residual is None:
        return "not computed"
    other = tells_little(beamformer) if uniform(beamformer.array) is None else False
    little = "; other arrays of this size explain the pictures as well, since it has more lags than they have details"
    return f"{residual:.2f} grey levels of 255 (median){little if other else ''}"


def _in_words(array: Array, source: str) -> str:
    text = array.in_words
    if isinstance(array, PlanarArray):
        text = f"{array.rows} × {array.columns}, {array.spacing:.3f} λ apart"
    cannot = "" if array.cannot_tell is None else f"; {array.cannot_tell}"
    return f"{text} ({source}){cannot}"


def _angles(degrees: Float[np.ndarray, " n"], source: str) -> str:
    return f"{degrees[0]:g}° to {degrees[-1]:g}° ({source})"
