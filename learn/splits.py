"""Which spectra a model is trained, validated and tested on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from jaxtyping import Int

from scenes.errors import InputError

if TYPE_CHECKING:  # importing it is slow, and the command line's help only needs SplitKind
    from simulate.dataset import Dataset

SplitKind = Literal["files", "random", "blocked"]

TEST_FRACTION = 0.2
"""Share of the spectra that ``random`` holds out for testing, as the published loaders do (80/20)."""

BLOCK, EVERY = 10, 4
"""``blocked`` holds out every fourth block of ten consecutive spectra for testing."""

VALIDATION_FRACTION = 0.1
"""Share of the training part that is set aside to choose the best checkpoint. The test part chooses nothing."""


@dataclass(frozen=True)
class Split:
    """Disjoint parts of a dataset, as indices of its spectra.

    Attributes:
        train: spectra that a model is trained on.
        validation: spectra that choose the best checkpoint.
        test: spectra that a model is scored on.
    """

    train: Int[np.ndarray, " n_train"]
    validation: Int[np.ndarray, " n_validation"]
    test: Int[np.ndarray, " n_test"]

    @property
    def known(self) -> Int[np.ndarray, " n_known"]:
        """Training and validation part together, sorted: the spectra that a baseline may interpolate."""
        return np.sort(np.concatenate([self.train, self.validation]))


def split(dataset: Dataset, kind: SplitKind, seed: int, train_size: int | None = None) -> Split:
    """Split a dataset.

    ``files`` reads the folder's own train_index.txt and test_index.txt. ``random`` draws 20 % for testing. ``blocked``
    holds out every fourth block of ten consecutive spectra. Measured positions follow a path: ``random``, and the
    index files of most folders, put the spectra recorded just before and after a test spectrum into the training part;
    ``blocked`` does so only at the ends of a block.

    The validation part is 10 % of the training part; with ``blocked`` it consists of whole blocks.

    Args:
        dataset: the spectra.
        kind: how the test part is chosen.
        seed: seed of the test part of ``random``, and of the validation part.
        train_size: number of training spectra to keep; a smaller part is contained in every larger one. The validation
            part shrinks in proportion, since baselines use it too; the test part stays the same. None: keep all.

    Returns:
        Disjoint parts, each sorted.

    Raises:
        InputError: the dataset has too few spectra for three parts, or fewer training spectra than ``train_size``.
    """
    count = len(dataset.names)
    generator = np.random.default_rng(seed)
    block = np.arange(count) // BLOCK
    if kind == "files":
        known, test = dataset.train, dataset.test
        if not (len(known) or len(test)):
            raise InputError(
                f"{dataset.folder}: expected train_index.txt and test_index.txt for the split files, found neither; "
                "use the split random or blocked"
            )
    elif kind == "random":
        order = generator.permutation(count)
        held_out = round(TEST_FRACTION * count)
        known, test = np.sort(order[held_out:]), np.sort(order[:held_out])
    else:
        held_out_block = block % EVERY == 1
        known, test = np.flatnonzero(~held_out_block), np.flatnonzero(held_out_block)

    unit = block[known] if kind == "blocked" else known
    units = np.unique(unit)
    chosen = generator.permutation(units)[: max(1, round(VALIDATION_FRACTION * len(units)))]
    in_validation = np.isin(unit, chosen)
    train, validation = known[~in_validation], known[in_validation]
    if train_size is not None:
        if train_size > len(train):
            raise InputError(f"{dataset.folder}: expected {train_size} spectra to train on, found {len(train)}")
        share = train_size / len(train)
        train = np.sort(generator.permutation(train)[:train_size])
        validation = np.sort(generator.permutation(validation)[: max(1, round(share * len(validation)))])
    result = Split(train=train, validation=validation, test=test)
    if not (len(result.train) and len(result.test)):
        raise InputError(
            f"{dataset.folder}: expected enough spectra for a {kind} split into training, validation and test, "
            f"found {count}, which leaves {len(result.train)}, {len(result.validation)} and {len(result.test)}"
        )
    return result
