"""Check whether a folder is a valid NeRF² dataset, and whether its own split leaks."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from learn.evaluation.leakage import Leakage, leakage
from scenes.files.errors import require_path
from scenes.scene.description import boresight_of
from scenes.scene.shapes import bounding_box
from simulate.dataset.dataset_folder import Dataset, inspect
from simulate.spectra.identification import larger_array

SOURCES = {
    "metadata": "metadata.json",
    "fitted": "from the pictures",
    "assumed": "assumed",
}
"""For the user: how the array and the grid are known."""


DOUBTFUL = 3.0
"""Grey levels; an array that leaves more unexplained did not measure the pictures."""


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

    def description(self) -> dict[str, str]:
        """Describe the dataset in words.

        Returns:
            Texts by the name of the property, as ``bisplat check`` prints them; empty if there are problems.
        """
        dataset = self.dataset
        if dataset is None:
            return {}
        array, grid = dataset.array, dataset.grid
        found, residual = SOURCES[dataset.identification.source], dataset.identification.residual
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
            "array": f"{array.rows} × {array.columns}, {array.spacing:.3f} λ apart ({found})",
            "rows (elevation)": f"{grid.elevations_deg[0]:g}° to {grid.elevations_deg[-1]:g}° ({found})",
            "left unexplained": "not computed" if residual is None else f"{residual:.2f} grey levels of 255 (median)",
            "complex responses": responses,
            "split": self.leakage.facts() if self.leakage is not None else "none",
        }

    def beamformer(self) -> dict[str, Any]:
        """Array and grid of the dataset, as ``bisplat check --json`` prints them.

        Returns:
            The dictionaries "array" and "grid"; empty if there are problems. ``array["source"]`` says how both are
            known: "metadata" (metadata.json states them), "fitted" (to the pictures) or "assumed".
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
            f"from {dataset.grid.elevation_first_deg:g}°, but the pictures differ from what this array can measure by "
            f"{residual:.1f} grey levels (rounding alone: 0.3)"
        ]
    sentence = (
        f"no 4 × 4 array can have measured these pictures: the best one leaves a difference of {residual:.1f} grey "
        "levels (rounding alone: 0.3)"
    )
    larger = larger_array(dataset.pictures)
    if larger is None:
        return [f"{sentence}; models that predict element responses assume a 4 × 4 array at half a wavelength"]
    found = larger.beamformer
    stated = json.dumps({"array": asdict(found.array), "grid": asdict(found.grid)})
    return [
        f"{sentence}. An array of {found.array.rows} × {found.array.columns} elements {found.array.spacing} "
        f"wavelengths apart leaves only {larger.median_residual:.2f}: write {stated} to metadata.json"
    ]
