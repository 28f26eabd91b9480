"""Check whether a folder is a valid dataset, and whether a split of it leaks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from learn.data.splits import GUARD_MOST, SPLITS, SplitKind
from learn.data.splits import split as split_of
from learn.evaluation.picture_checks import picture_doubts
from learn.evaluation.spectra_check import (
    SOURCES,
    SpectraSplit,
    describe_spectra,
    ends_of_spectra,
    figures_of_spectra,
)
from scenes.files.errors import ParameterError, require_path, require_seed, require_within, require_word
from simulate.dataset.channels_folder import describe_channels, figures_of_channels, oddities_of_channels
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import assumptions_of, inspect
from simulate.dataset.dataset_frequency import named, several_frequencies
from simulate.dataset.dataset_kinds import require_spectra
from simulate.dataset.powers_folder import describe_powers, figures_of_powers, oddities_of_powers
from simulate.positions.positions import box_in_words


class Said(NamedTuple):
    """What the check says of one quantity alone."""

    description: Callable[[Dataset], dict[str, str]]
    figures: Callable[[Dataset], dict[str, Any]]
    oddities: Callable[[Dataset], list[str]]  # a sentence for each


SAID = {
    "spectrum": Said(describe_spectra, figures_of_spectra, picture_doubts),
    "power": Said(describe_powers, figures_of_powers, oddities_of_powers),
    "channel": Said(describe_channels, figures_of_channels, oddities_of_channels),
}


@dataclass(frozen=True)
class Check:
    """Result of the check of a dataset folder.

    Attributes:
        problems: one sentence for each fault that makes the folder unusable.
        warnings: one sentence for each other fault, for example that the split leaks.
        dataset: the dataset. None: there are problems.
        split: the split of spectra, and how it leaks. None: there are problems, or they are no spectra.

    Example:
        >>> import bisplat
        >>> found = bisplat.check("data/lab")
        >>> found.description()["complex responses"], found.figures()["array"]["source"]
        ('yes', 'metadata')
    """

    problems: list[str]
    warnings: list[str]
    dataset: Dataset | None
    split: SpectraSplit | None = None

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
        heading, *alone = SAID[dataset.quantities[0]].description(dataset).items()
        sizes = {"training / test": f"{len(dataset.train)} / {len(dataset.test)}"}
        frequency = f"{dataset.frequency} ({SOURCES[dataset.frequency.source]})"
        if self.split is None:
            if not len(dataset.train) + len(dataset.test):
                sizes = {"training / test": "no index files"}
            ends = {"positions (m)": "not stated" if dataset.places is None else box_in_words(dataset.places)}
            frequency = "not stated" if dataset.frequency.source == "assumed" else frequency
        else:
            parts, ends = self.split.parts, ends_of_spectra(dataset)
            if parts is not None:
                three = " / ".join(str(len(part)) for part in (parts.train, parts.validation, parts.test))
                sizes = {"training / validation / test": three}
        return {
            **dict([heading]),
            "fingerprint": dataset.fingerprint,
            **sizes,
            **ends,
            "frequency": frequency,
            **dict(alone),
            **({} if self.split is None else self.split.described()),
        }

    def figures(self) -> dict[str, Any]:
        """The description in numbers, as ``bisplat check --json`` prints it.

        Returns:
            Of every dataset, the "fingerprint". Of spectra: their number "spectra"; the dictionaries "frequency",
            "array" and "grid", each with a "source" that says how it is known: "metadata" (metadata.json states it),
            "freq.txt", "fitted" (to the pictures) or "assumed"; and "split", with the numbers of spectra "train",
            "validation" and "test" (the folder's own split has no "validation"), the distances between them and the
            spacing of the known positions. Of powers and channels: their "kind", sizes and range. No spectra, if there
            are problems.
        """
        dataset = self.dataset
        if dataset is None:
            return {"spectra": 0, "fingerprint": None, "split": {}}
        found = {"fingerprint": dataset.fingerprint, **SAID[dataset.quantities[0]].figures(dataset)}
        if self.split is not None:
            return found | {"split": self.split.figures()}
        hertz = None if dataset.frequency.source == "assumed" else dataset.frequency.hertz
        return found | {"frequency_hz": hertz, "train": len(dataset.train), "test": len(dataset.test)}


def check(folder: Path | str, split: SplitKind | None = None, guard: float = 0.0, seed: int = 0) -> Check:
    """Check a dataset folder, and whether its own split of spectra, or another one, leaks.

    An invalid folder raises no error; the result lists its faults.

    Args:
        folder: the dataset's folder.
        split: the split of spectra, as ``train`` would make it. None: the folder's own, without a validation part.
        guard: known positions nearer than this to a test position are left out of ``split``, wavelengths.
        seed: seed of ``split``.

    Returns:
        All problems and warnings, and a description of the dataset.

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
        >>> check("data/lab", "blocked").figures()["split"]["test"]
        10
    """
    require_path(folder=folder)
    require_seed(seed=seed)
    require_within(0, GUARD_MOST, "wavelengths", guard=guard)
    if split is not None:
        require_word(SPLITS, split=split)
        require_spectra(Path(folder))
    for name, value in (("guard", guard), ("seed", seed)):
        if value and split is None:
            raise ParameterError(name, f"expected a split beside it, found {value:g}")
    several = several_frequencies(Path(folder))
    inspection = inspect(Path(folder), several[0] if several else None)
    dataset, warnings = inspection.dataset, list(inspection.warnings)
    if dataset is None:
        return Check(inspection.problems, warnings, None)
    if several:
        warnings.append(
            f"the pictures have several frequencies, {named(np.array(several))}; the description is of the first. To "
            f'learn from one of them, make it a dataset: bisplat dataset {folder} -o FOLDER --frequency "'
            f'{dataset.frequency}"'
        )
    of_split = None
    if "spectrum" in dataset.values:
        parts = None if split is None else split_of(dataset, split, seed, guard=guard)
        of_split = SpectraSplit(dataset, split, parts)
        warnings += of_split.warnings()
    warnings += [*SAID[dataset.quantities[0]].oddities(dataset), *assumptions_of(dataset)]
    return Check([], warnings, dataset, of_split)
