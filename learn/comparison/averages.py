"""Averages over the seeds of rows that measured the same method."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np


def spread_of(key: str) -> str:
    """Key of the standard deviation of a score over the seeds.

    >>> spread_of("ssim_median"), spread_of("error_median_db"), spread_of("ssim_mean")
    ('ssim_spread', 'error_spread_db', 'ssim_mean_spread')
    """
    return key.replace("median", "spread") if "median" in key else f"{key}_spread"


def averaged(rows: Sequence[Mapping[str, Any]], names: Sequence[str], ranked_by: str) -> list[dict[str, Any]]:
    """Average rows that differ in their seed.

    >>> rows = [{"label": "mlp", "seed": 0, "ssim_median": 0.5}, {"label": "mlp", "seed": 1, "ssim_median": 0.75}]
    >>> averaged(rows, ["label"], "ssim_median")
    [{'label': 'mlp', 'ssim_median': 0.625, 'seeds': 2, 'ssim_spread': 0.176776695}]
    """
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
