"""Check whether a folder is a valid NeRF² dataset, and whether its own split leaks."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from learn.evaluation.leakage import Leakage, leakage
from scenes.description import boresight_of
from scenes.shapes import bounding_box
from simulate.dataset import Dataset, inspect


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
        corners = bounding_box(dataset.positions)
        return {
            "spectra": str(len(dataset.names)),
            "training / test": f"{len(dataset.train)} / {len(dataset.test)}",
            "positions (m)": " to ".join(str(corner.round(3).tolist()) for corner in corners),
            "gateway at (m)": str(dataset.gateway_position.round(3).tolist()),
            "gateway looks along": str(boresight_of(dataset.gateway_orientation).round(3).tolist()),
            "array": f"{dataset.array.rows} × {dataset.array.columns}, {dataset.array.spacing} wavelengths apart",
            "complex responses": "yes" if dataset.responses is not None else "no",
            "split": self.leakage.sentence() if self.leakage is not None else "none",
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
    return Check(inspection.problems, warnings, inspection.dataset, split_leakage)
