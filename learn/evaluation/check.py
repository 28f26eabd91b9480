"""Check whether a folder is a valid NeRF² dataset, and whether a split of it leaks."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Complex, Float
from simulate.csi.csi_check import CsiCheck, check_csi
from simulate.rssi.rssi_check import RssiCheck, check_rssi

from learn.data.expected_score import Spacing, expectation, facts
from learn.data.split_distances import Leakage, SplitDistances, leakage
from learn.data.splits import GUARD_MOST, PARTS, SPLITS, Split, SplitKind
from learn.data.splits import split as split_of
from learn.evaluation.picture_checks import picture_doubts
from scenes.files.errors import InputError, ParameterError, require_path, require_seed, require_within, require_word
from scenes.scene.orientation import boresight_of
from scenes.scene.shapes import bounding_box
from simulate.dataset.bearings import bearing_of
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import inspect
from simulate.dataset.dataset_frequency import named, several_frequencies
from simulate.dataset.dataset_kinds import is_rooms, quantity_of, require_spectra
from simulate.spectra.array import Array, PlanarArray
from simulate.spectra.band import Band, delay_spread
from simulate.spectra.beamformer import Beamformer
from simulate.spectra.element_array import uniform
from simulate.spectra.identification import tells_little

# how the frequency, the array and the grid are known, for the user
SOURCES = {"metadata": "metadata.json", "fitted": "from the pictures", "freq.txt": "freq.txt", "assumed": "assumed"}

UNTOLD = "too few, or too near to one another, to tell their spacing"


@dataclass(frozen=True)
class Check:
    """Result of the check of a dataset folder.

    Attributes:
        problems: one sentence for each fault that makes the folder unusable.
        warnings: one sentence for each other fault, for example that the split leaks.
        dataset: the dataset. None: there are problems.
        leakage: how near and how similar the test spectra are to known ones. None: there are problems, no spectra are
            known or tested, or both ends move.
        split: the name of the split that was asked for. None: the folder's own.
        parts: the split that was asked for. None: there are problems, or it is the folder's own.

    Example:
        >>> import bisplat
        >>> found = bisplat.check("data/lab")
        >>> found.description()["complex responses"], found.beamformer()["array"]["source"]
        ('yes', 'metadata')
    """

    problems: list[str]
    warnings: list[str]
    dataset: Dataset | None
    leakage: Leakage | None
    split: SplitKind | None = None
    parts: Split | None = None

    @property
    def valid(self) -> bool:
        """Whether there are no problems."""
        return not self.problems

    @property
    def spacing(self) -> Spacing | None:
        """How densely the known positions lie. None: there are problems, too few to tell, or both ends move."""
        if self.dataset is None or self.dataset.moving == "both":
            return None
        known = self.dataset.train if self.parts is None else self.parts.known
        return Spacing.between(self.dataset.positions[known], self.dataset.wavelength)

    @property
    def distances(self) -> SplitDistances | None:
        """Distances of the split. None: there are problems, or no spectra are known or tested."""
        if self.dataset is None or self.leakage is None:
            return None
        positions, parts = self.dataset.positions, self.parts
        known, test = (self.dataset.train, self.dataset.test) if parts is None else (parts.known, parts.test)
        return SplitDistances.between(positions[known], positions[test], self.dataset.wavelength)

    def description(self) -> dict[str, str]:
        """Describe the dataset in words.

        Returns:
            Texts by the name of the property, as ``bisplat check`` prints them; empty if there are problems.
        """
        dataset = self.dataset
        if dataset is None:
            return {}
        array, grid, bearing = dataset.array, dataset.grid, bearing_of(dataset).error
        known, residual = dataset.identification, dataset.identification.residual
        # The pictures of an array show the azimuth of column 0 only up to turns by which the array looks the same.
        azimuths = "metadata" if known.grid_source == "metadata" else "assumed"
        responses = "no" if dataset.responses is None else "yes"
        if dataset.retrieved is not None:
            recorded = dataset.phases_recorded_per_position
            responses = f"{'yes' if recorded else 'found behind the pictures'}, each with a phase of its own"
        return {
            "spectra": str(len(dataset.names)),
            "fingerprint": dataset.fingerprint,
            **self._sizes(dataset),
            **_ends(dataset),
            "frequency": f"{dataset.frequency} ({SOURCES[dataset.frequency.source]})",
            "array": _in_words(array, SOURCES[known.source]),
            "rows (elevation)": _angles(grid.elevations_deg, SOURCES[known.grid_source]),
            "columns (azimuth)": _angles(grid.azimuths_deg, SOURCES[azimuths]),
            "strongest directions": (
                f"{bearing:.0f}° from those of the transmitters (median)" if np.isfinite(bearing) else "none"
            ),
            "order": "by number, taken for the order of measurement",
            "left unexplained": _left(known.beamformer, residual),
            "complex responses": responses,
            **({} if dataset.band_responses is None else {"band": _band(dataset.band, dataset.band_responses)}),
            "split": self.split or "the folder's own",
            **self._of_split(dataset),
        }

    def _of_split(self, dataset: Dataset) -> dict[str, str]:
        if dataset.moving == "both":  # how near two pairs are to one another is not one distance
            return {}
        array, recorded = dataset.array, dataset.responses is not None
        return {
            "known positions": UNTOLD if (spacing := self.spacing) is None else expectation(spacing, array, recorded),
            "copying the nearest": self.leakage.similarity() if self.leakage is not None else "none",
            "test positions": "none" if self.distances is None else self.distances.sentence(),
        }

    def _sizes(self, dataset: Dataset) -> dict[str, str]:
        if self.parts is None:
            return {"training / test": f"{len(dataset.train)} / {len(dataset.test)}"}
        sizes = (self.parts.train, self.parts.validation, self.parts.test)
        return {"training / validation / test": " / ".join(str(len(part)) for part in sizes)}

    def split_figures(self) -> dict[str, Any]:
        """Sizes and distances of the split, as ``bisplat check --json`` prints them.

        Returns:
            The numbers of spectra "train", "validation" and "test" (the folder's own split has no "validation"), and
            those of ``SplitDistances.facts`` and of the known positions' spacing; empty if there are problems.
        """
        if self.dataset is None:
            return {}
        parts: Dataset | Split = self.parts or self.dataset
        sizes = {part: len(getattr(parts, part)) for part in PARTS if hasattr(parts, part)}
        distances = self.distances.facts() if self.distances else {}
        recorded = self.dataset.responses is not None
        spacing = facts(self.spacing, self.dataset.array, recorded) if self.spacing else {}
        return {"kind": self.split or "files", **sizes, **distances, **spacing}

    def beamformer(self) -> dict[str, Any]:
        """Frequency, array and grid of the dataset, as ``bisplat check --json`` prints them.

        Returns:
            The dictionaries "frequency", "array" and "grid"; empty if there are problems. The key "source" of each says
            how it is known: "metadata" (metadata.json states it), "freq.txt", "fitted" (to the pictures) or "assumed".
        """
        if self.dataset is None:
            return {}
        known = self.dataset.identification
        return {
            "frequency": asdict(self.dataset.frequency),
            "array": {**known.beamformer.array.stated(), "source": known.source},
            "grid": {**asdict(known.beamformer.grid), "source": known.grid_source},
            "fit_residual_grey_levels": None if known.residual is None else round(known.residual, 3),
        }


def check(
    folder: Path | str, split: SplitKind | None = None, guard: float = 0.0, seed: int = 0
) -> Check | RssiCheck | CsiCheck:
    """Check a NeRF² dataset folder, and whether its own split, or another one, leaks.

    An invalid folder raises no error; the result lists its faults. Folders of received powers (RSSI) and of channels
    (CSI) are checked, too.

    Args:
        folder: the dataset's folder.
        split: the split, as ``train`` would make it. None: the folder's own, without a validation part.
        guard: known positions nearer than this to a test position are left out of ``split``, wavelengths.
        seed: seed of ``split``.

    Returns:
        All problems and warnings, and a description of the dataset; an ``RssiCheck`` of received powers, a
        ``CsiCheck`` of channels.

    Raises:
        InputError: the dataset has too few spectra for ``split`` and ``guard``, or has received powers or channels
            instead.
        ParameterError: no split has this name; the guard or the seed is out of its range; or one is given without a
            split.

    Example:
        >>> found = check("data/lab")
        >>> found.valid, found.problems
        (True, [])
        >>> check("data/nothing").valid
        False
        >>> check("data/lab", "blocked").split_figures()["test"]
        10
    """
    require_path(folder=folder)
    require_seed(seed=seed)
    require_within(0, GUARD_MOST, "wavelengths", guard=guard)
    if split is not None:
        require_word(SPLITS, split=split)
    for name, value in (("guard", guard), ("seed", seed)):
        if value and split is None:
            raise ParameterError(name, f"expected a split beside it, found {value:g}")
    if other := not_spectra(Path(folder)):
        if split is not None:
            raise InputError(other)
        if is_rooms(Path(folder)):
            return Check([other], [], None, None)
        return check_rssi(Path(folder)) if is_rssi(Path(folder)) else check_csi(Path(folder))
    several = several_frequencies(Path(folder))
    inspection = inspect(Path(folder), several[0] if several else None)
    dataset = inspection.dataset
    parts = None if dataset is None or split is None else split_of(dataset, split, seed, guard=guard)
    found = Check(
        inspection.problems,
        list(inspection.warnings),
        dataset,
        None if dataset is None or dataset.moving == "both" else leakage(dataset, parts),
        split,
        parts,
    )
    if several and dataset is not None:
        found.warnings.append(
            f"the pictures have several frequencies, {named(np.array(several))}; the description is of the first. To "
            f'learn from one of them, make it a dataset: bisplat convert {folder} -o FOLDER --frequency "'
            f'{dataset.frequency}"'
        )
    if found.leakage is not None and found.leakage.leaks:
        found.warnings.append(found.leakage.warning(split))
    elif parts is not None and found.distances is not None and (near := found.distances.warning()):
        found.warnings.append(near)
    if dataset is not None:
        found.warnings.extend([*picture_doubts(dataset), *dataset.assumptions()])
    return found


def _ends(dataset: Dataset) -> dict[str, str]:
    """Which end moves, and where the ends are."""
    box = " to ".join(str(corner.round(3).tolist()) for corner in bounding_box(dataset.positions))
    stands = str(dataset.gateway_position.round(3).tolist())
    boresight = str(boresight_of(dataset.gateway_orientation).round(3).tolist())
    if dataset.moving == "both":
        places = len(np.unique(dataset.positions, axis=0))
        of_arrays = " to ".join(str(corner.round(3).tolist()) for corner in bounding_box(dataset.receivers))
        return {
            "moving": f"both ends: the transmitter, among {places} places, and the receiver, with its array",
            "transmitters (m)": box,
            "receivers (m)": of_arrays,
            "array looks along": boresight,
        }
    if dataset.moving == "receiver":
        told, fixed, turned = {"moving": "the receiver, with its array"}, "transmitter", "array"
    else:
        told, fixed, turned = {}, "gateway", "gateway"
        made_here = str(dataset.metadata.get("made_by", "")).startswith("bisplat-wrf")
        if "moving" not in dataset.metadata and not made_here:
            told = {"moving": "the transmitter (assumed; if it was the array: bisplat convert --moving receiver)"}
    return {**told, "positions (m)": box, f"{fixed} at (m)": stands, f"{turned} looks along": boresight}


def _band(band: Band | None, responses: Complex[np.ndarray, "K elements subcarriers"]) -> str:
    """The subcarriers, and the delay spread of the responses."""
    assert band is not None
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
