"""How much faster, and how much smaller, the compiled renderer is than the torch reference: forward and backward.

python benchmarks/render.py --json

``torch.compile`` of the reference is the other way we measured to a compiled renderer. Memory is the most that a fresh
process holds while it renders once, over what it held before.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated, Any

import torch
import tyro

from learn.models.splat import _conic, splat_reference
from learn.models.splat_cpu import splat_cpu

RENDERERS: dict[str, Callable[..., torch.Tensor]] = {
    "reference": splat_reference,
    "compiled_torch": torch.compile(splat_reference),
    "cpu": splat_cpu,
}

Attributes = tuple[torch.Tensor, ...]


def attributes(batch: int, primitives: int, device: str = "cpu") -> Attributes:
    """Random primitives of the size trained models have: azimuth, elevation, scale, rotation, opacity, coefficient."""
    torch.manual_seed(0)
    values = (
        360 * torch.rand(primitives),
        90 * torch.rand(primitives),
        2 + 10 * torch.rand(batch, primitives, 2),
        torch.pi * torch.rand(batch, primitives),
        0.6 * torch.rand(batch, primitives),
        torch.randn(batch, primitives, 2),
    )
    return tuple(value.to(device).requires_grad_(True) for value in values)


def render(renderer: Callable[..., torch.Tensor], values: Attributes, backward: bool = True) -> None:
    """One pass at 90 × 360."""
    azimuth, elevation, scale, rotation, opacity, coefficient = values
    azimuths = torch.arange(360.0, device=azimuth.device)
    elevations = torch.arange(1.0, 91.0, device=azimuth.device)
    field = renderer(azimuth, elevation, _conic(scale, rotation), opacity, coefficient, azimuths, elevations)
    if backward:
        field.square().sum().backward()


def seconds(renderer: Callable[..., torch.Tensor], values: Attributes, repeats: int, backward: bool = True) -> float:
    """Best time of a pass."""
    best = float("inf")
    for _ in range(repeats + 1):  # the first compiles and warms up
        began = time.perf_counter()
        render(renderer, values, backward)
        if values[0].is_cuda:
            torch.cuda.synchronize()
        best = min(best, time.perf_counter() - began)
    return best


def peak_megabytes(name: str, batch: int, primitives: int) -> float:
    """In a process of its own: the most memory held during a pass, over what was held before."""
    if name == "reference":
        render(RENDERERS[name], attributes(1, 2))
    else:  # what is compiled is compiled for this size
        render(RENDERERS[name], attributes(batch, primitives))
    values = attributes(batch, primitives)
    Path("/proc/self/clear_refs").write_text("5")  # forget the peak so far
    before = _status("VmRSS")
    render(RENDERERS[name], values)
    return (_status("VmHWM") - before) / 1e3


def _status(key: str) -> int:
    lines = Path("/proc/self/status").read_text().splitlines()
    return int(next(line.split()[1] for line in lines if line.startswith(key)))


def draw(path: Path) -> None:
    """Time of a forward and backward pass against the number of primitives and the batch."""
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained", sharey=True)
    several = [
        ("reference", splat_reference, "cpu", (100, 300, 1000, 3000), (1, 2, 4, 8)),
        ("compiled for the CPU", splat_cpu, "cpu", (100, 300, 1000, 3000, 10000), (1, 2, 4, 8, 16, 32)),
    ]
    if torch.cuda.is_available():
        from learn.models.splat_triton import splat_triton

        several.append(("Triton", splat_triton, "cuda", (100, 300, 1000, 3000, 10000), (1, 4, 16, 64, 256)))
    for name, renderer, device, counts, batches in several:
        times = [1e3 * seconds(renderer, attributes(1, count, device), 1) for count in counts]
        left.loglog(counts, times, "o-", label=name)
        times = [1e3 * seconds(renderer, attributes(batch, 500, device), 1) / batch for batch in batches]
        right.loglog(batches, times, "o-", label=name)
    left.set(xlabel="primitives $N_p$", ylabel="milliseconds per spectrum", title="one spectrum")
    right.set(xlabel="spectra at a time", title="$N_p$ = 500")
    for axis in (left, right):
        axis.grid(which="both", alpha=0.3)
        axis.legend()
    figure.suptitle("forward and backward, 90 × 360")
    figure.savefig(path, dpi=120)


def main(
    batch: int = 8,
    primitives: int = 500,
    figure: Path | None = None,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Compare the renderers.

    Args:
        batch: spectra.
        primitives: N_p.
        figure: also draw time against N_p and batch into this file.
        json_output: print one JSON object.
    """
    if figure is not None:
        draw(figure)
    values = attributes(batch, primitives)
    times = {name: seconds(renderer, values, 5 if name == "cpu" else 1) for name, renderer in RENDERERS.items()}
    # Gigabytes at a time make the reference slow: the ratios are to the faster and smaller way, one spectrum by one.
    single = batch * seconds(splat_reference, attributes(1, primitives), 2)
    with ProcessPoolExecutor(1, mp_context=get_context("spawn"), max_tasks_per_child=1) as fresh:
        memory = {name: fresh.submit(peak_megabytes, name, batch, primitives).result() for name in RENDERERS}
        single_memory = fresh.submit(peak_megabytes, "reference", 1, primitives).result()
    result: dict[str, Any] = {
        "batch": batch,
        "primitives": primitives,
        **{f"{name}_seconds": round(value, 4) for name, value in times.items()},
        "reference_one_by_one_seconds": round(single, 4),
        "cpu_ratio": round(min(single, times["reference"]) / times["cpu"], 1),
        "compiled_torch_ratio": round(min(single, times["reference"]) / times["compiled_torch"], 1),
        **{f"{name}_peak_mb": round(value, 1) for name, value in memory.items()},
        "reference_one_by_one_peak_mb": round(single_memory, 1),
        "memory_ratio": round(single_memory / memory["cpu"], 1),
        "threads": torch.get_num_threads(),
        "cores": os.cpu_count(),
    }
    if torch.cuda.is_available():
        from learn.models.splat_triton import splat_triton

        many = attributes(512, primitives, "cuda")
        result["device"] = torch.cuda.get_device_name()
        result["cuda_forward_per_second"] = round(512 / seconds(splat_triton, many, 20, backward=False))
        result["cuda_forward_backward_per_second"] = round(512 / seconds(splat_triton, many, 20))
    print(json.dumps(result) if json_output else json.dumps(result, indent=2))


if __name__ == "__main__":
    tyro.cli(main)
