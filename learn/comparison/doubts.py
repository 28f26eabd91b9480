"""What is doubtful about measured rows: too few training steps, or scores below those of the mean picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

FEW_STEPS = 100
"""With fewer training steps than this, a model has hardly begun to learn."""

MEAN_PICTURE = "mean_picture_ssim_median"
"""Key of a row: the median SSIM of the mean of the known spectra, on the same test spectra."""

BELOW = 1e-4
"""A median SSIM counts as below another one if it is lower by more than this."""


def average_name(row: Mapping[str, Any]) -> str:
    """The name of a row of ``averages``: its label, and its number of training spectra if it states one.

    >>> average_name({"label": "mlp", "train_size": 200})
    'mlp, 200'
    """
    return row["label"] if row["train_size"] is None else f"{row['label']}, {row['train_size']}"


def took_few_steps(row: Mapping[str, Any]) -> bool:
    """Whether a row was trained for fewer than ``FEW_STEPS`` steps."""
    return row.get("steps") is not None and row["steps"] < FEW_STEPS


def is_below_mean_picture(row: Mapping[str, Any]) -> bool:
    """Whether a row scores lower than the mean of the known spectra. Rows of older versions do not tell."""
    return row.get(MEAN_PICTURE) is not None and row["ssim_median"] < row[MEAN_PICTURE] - BELOW


def doubts_of(averages: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """What is doubtful about each row that has doubts, by ``average_name``.

    >>> row = {"label": "mlp", "train_size": None, "ssim_median": 0.4, "steps": 20, MEAN_PICTURE: 0.5}
    >>> doubts_of([row])
    {'mlp': 'only 20 training steps; below the mean picture (0.500)'}
    """
    found = {}
    for row in averages:
        each = [f"only {row['steps']:g} training steps"] if took_few_steps(row) else []
        if is_below_mean_picture(row):
            each.append(f"below the mean picture ({row[MEAN_PICTURE]:.3f})")
        if each:
            found[average_name(row)] = "; ".join(each)
    return found


def footnote_of(averages: Sequence[Mapping[str, Any]]) -> str:
    """What the mark of rows with doubts means. Empty: there are no such rows.

    >>> footnote_of([{"label": "mlp", "train_size": None, "ssim_median": 0.4, "steps": 20}])
    '† fewer than 100 training steps: says little'
    """
    found = [f"fewer than {FEW_STEPS} training steps"] if any(map(took_few_steps, averages)) else []
    if any(map(is_below_mean_picture, averages)):
        found.append("below the mean picture")
    return f"† {', or '.join(found)}: says little" if found else ""


def remark_on(averages: Sequence[Mapping[str, Any]], minutes: float | None) -> str | None:
    """Name all rows with doubts, for a reader of the table."""
    few = [f"{average_name(row)} ({row['steps']:g})" for row in averages if took_few_steps(row)]
    below = [
        f"{average_name(row)} ({row['ssim_median']:.3f} against {row[MEAN_PICTURE]:.3f})"
        for row in averages
        if is_below_mean_picture(row)
    ]
    sentences = []
    if few and minutes is not None:
        sentences.append(
            f"only a few training steps fit into {minutes:g} minutes: {', '.join(few)}; such a score says little, so "
            "give a larger budget, in another folder"
        )
    elif few:
        sentences.append(
            f"only a few training steps were asked for: {', '.join(few)}; such a score says little, so give more "
            "steps, in another folder"
        )
    if below:
        sentences.append(
            f"below the mean of the known spectra, which is the same everywhere: {', '.join(below)}; differences "
            "between such rows say nothing about the methods"
        )
    if not sentences:
        return None
    first, *others = sentences
    return ". ".join([first, *(f"{each[0].upper()}{each[1:]}" for each in others)])
