"""What is found in a dataset folder of any kind: problems, warnings, and the dataset."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar

from scenes.files.errors import InputError

Kind = TypeVar("Kind")
"""The class of the dataset."""


@dataclass(frozen=True)
class Inspection(Generic[Kind]):
    """Result of the inspection of a folder."""

    problems: list[str]  # a sentence for each error that makes the folder unusable
    warnings: list[str]  # a sentence for each oddity that does not
    dataset: Kind | None  # the dataset; None if there are problems

    @property
    def valid(self) -> bool:
        """Whether there are no problems."""
        return not self.problems

    def usable(self) -> Kind:
        """The dataset."""
        if self.dataset is None:
            more = f" ({len(self.problems) - 1} more problems)" if len(self.problems) > 1 else ""
            raise InputError(self.problems[0] + more)
        return self.dataset
