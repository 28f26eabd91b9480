"""How long training bisplat-aperture takes with the training loop as first written, and with the loop as it is.

python benchmarks/train.py runs/demo/dataset --json

Measured: milliseconds of a training step of eight spectra and of its parts (renderer, loss, optimiser, networks), the
median of ten; seconds of a whole training with either loop on the same dataset, with the same seed, steps, batch and
learning rate; and the seconds that the loop as it is needs for the validation SSIM that the first one ends with.

The steps that are timed look at all pixels; of the present loop's whole training nine tenths look at a few only. As
first written, the loop used the reference renderer (learn.models.splat.splat_reference), computed the loss's SSIM
one spectrum at a time and the AdamW update one parameter at a time, did not average weights, and encoded the position
in six octaves instead of three.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Any

import tyro
from report.printing import print_figures
from tyro.conf import Positional


def main(
    dataset: Positional[Path],
    steps: int = 1500,
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Time both training loops.

    Args:
        dataset: folder of the dataset to train on; the figures of docs/results.md are of the demo's.
        steps: optimiser steps of both.
        smallest: a run of seconds that shows that the benchmark works; its figures mean nothing.
        json_output: print one JSON object.
    """
    # Lightning takes seconds to import, which --help need not wait for.
    import torch
    from timing.training import SMALL, BiSplatWRF, as_first_written, step_milliseconds, training

    from learn.models.encoding import TX_ORDER

    backend, options = "inductor", {}
    if smallest:
        steps, options = 2, SMALL
        backend = "eager"  # traces the networks as the other does, and spares the minute of C++ compilation

    def compile_networks(model: BiSplatWRF) -> None:
        for part in (model.bst, model.delta):
            part.compile(backend=backend)

    ours = step_milliseconds(smallest)
    compiled = step_milliseconds(smallest, networks=compile_networks)
    with torch.autocast("cpu", torch.bfloat16):
        half = step_milliseconds(smallest)
    with as_first_written():
        first = step_milliseconds(smallest)
        first_seconds, first_ssim = training(dataset, steps, {**options, "tx_order": TX_ORDER}, 1.0)
    our_seconds, our_ssim = training(dataset, steps, options, 0.1)

    final = float(first_ssim.iloc[-1])
    reached = our_ssim.index[our_ssim >= final]
    to_final = our_seconds * (reached[0] + 1) / (our_ssim.index[-1] + 1) if len(reached) else None
    result: dict[str, Any] = {
        "final_validation_ssim_first": round(final, 4),
        "final_validation_ssim_ours": round(float(our_ssim.iloc[-1]), 4),
        "seconds_first": first_seconds,
        "seconds_ours": our_seconds,
        "seconds_to_final_ssim_of_first": None if to_final is None else round(to_final, 1),
        "ratio_to_final_ssim": None if to_final is None else round(first_seconds / to_final, 1),
        **{f"first_{name}_ms": round(value, 1) for name, value in first.items()},
        **{f"ours_{name}_ms": round(value, 1) for name, value in ours.items()},
        "networks_compiled_step_ms": round(compiled["step"], 1),
        "bfloat16_step_ms": round(half["step"], 1),
        "threads": torch.get_num_threads(),
        "cores": os.cpu_count(),
    }
    print_figures(result, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
