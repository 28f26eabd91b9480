"""How a benchmark prints its figures: one JSON object, with the day and the machine they were measured on."""

from __future__ import annotations

import datetime
import json
import os
import platform
from pathlib import Path
from typing import Any


def machine() -> str:
    """The processor's name and number of cores, the operating system, and the version of Python."""
    lines = Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").is_file() else []
    processor = next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), "unknown")
    return f"{os.cpu_count()} cores of {processor}, {platform.system()}, Python {platform.python_version()}"


def print_figures(figures: dict[str, Any], as_json: bool, smallest: bool) -> None:
    """Print the figures of a benchmark to stdout."""
    if as_json:
        circumstances = {"date": datetime.date.today().isoformat(), "machine": machine(), "smallest": smallest}
        print(json.dumps({**figures, **circumstances}, ensure_ascii=False, allow_nan=False))
        return
    for name, value in figures.items():
        if isinstance(value, dict):
            print(name)
            print_figures({f"  {inner}": figure for inner, figure in value.items()}, as_json, smallest)
        else:
            print(f"{name:45} {value}")
