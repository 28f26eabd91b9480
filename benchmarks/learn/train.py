"""Is training on few pixels, or with less exact matrix products, as good as without, and how much faster is it?

python -m benchmarks.learn.train runs/demo/dataset --json

For every model trained in steps, the throughput of the loss and its gradients is measured, in thousands of spectra per
minute: at all pixels with 8 spectra at a time, at few pixels as ``bisplat train`` does it from pictures with the
model's own batch, and, for models that predict responses, from responses. A ratio says how much faster the last is than
the first. The throughput at few pixels is also measured with matrix products in bfloat16
(``bisplat train --matmul-precision medium``), which some processors and most GPUs multiply faster.

Then three trainings with the same number of steps of 8 spectra are compared by validation SSIM and seconds: one at all
pixels, one at few pixels except for the last tenth of the steps, and one as the second, with matrix products in
bfloat16. For models that splat primitives, the throughput of their networks alone is measured too. nerf2 never used all
pixels: its first figure is for random pixels, drawn separately for each spectrum. bisplat-plus is not trained, since
each step takes seconds.
"""

from __future__ import annotations

import json
import tempfile
import time
from contextlib import nullcontext
from pathlib import Path
from typing import Annotated, Any
from unittest.mock import patch

import tyro
from tyro.conf import Positional

from benchmarks.ledger.printing import print_figures

BATCH = 8
"""Number of spectra per step before the pixels became few."""

ONLY_TIMED = ("bisplat-plus", "nerf2", "wrf-gs-plus", "gsrf")
"""Models that are not trained here; the losses of NeRF², WRF-GS+ and GSRF have no few pixels."""

SPLATTED = {
    "bisplat": "learn.models.networks.bisplat.splat",
    "bisplat-plus": "learn.models.networks.bisplat.splat",
    "swiftwrf": "learn.models.peers.swiftwrf.splat_in_order",
    "wrf-gs-plus": "learn.models.peers.wrf_gs_plus.splat_in_order",
    "gsrf": "learn.models.peers.gsrf.splat_in_order",
}
"""What splats primitives, of the models that do."""

PIXELS_APART = 128
"""For the first figure of nerf2: number of random pixels drawn separately for each spectrum."""

SMALL = {
    "bisplat": {"primitives": 20, "clusters": 16, "ffn_width": 16, "transformer_layers": 1},
    "bisplat-aperture": {"primitives": 20, "width": 16},
}
"""Options of the models where the benchmark is at its smallest."""


def spectra_per_minute(
    name: str, dataset: Any, batch_size: int, of: str, options: dict[str, Any], precision: Any = "highest"
) -> float:
    """Thousands of spectra per minute through loss and gradients: median of five steps, after two. 0: impossible."""
    # Torch and Lightning take seconds to import, which --help need not wait for.
    import numpy as np
    import torch

    from learn.data.splits import split
    from learn.models.capabilities import HasOwnLoss, PredictsResponses
    from learn.models.model_settings import Steps
    from learn.models.quadrature import quadrature
    from learn.training.config import Config
    from learn.training.gradient_steps import Spectra, Training
    from learn.training.lightning_trainer import computing
    from learn.training.run_files import box_of, build_model

    torch.manual_seed(0)
    config = Config(dataset=str(dataset.folder), model=name, options=options)
    parts = split(dataset, "files", 0)
    model = build_model(config, box_of(dataset.positions), dataset.beamformer, dataset.wavelength)
    module = Training(model, Steps(batch_size=batch_size), quadrature(dataset.beamformer))
    optimiser = module.configure_optimizers()["optimizer"]
    learned = dataset.responses if of == "responses" else None
    positions, pictures, known = next(iter(Spectra(dataset, parts, batch_size, 0, learned).train_dataloader()))
    if of == "responses" and not (isinstance(model, PredictsResponses) and known.shape[1]):
        return 0.0
    coarse = of != "all" and not isinstance(model, HasOwnLoss)
    batches: list[Any] = [(positions, pictures, known)]
    if of == "all" and name == "nerf2":
        model.rays = PIXELS_APART
        batches = list(zip(*(part.split(1) for part in batches[0]), strict=True))
    seconds = []
    without_splatting = patch(SPLATTED[name], nothing_splatted) if of == "networks" else nullcontext()
    with without_splatting, computing(precision, on_one_thread=of == "responses"):
        for _ in range(7):
            began = time.perf_counter()
            optimiser.zero_grad()
            sum(module.loss(*batch, coarse=coarse) for batch in batches).backward()
            optimiser.step()
            seconds.append(time.perf_counter() - began)
    return 0.06 * len(positions) / float(np.median(seconds[2:]))


def nothing_splatted(primitives: Any, azimuths: Any, elevations: Any) -> Any:
    """A cheap field that depends on all attributes of the primitives, with the arguments of the renderers."""
    import torch

    tensors = [each for part in primitives for each in (part if isinstance(part, tuple) else (part,))]
    together = torch.stack([each.sum() for each in tensors]).sum()
    return together.expand(len(primitives.coefficient), len(elevations), len(azimuths), 2) * 1e-9


def trained(name: str, dataset: Any, label: str, **settings: Any) -> dict[str, float]:
    """Validation SSIM and seconds of a training on pictures alone."""
    from learn.fitted.runs import train

    pictures = dataset.with_values(response=None)
    with tempfile.TemporaryDirectory() as folder:
        run = Path(folder) / "run"
        train(pictures, run, model=name, batch_size=BATCH, find_phases=False, **settings)
        training = json.loads((run / "training.json").read_text())
    return {f"ssim_{label}": round(training["validation_ssim"], 3), f"seconds_{label}": round(training["seconds"], 1)}


def main(
    dataset: Positional[Path],
    steps: int = 600,
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Time the models, and train them at all pixels and at few."""
    from learn.training.registry import MODELS, model_entry
    from simulate.dataset.dataset_folder import read_dataset

    known = read_dataset(dataset)
    names = list(SMALL) if smallest else [name for name, entry in MODELS.items() if entry.by_steps]
    result: dict[str, Any] = {}
    for name in names:
        entry, options = model_entry(name), SMALL[name] if smallest else dict(model_entry(name).options_without_gpu)
        batch = entry.by_steps.batch_size if entry.by_steps else BATCH
        row = {
            "all pixels": spectra_per_minute(name, known, BATCH, "all", options),
            "few pixels": spectra_per_minute(name, known, batch, "few", options),
            "responses": spectra_per_minute(name, known, batch, "responses", options),
        }
        row = {measured: round(value, 2) for measured, value in row.items() if value}
        row["ratio"] = round(max(row.values()) / row["all pixels"], 1)
        row["few pixels, bfloat16"] = round(spectra_per_minute(name, known, batch, "few", options, "medium"), 2)
        if name in SPLATTED:
            row["networks alone"] = round(spectra_per_minute(name, known, batch, "networks", options), 2)
        if name not in ONLY_TIMED:
            settings: Any = {"steps": 2 if smallest else steps, "options": options}
            row |= trained(name, known, "all", full_resolution=1.0, **settings)
            row |= trained(name, known, "few", full_resolution=0.1, **settings)
            row |= trained(name, known, "bfloat16", full_resolution=0.1, matmul_precision="medium", **settings)
        result[name] = row
    print_figures(result, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
