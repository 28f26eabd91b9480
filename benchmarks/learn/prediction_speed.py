"""How many spectra does each model predict in a second, on one core and on two, one at a time and 256 at a time?

bisplat simulate lab -n 800 -o runs/lab-800
python -m benchmarks.learn.prediction_speed runs/lab-800 --json

Models that are trained by steps have untrained weights, since only their size matters; ``nerf2`` and ``swiftwrf`` have
the size that ``compare`` gives them without a GPU. ``twin`` traces its scene as described, without the kriging that
known spectra add. The others know 200 spectra of the dataset. Each call goes from positions to spectra in memory, as
``Run.predict`` does, and is repeated for some seconds. The fastest repeat counts on two cores. On one core it is the
one of the least processor time, which other programs of the machine change little. Of a slow model, fewer than 256
spectra are timed.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro
from jaxtyping import Float
from tyro.conf import Positional

from benchmarks.ledger.printing import print_figures

BATCH, KNOWN = 256, 200
"""Number of spectra that are predicted at once, and of known spectra."""

SLOW = 0.02
"""Seconds for a spectrum, from which on a sixteenth of the batch is timed."""

SMALL: dict[str, dict[str, Any]] = {
    "mlp-responses": {},
    "bisplat-aperture": {"primitives": 20, "width": 16},
    "bisplat": {"primitives": 20, "clusters": 16, "ffn_width": 16, "ffn_layers": 1},
}
"""Options of the models where the benchmark is at its smallest."""

Predict = Callable[[Float[np.ndarray, "K 3"]], Any]


def per_second(predict: Predict, positions: Float[np.ndarray, "K 3"], cores: int, seconds: float) -> float:
    """Spectra per second of the fastest of many calls, the first of which is not timed.

    On one core these are seconds of processor time, on several of the clock.
    """
    import numba
    import torch
    from threadpoolctl import threadpool_limits

    clock = time.process_time if cores == 1 else time.perf_counter
    torch.set_num_threads(cores)
    numba.set_num_threads(min(cores, numba.config.NUMBA_NUM_THREADS))  # type: ignore[attr-defined]
    best = float("inf")
    with threadpool_limits(cores):
        predict(positions)
        end = time.perf_counter() + seconds
        while best == float("inf") or time.perf_counter() < end:
            began = clock()
            predict(positions)
            best = min(best, clock() - began)
    return len(positions) / max(best, 1e-9)


def row(predict: Predict, grey: Predict | None, positions: Float[np.ndarray, "K 3"], seconds: float) -> dict[str, Any]:
    """The row of a model. ``grey`` predicts 8-bit grey levels; None: the method has only numbers."""
    single = {cores: per_second(predict, positions[:1], cores, seconds) for cores in (1, 2)}
    many = positions if single[1] > 1 / SLOW else positions[: max(1, len(positions) // 16)]
    figures = {
        "1 core, 1": single[1],
        "1 core, 256": per_second(predict, many, 1, seconds),
        "2 cores, 1": single[2],
        "2 cores, 256": per_second(predict, many, 2, seconds),
    }
    return figures if grey is None else figures | {"1 core, 256, grey levels": per_second(grey, many, 1, seconds)}


def beamforming(dataset: Any) -> Iterator[tuple[str, Predict, Predict | None]]:
    """From known responses to spectra, by a product of matrices in double precision and as predictions do it."""
    from simulate.spectra.compiled_beamformer import compiled_beamformer
    from simulate.spectra.spectrum import normalise

    responses = np.resize(dataset.responses, (BATCH, dataset.array.elements))
    quick = compiled_beamformer(dataset.beamformer)
    assert quick is not None

    def plain(positions: Float[np.ndarray, "K 3"]) -> None:
        normalise(dataset.beamformer.spectrum(responses[: len(positions)]))

    def written(dtype: type) -> Predict:
        single = responses.astype(np.complex64)
        return lambda at: quick.write(single[: len(at)], np.empty((len(at), 90, 360), dtype))

    yield "beamforming alone, reference", plain, None
    yield "beamforming alone, compiled", written(np.float32), written(np.uint8)


def models(dataset: Any, names: list[str], known: int, scene: str) -> Iterator[tuple[str, Predict, Predict | None]]:
    """The models with what predicts numbers and what predicts grey levels."""
    import torch

    from learn.models.base import SpectrumModel
    from learn.models.capabilities import FitsInClosedForm
    from learn.training.prediction import predicted
    from learn.training.registry import model_class, model_entry

    region = np.stack([dataset.positions.min(axis=0), dataset.positions.max(axis=0)])
    for name in names:
        entry, build = model_entry(name), model_class(name)
        small = SMALL.get(name, {}) if known < KNOWN else {}
        options = {**entry.options, **entry.options_without_gpu, **small, **({"scene": scene} if entry.needs else {})}
        model: SpectrumModel = build(region, dataset.beamformer, dataset.wavelength, **options)  # type: ignore[call-arg, arg-type]
        torch.set_num_threads(1)
        if isinstance(model, FitsInClosedForm) and not entry.needs:
            model.fit(dataset, np.arange(known))
        model.eval()

        def as_type(dtype: type, model: SpectrumModel = model) -> Predict:
            return lambda positions: predicted(model, positions, np.dtype(dtype))

        yield name, as_type(np.float32), as_type(np.uint8)


def baselines(dataset: Any, names: list[str], known: int) -> Iterator[tuple[str, Predict, None]]:
    """The baselines of ``compare``, which return numbers."""
    from learn.methods.method_table import methods_of
    from learn.quantities.known import Known
    from learn.quantities.spectra import Spectra

    taught, makes = Known.of(dataset, Spectra(), np.arange(known)), methods_of("spectrum")
    for name in names:
        method = makes[name]()
        method.fit(taught)
        yield name, method.predict, None


def main(
    dataset: Positional[Path] = Path("runs/lab-800"),
    seconds: float = 3.0,
    scene: str = "lab",
    smallest: bool = False,
    json_output: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> None:
    """Time the models."""
    from itertools import chain

    from learn.training.registry import MODELS
    from simulate.dataset.dataset_folder import read_dataset

    read = read_dataset(dataset)
    known, count = (20, 2) if smallest else (KNOWN, BATCH)
    of_models = list(SMALL) if smallest else list(MODELS)
    of_baselines = ["nearest"] if smallest else ["nearest", "inverse-distance", "kriging", "kriging-responses"]
    places = np.random.default_rng(0).uniform(read.positions.min(axis=0), read.positions.max(axis=0), (count, 3))
    rows = {}
    for name, numbers, grey in chain(
        beamforming(read), baselines(read, of_baselines, known), models(read, of_models, known, scene)
    ):
        rows[name] = row(numbers, grey, places, 0.01 if smallest else seconds)
        print(name, rows[name], file=sys.stderr, flush=True)
    reference = rows["beamforming alone, reference"]["1 core, 256"]
    for each in rows.values():
        each |= {column: float(f"{value:.3g}") for column, value in each.items()} | {
            "ratio": float(f"{each['1 core, 256'] / reference:.2g}")
        }
    print_figures(rows, json_output, smallest)


if __name__ == "__main__":
    tyro.cli(main)
