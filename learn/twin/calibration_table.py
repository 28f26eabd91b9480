"""What a calibration changed, as a table for a reader and as entries of calibration.json."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from scenes.scene.unknowns import OF_MATERIALS, Unknown

RECORD = "calibration.json"

UNIT = "metres, radians, or the logarithm of a ratio"


def in_units(unknown: Unknown, value: float, deviation: float) -> tuple[str, str]:
    """A change and its standard deviation in millimetres, degrees or per cent, for a reader."""
    if unknown.kind in ("position", "object"):
        return f"{1e3 * value:+.1f} mm", f"{1e3 * deviation:.1f} mm"
    if unknown.kind == "rotation":
        return f"{np.degrees(value):+.2f}°", f"{np.degrees(deviation):.2f}°"
    digits = 1 if unknown.kind in OF_MATERIALS else 4
    return f"{100 * np.expm1(value):+.{digits}f} %", f"{100 * deviation:.{digits}f} %"


def rows_of(
    which: Sequence[Unknown], values: Float[np.ndarray, " n"], deviations: Float[np.ndarray, " n"]
) -> list[dict[str, str]]:
    """A table of what was changed and by how much, with standard deviations before and after."""
    rows = []
    for unknown, value, deviation in zip(which, values, deviations, strict=True):
        changed, sure = in_units(unknown, float(value), float(deviation))
        before = in_units(unknown, 0.0, unknown.tolerance)[1]
        rows.append({"what": unknown.label, "changed by": changed, "±": sure, "± before": before})
    return rows


def changes_of(
    which: Sequence[Unknown], values: Float[np.ndarray, " n"], deviations: Float[np.ndarray, " n"]
) -> list[dict[str, Any]]:
    """The entries ``changes`` of calibration.json. The arguments are those of ``rows_of``."""
    return [
        {
            "what": unknown.label,
            "kind": unknown.kind,
            "change": float(value),
            "deviation": float(deviation),
            "tolerance": unknown.tolerance,
        }
        for unknown, value, deviation in zip(which, values, deviations, strict=True)
    ]
