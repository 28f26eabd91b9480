"""Check whether a folder is a valid NeRF² dataset, and whether its own split leaks."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from learn.data.split_distances import SplitDistances
from learn.evaluation.leakage import Leakage, leakage
from learn.evaluation.picture_doubts import picture_doubts
from scenes.files.errors import require_path
from scenes.scene.description import boresight_of
from scenes.scene.shapes import bounding_box
from simulate.dataset.bearings import bearing_of
from simulate.dataset.dataset_folder import Dataset, inspect

SOURCES = {
    "metadata": "metadata.json",
    "fitted": "from the pictures",
    "freq.txt": "freq.txt",
    "assumed": "assumed",
}
"""For the user: how the frequency, the array and the grid are known."""


@dataclass(frozen=True)
class Check:
    """Result of the check of a dataset folder.

    Attributes:
        problems: one sentence for each fault that makes the folder unusable.
        warnings: one sentence for each other fault, for example that the split leaks.
        dataset: the dataset. None: there are problems.
        leakage: how near and how similar the test spectra are to training spectra. None: there are problems, or the
            training or the test part is empty.

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

    @property
    def valid(self) -> bool:
        """Whether there are no problems."""
        return not self.problems

    @property
    def distances(self) -> SplitDistances | None:
        """Distances of the folder's own split. None: there are problems, or it has no training or no test part."""
        dataset = self.dataset
        if dataset is None or not (len(dataset.train) and len(dataset.test)):
            return None
        positions = dataset.positions
        return SplitDistances.between(positions[dataset.train], positions[dataset.test], dataset.wavelength)

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
        corners = bounding_box(dataset.positions)
        responses = "no" if dataset.retrieved is None else "found behind the pictures, each with a phase of its own"
        if dataset.responses is not None:
            responses = "yes"
        return {
            "spectra": str(len(dataset.names)),
            "training / test": f"{len(dataset.train)} / {len(dataset.test)}",
            "positions (m)": " to ".join(str(corner.round(3).tolist()) for corner in corners),
            "gateway at (m)": str(dataset.gateway_position.round(3).tolist()),
            "gateway looks along": str(boresight_of(dataset.gateway_orientation).round(3).tolist()),
            "frequency": f"{dataset.frequency} ({SOURCES[dataset.frequency.source]})",
            "array": f"{array.rows} × {array.columns}, {array.spacing:.3f} λ apart ({SOURCES[known.source]})",
            "rows (elevation)": _angles(grid.elevations_deg, SOURCES[known.grid_source]),
            "columns (azimuth)": _angles(grid.azimuths_deg, SOURCES[azimuths]),
            "strongest directions": (
                f"{bearing:.0f}° from those of the transmitters (median)" if np.isfinite(bearing) else "none"
            ),
            "order": "by number, taken for the order of measurement",
            "left unexplained": "not computed" if residual is None else f"{residual:.2f} grey levels of 255 (median)",
            "complex responses": responses,
            "split": self.leakage.facts() if self.leakage is not None else "none",
            "test positions": "none" if self.distances is None else self.distances.sentence(),
        }

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
            "array": {**asdict(known.beamformer.array), "source": known.source},
            "grid": {**asdict(known.beamformer.grid), "source": known.grid_source},
            "fit_residual_grey_levels": None if known.residual is None else round(known.residual, 3),
        }


def check(folder: Path | str) -> Check:
    """Check a NeRF² dataset folder, and whether its own split leaks.

    An invalid folder raises no error; the result lists its faults.

    Args:
        folder: the dataset's folder.

    Returns:
        All problems and warnings, and a description of the dataset.

    Example:
        >>> found = check("data/lab")
        >>> found.valid, found.problems
        (True, [])
        >>> check("data/nothing").valid
        False
    """
    require_path(folder=folder)
    inspection = inspect(Path(folder))
    split_leakage = None if inspection.dataset is None else leakage(inspection.dataset)
    warnings = list(inspection.warnings)
    if split_leakage is not None and split_leakage.leaks:
        warnings.append(split_leakage.warning())
    if inspection.dataset is not None:
        warnings += picture_doubts(inspection.dataset)
        warnings += inspection.dataset.assumptions()
    return Check(inspection.problems, warnings, inspection.dataset, split_leakage)


def _angles(degrees: Float[np.ndarray, " n"], source: str) -> str:
    return f"{degrees[0]:g}° to {degrees[-1]:g}° ({source})"
