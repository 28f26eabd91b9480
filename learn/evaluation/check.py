"""Check whether a folder is a valid NeRF² dataset, and whether its own split leaks."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from learn.evaluation.leakage import Leakage, leakage
from scenes.scene.description import boresight_of
from scenes.scene.shapes import bounding_box
from simulate.dataset.dataset_folder import Dataset, inspect
from simulate.spectra.identification import larger_array

SOURCES = {
    "metadata": "metadata.json",
    "fitted": "from the pictures",
    "assumed": "assumed",
}
"""How the array and the grid are known, for the user."""


DOUBTFUL = 3.0
"""Grey levels; if an array leaves more unexplained, it is not the array that measured the pictures."""


@dataclass(frozen=True)
class Check:
    """Result of the check of a dataset folder.

    Attributes:
        problems: one sentence for each fault that makes the folder unusable.
        warnings: one sentence for each fault that does not, for example that the split leaks.
        dataset: the dataset; None: there are problems.
        leakage: distance and similarity between the test spectra and their nearest training spectra; None: there are
            problems, or the training or test part is empty.
    """

    problems: list[str]
    warnings: list[str]
    dataset: Dataset | None
    leakage: Leakage | None

    @property
    def valid(self) -> bool:
        """Whether there are no problems."""
        return not self.problems

    def description(self) -> dict[str, str]:
        """Properties of the dataset, by name; empty if there are problems."""
        dataset = self.dataset
        if dataset is None:
            return {}
        array, grid = dataset.array, dataset.grid
        found, residual = SOURCES[dataset.identification.source], dataset.identification.residual
        corners = bounding_box(dataset.positions)
        return {
            "spectra": str(len(dataset.names)),
            "training / test": f"{len(dataset.train)} / {len(dataset.test)}",
            "positions (m)": " to ".join(str(corner.round(3).tolist()) for corner in corners),
            "gateway at (m)": str(dataset.gateway_position.round(3).tolist()),
            "gateway looks along": str(boresight_of(dataset.gateway_orientation).round(3).tolist()),
            "array": f"{array.rows} × {array.columns}, {array.spacing:.3f} λ apart ({found})",
            "rows (elevation)": f"{grid.elevations_deg[0]:g}° to {grid.elevations_deg[-1]:g}° ({found})",
            "left unexplained": "not computed" if residual is None else f"{residual:.2f} grey levels of 255 (median)",
            "complex responses": "yes" if dataset.responses is not None else "no",
            "split": self.leakage.sentence() if self.leakage is not None else "none",
        }

    def beamformer(self) -> dict[str, Any]:
        """Array and grid of the dataset as ``bisplat check --json`` prints them; empty if there are problems.

        "array" has the entry "source", which tells how both are known: "metadata", "fitted" or "assumed".
        """
        if self.dataset is None:
            return {}
        known = self.dataset.identification
        return {
            "array": {**asdict(known.beamformer.array), "source": known.source},
            "grid": asdict(known.beamformer.grid),
            "fit_residual_grey_levels": None if known.residual is None else round(known.residual, 3),
        }


def check(folder: Path | str) -> Check:
    """Check a NeRF² dataset folder, and whether its own split leaks.

    Args:
        folder: the dataset's folder.

    Returns:
        All problems and warnings. An invalid folder raises no error.

    >>> found = check("data/lab")
    >>> found.valid, found.problems
    (True, [])
    """
    inspection = inspect(Path(folder))
    split_leakage = None if inspection.dataset is None else leakage(inspection.dataset)
    warnings = list(inspection.warnings)
    if split_leakage is not None and split_leakage.leaks:
        warnings.append(split_leakage.sentence())
    if inspection.dataset is not None:
        warnings += _of_array(inspection.dataset)
    return Check(inspection.problems, warnings, inspection.dataset, split_leakage)


def _of_array(dataset: Dataset) -> list[str]:
    """A warning if the array and the grid do not explain the pictures."""
    known = dataset.identification
    array, residual = known.beamformer.array, known.residual
    if residual is None or residual < DOUBTFUL:
        return []
    if known.source == "metadata":
        return [
            f"metadata.json states {array.rows} × {array.columns} elements {array.spacing} wavelengths apart and rows "
            f"from {dataset.grid.elevation_first_deg:g}°, which leaves {residual:.1f} grey levels of the pictures "
            "unexplained; rounding alone leaves 0.3"
        ]
    sentence = (
        f"no 4 × 4 array can have measured these pictures: it leaves {residual:.1f} grey levels unexplained, where "
        "rounding alone leaves 0.3"
    )
    larger = larger_array(dataset.pictures)
    if larger is None:
        return [f"{sentence}; models that predict element responses assume one half a wavelength apart"]
    found = larger.beamformer
    stated = json.dumps({"array": asdict(found.array), "grid": asdict(found.grid)})
    return [
        f"{sentence}. An array of {found.array.rows} × {found.array.columns} elements {found.array.spacing} "
        f"wavelengths apart leaves {larger.median_residual:.2f}: write {stated} to metadata.json"
    ]
