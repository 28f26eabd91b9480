"""How much faster the compiled CPU renderer is than the torch reference, forward and backward, in one run.

python benchmarks/render.py --json
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable
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


def main(
    batch: int = 8, primitives: int = 500, json_output: Annotated[bool, tyro.conf.arg(name="json")] = False
) -> None:
    """Time both renderers.

    Args:
        batch: spectra.
        primitives: N_p.
        json_output: print one JSON object.
    """
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
