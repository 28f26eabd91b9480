"""How much time and memory do the renderers need?

python -m benchmarks.learn.render --figure docs/generated/render.png --json

Random primitives are rendered forwards and backwards at 90 × 360 directions. Seconds are those of the best of a few
passes. Megabytes are the most that a fresh process uses during one pass, beyond what it used before. ``compiled_torch``
is ``torch.compile`` of the reference. ``cpu`` is the compiled renderer that training uses on a CPU. With a GPU, the
spectra that the Triton renderer makes per second are measured too, 512 at a time.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated, Any

import torch
import tyro

from benchmarks.ledger.printing import print_figures
from learn.models.splatting.ordered import Ordered
from learn.models.splatting.splat import conic_of, splat_reference
from learn.models.splatting.splat_cpu import splat_cpu

Attributes = tuple[torch.Tensor, ...]
Renderer = Callable[..., torch.Tensor]


def renderers(backend: str) -> dict[str, Renderer]:
    """The renderers that run on a CPU; ``backend`` is the one of ``torch.compile``."""
    return {
        "reference": splat_reference,
        "compiled_torch": torch.compile(splat_reference, backend=backend),
        "cpu": splat_cpu,
    }


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


def render(renderer: Renderer, values: Attributes, backward: bool = True) -> None:
    """One pass over the 90 × 360 directions of a picture."""
    azimuth, elevation, scale, rotation, opacity, coefficient = values
    azimuths = torch.arange(360.0, device=azimuth.device)
    elevations = torch.arange(1.0, 91.0, device=azimuth.device)
    ordered = Ordered(azimuth, elevation, conic_of(scale, rotation), opacity, coefficient)
    field = renderer(ordered, azimuths, elevations)
    if backward:
        field.square().sum().backward()


def seconds(renderer: Renderer, values: Attributes, repeats: int, backward: bool = True) -> float:
    """Seconds of the fastest of ``repeats`` passes; one before them compiles and warms up."""
    best = float("inf")
    for _ in range(repeats + 1):
        began = time.perf_counter()
        render(renderer, values, backward)
        if values[0].is_cuda:
            torch.cuda.synchronize()
        best = min(best, time.perf_counter() - began)
    return best


def peak_megabytes(name: str, backend: str, batch: int, primitives: int) -> float:
    """The largest memory of this process during a pass, beyond what it used before. Run it in a fresh process."""
    renderer = renderers(backend)[name]
    if name == "reference":
        render(renderer, attributes(1, 2))
    else:  # what is compiled is compiled for this size
        render(renderer, attributes(batch, primitives))
    values = attributes(batch, primitives)
    Path("/proc/self/clear_refs").write_text("5")  # forget the peak so far
    before = _status("VmRSS")
    render(renderer, values)
    return (_status("VmHWM") - before) / 1e3


def _status(key: str) -> int:
    lines = Path("/proc/self/status").read_text().splitlines()
    return int(next(line.split()[1] for line in lines if line.startswith(key)))


def draw(path: Path, smallest: bool) -> None:
    """Draw the time of a forward and backward pass against the number of primitives and the spectra at a time."""
    import matplotlib.pyplot as plt

    from learn.reports.plots import label_log_axis

    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained", sharey=True)
    several = [
        ("reference", splat_reference, "cpu", (100, 300, 1000, 3000), (1, 2, 4, 8)),
        ("compiled for the CPU", splat_cpu, "cpu", (100, 300, 1000, 3000, 10000), (1, 2, 4, 8, 16, 32)),
    ]
    if torch.cuda.is_available():
        from learn.models.splatting.splat_triton import splat_triton

        several.append(("Triton", splat_triton, "cuda", (100, 300, 1000, 3000, 10000), (1, 4, 16, 64, 256)))
    primitives = 20 if smallest else 500
    for name, renderer, device, counts, batches in several:
        if smallest:
            counts, batches = (10, 20), (1, 2)
        times = [1e3 * seconds(renderer, attributes(1, count, device), 1) for count in counts]
        left.loglog(counts, times, "o-", label=name)
        times = [1e3 * seconds(renderer, attributes(batch, primitives, device), 1) / batch for batch in batches]
        right.loglog(batches, times, "o-", label=name)
    left.set(xlabel="primitives $N_p$", ylabel="milliseconds per spectrum", title="one spectrum")
    right.set(xlabel="spectra at a time", title=f"$N_p$ = {primitives}")
    for axes in (left, right):
        label_log_axis(axes.xaxis)
        label_log_axis(axes.yaxis)
        axes.grid(which="both", alpha=0.3)
        axes.legend()
    figure.suptitle("forward and backward, 90 × 360")
    figure.savefig(path, dpi=120)


def main(
    batch: int = 8,
    primitives: int = 500,
    figure: Path | None = None,
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Compare the renderers."""
    backend, tasks_of_a_process = "inductor", 1
    if smallest:
        batch, primitives = 2, 20
        backend = "eager"  # traces the reference as the other does, and spares the minute of C++ compilation
        tasks_of_a_process = 4  # spares the start of three more
    if figure is not None:
        draw(figure, smallest)
    values = attributes(batch, primitives)
    several = renderers(backend)
    times = {name: seconds(renderer, values, 5 if name == "cpu" else 1) for name, renderer in several.items()}
    # With gigabytes at a time the reference is slow, so the ratios are to the faster and smaller way to use it, one
    # spectrum after the other.
    single = batch * seconds(splat_reference, attributes(1, primitives), 2)
    with ProcessPoolExecutor(1, mp_context=get_context("spawn"), max_tasks_per_child=tasks_of_a_process) as fresh:
        memory = {name: fresh.submit(peak_megabytes, name, backend, batch, primitives).result() for name in times}
        single_memory = fresh.submit(peak_megabytes, "reference", backend, 1, primitives).result()
    result: dict[str, Any] = {
        "batch": batch,
        "primitives": primitives,
        **{f"{name}_seconds": round(value, 4) for name, value in times.items()},
        "reference_one_by_one_seconds": round(single, 4),
        "cpu_ratio": round(min(single, times["reference"]) / times["cpu"], 1),
        "compiled_torch_ratio": round(min(single, times["reference"]) / times["compiled_torch"], 1),
        **{f"{name}_peak_mb": round(value, 1) for name, value in memory.items()},
        "reference_one_by_one_peak_mb": round(single_memory, 1),
        "memory_ratio": round(single_memory / memory["cpu"], 1) if memory["cpu"] > 0 else None,
        "threads": torch.get_num_threads(),
        "cores": os.cpu_count(),
    }
    if torch.cuda.is_available():
        from learn.models.splatting.splat_triton import splat_triton

        many = attributes(512, primitives, "cuda")
        result["device"] = torch.cuda.get_device_name()
        result["cuda_forward_per_second"] = round(512 / seconds(splat_triton, many, 20, backward=False))
        result["cuda_forward_backward_per_second"] = round(512 / seconds(splat_triton, many, 20))
    print_figures(result, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
