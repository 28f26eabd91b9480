"""Rows averaged over the seeds, and what is doubtful about them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from learn.quantities.quantity import Quantity

FEW_STEPS = 100  # With fewer training steps than this, a model has hardly begun to learn

BELOW = 1e-4  # A score counts as worse than another one if it is so by more than this


def average_name(row: Mapping[str, Any]) -> str:
    """The name of a row of ``averages``: its label, and its number of training rows if it states one."""
    return row["label"] if row["train_size"] is None else f"{row['label']}, {row['train_size']}"


def took_few_steps(row: Mapping[str, Any]) -> bool:
    """Whether a row was trained for fewer than ``FEW_STEPS`` steps."""
    return row.get("steps") is not None and row["steps"] < FEW_STEPS


def below_mean(row: Mapping[str, Any], averages: Sequence[Mapping[str, Any]], quantity: Quantity) -> float | None:
    """The score of the mean of the known values, if a row is worse. None: it is not, or this is not known."""
    key = quantity.ranked_by
    for mean in averages:
        if mean["label"] == quantity.mean and mean["train_size"] == row["train_size"]:
            return mean[key] if row[key] < mean[key] - BELOW else None
    return None


def doubts_of(averages: Sequence[Mapping[str, Any]], quantity: Quantity) -> dict[str, str]:
    """What is doubtful about each row that has doubts, by ``average_name``."""
    found = {}
    for row in averages:
        each = [f"only {row['steps']:g} training steps"] if took_few_steps(row) else []
        least = below_mean(row, averages, quantity)
        if least is not None:
            each.append(f"worse than the mean of what is known ({least:.3f})")
        if each:
            found[average_name(row)] = "; ".join(each)
    return found


def footnote_of(doubts: Mapping[str, str]) -> str:
    """What the mark of rows with doubts means. Empty: there are no such rows."""
    reasons = {"only": f"fewer than {FEW_STEPS} training steps", "worse": "worse than the mean of what is known"}
    found = [words for start, words in reasons.items() if any(start in each for each in doubts.values())]
    return f"† {', or '.join(found)}: says little" if found else ""


def remark_on(averages: Sequence[Mapping[str, Any]], quantity: Quantity, minutes: float | None) -> str | None:
    """Name all rows with doubts, for a reader of the table."""
    few = [f"{average_name(row)} ({row['steps']:g})" for row in averages if took_few_steps(row)]
    leasts = [(row, below_mean(row, averages, quantity)) for row in averages]
    below = [
        f"{average_name(row)} ({row[quantity.ranked_by]:.3f} against {least:.3f})"
        for row, least in leasts
        if least is not None
    ]
    sentences = []
    if few:
        asked = "were asked for" if minutes is None else f"fit into {minutes:g} minutes"
        more = "more steps" if minutes is None else "a larger budget"
        sentences.append(
            f"only a few training steps {asked}: {', '.join(few)}; such a score says little, so give {more}, in "
            "another folder"
        )
    if below:
        sentences.append(
            f"worse than the mean of what is known, which is the same everywhere: {', '.join(below)}; differences "
            "between such rows say nothing about the methods"
        )
    if not sentences:
        return None
    first, *others = sentences
    return ". ".join([first, *(f"{each[0].upper()}{each[1:]}" for each in others)])


def spread_of(key: str) -> str:
    """Key of the standard deviation of a score over the seeds."""
    return key.replace("median", "spread") if "median" in key else f"{key}_spread"


def averaged(rows: Sequence[Mapping[str, Any]], names: Sequence[str], ranked_by: str) -> list[dict[str, Any]]:
    """Average rows that differ in their seed."""
    groups: dict[tuple[Any, ...], list[Mapping[str, Any]]] = {}
    for row in rows:
        groups.setdefault(tuple(row[name] for name in names), []).append(row)
    found = []
    for group in groups.values():
        columns = {key: [row.get(key) for row in group] for key in group[0] if key not in (*names, "seed")}
        means = {key: _mean(values) for key, values in columns.items() if all(map(_is_score, values))}
        row = {name: group[0][name] for name in names} | means | {"seeds": len(group)}
        if len(group) > 1 and row[ranked_by] is not None:
            row[spread_of(ranked_by)] = round(float(np.std([each[ranked_by] for each in group], ddof=1)), 9)
        found.append(row)
    return found


def _is_score(value: Any) -> bool:
    return value is None or (isinstance(value, int | float) and not isinstance(value, bool))


def _mean(values: list[Any]) -> float | None:
    """The mean, None where one is None. What all rows have in common stays as it is, so that counts stay whole."""
    if all(each == values[0] for each in values):
        return values[0]
    return None if None in values else float(np.mean(values))
