"""What a run was trained on, in the few facts that a reader of its scores needs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from learn.data.splits import Split
from learn.training.run_folder import Run


@dataclass(frozen=True)
class Origin:
    """Where a model comes from.

    Example:
        >>> Origin("helmholtz", "lab", "random, seed 0", seed=0, train=18, validation=2)
        Origin(model='helmholtz', dataset='lab', split='random, seed 0', seed=0, train=18, validation=2)
    """

    model: str  # the model's name, or ``module:Class``
    dataset: str  # name of the folder of the dataset it was trained on
    split: str  # kind, guard and seed of the split, in words
    seed: int  # seed of the training
    train: int  # number of training spectra
    validation: int  # number of validation spectra

    @classmethod
    def of(cls, run: Run, parts: Split) -> Origin:
        """The origin of a run's model."""
        config = run.config
        words = split_words(config.split, config.guard, config.split_seed)
        counts = (len(parts.train), len(parts.validation))
        return cls(config.model, Path(config.dataset).name, words, config.seed, *counts)


def split_words(kind: str, guard: float | None, seed: int) -> str:
    """A split in words.

    >>> split_words("random", 0.5, 0)
    'random, guard 0.5 wavelengths, seed 0'
    """
    return f"{kind}, guard {guard:g} wavelengths, seed {seed}" if guard else f"{kind}, seed {seed}"
