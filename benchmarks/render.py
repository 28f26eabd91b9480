"""How much faster the compiled CPU renderer is than the torch reference, forward and backward, in one run.

python benchmarks/render.py --json
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import torch
import tyro

from learn.splat import _conic, splat_reference
from learn.splat_cpu import splat_cpu

Attributes = tuple[torch.Tensor, ...]


def attributes(batch: int, primitives: int) -> Attributes:
    """Random primitives of the size trained models have: azimuth, elevation, scale, rotation, opacity, coefficient."""
    torch.manual_seed(0)
    values = (
        360 * torch.rand(primitives),
        90 * torch.rand(primitives),
        2 + 10 * torch.rand(batch, primitives, 2),
        torch.pi * torch.rand(batch, primitives),
        0.6 * torch.rand(batch, primitives),
        torch.randn(batch, primitives, dtype=torch.complex64),
    )
    return tuple(value.requires_grad_(True) for value in values)


def seconds(renderer: Callable, values: Attributes, repeats: int) -> float:
    """Best time of one forward and backward pass at 90 × 360."""
    azimuths, elevations = torch.arange(360.0), torch.arange(1.0, 91.0)
    best = float("inf")
    for _ in range(repeats + 1):  # the first compiles and warms up
        began = time.perf_counter()
        azimuth, elevation, scale, rotation, opacity, coefficient = values
        conic = _conic(scale, rotation)
        field = renderer(azimuth, elevation, conic, opacity, coefficient, azimuths, elevations)
        (field.real**2 + field.imag**2).sum().backward()
        best = min(best, time.perf_counter() - began)
    return best


def draw(path: Path) -> None:
    """Time of a forward and backward pass against N_p."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(5.5, 4), layout="constrained")
    for name, renderer, batch, counts in (
        ("reference, batch 1", splat_reference, 1, (100, 300, 1000, 3000)),
        ("compiled for the CPU, batch 1", splat_cpu, 1, (100, 300, 1000, 3000, 10000)),
        ("compiled for the CPU, batch 8", splat_cpu, 8, (100, 300, 1000, 3000, 10000)),
    ):
        times = [1e3 * seconds(renderer, attributes(batch, count), 1) / batch for count in counts]
        axes.loglog(counts, times, "o-", label=name)
    axes.set(xlabel="primitives N_p", ylabel="milliseconds per spectrum", title="forward and backward, 90 × 360")
    axes.grid(which="both", alpha=0.3)
    axes.legend()
    figure.savefig(path, dpi=120)


def main(
    batch: int = 8,
    primitives: int = 500,
    figure: Path | None = None,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Time both renderers.

    Args:
        batch: spectra.
        primitives: N_p.
        figure: also draw time against N_p into this file.
        json_output: print one JSON object.
    """
    if figure is not None:
        draw(figure)
    values = attributes(batch, primitives)
    fast, slow = seconds(splat_cpu, values, 5), seconds(splat_reference, values, 1)
    result: dict[str, Any] = {
        "batch": batch,
        "primitives": primitives,
        "reference_seconds": round(slow, 3),
        "cpu_seconds": round(fast, 4),
        "cpu_ratio": round(slow / fast, 1),
        "threads": torch.get_num_threads(),
        "cores": os.cpu_count(),
    }
    print(json.dumps(result) if json_output else result)


if __name__ == "__main__":
    tyro.cli(main)
